//! The single changes to a disk, each of which a test can make fail.

use std::{
    fs::{self, File, OpenOptions},
    io::{self, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

use rayon::prelude::*;

use super::faults::{self, Call};

/// Who may read a new file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Only its owner.
    Private,
    /// Whoever may read the user's other files.
    Usual,
}

/// A file that is open for writing.
#[derive(Debug)]
pub struct Out {
    file: File,
    path: PathBuf,
}

impl Out {
    /// Creates a file, for reading and writing.
    ///
    /// # Errors
    /// Those of the system; [`io::ErrorKind::AlreadyExists`] if there is one of this name.
    pub fn create(path: &Path, access: Access) -> io::Result<Self> {
        faults::step(path, Call::Create)?;
        let mut options = OpenOptions::new();
        options.read(true).write(true).create_new(true);
        #[cfg(unix)]
        {
            use std::os::unix::fs::OpenOptionsExt as _;
            options.mode(if access == Access::Private { 0o600 } else { 0o666 });
        }
        #[cfg(not(unix))]
        let _ = access;
        Ok(Self { file: options.open(path)?, path: path.to_owned() })
    }

    /// A file that is already open for writing.
    #[must_use]
    pub fn opened(file: File, path: &Path) -> Self {
        Self { file, path: path.to_owned() }
    }

    /// The open file, for reading.
    #[must_use]
    pub const fn file(&self) -> &File {
        &self.file
    }

    /// Changes the length of the file.
    ///
    /// # Errors
    /// Those of the system.
    pub fn set_len(&self, bytes: u64) -> io::Result<()> {
        faults::step(&self.path, Call::Create)?;
        self.file.set_len(bytes)
    }

    /// Waits until the content of the file is on the disk.
    ///
    /// # Errors
    /// Those of the system.
    pub fn flush_to_disk(&self) -> io::Result<()> {
        if faults::step(&self.path, Call::Flush)? { Ok(()) } else { self.file.sync_data() }
    }

    /// Notes that the file has been renamed.
    pub(super) fn rename(&mut self, to: &Path) -> io::Result<()> {
        rename(&self.path, to)?;
        to.clone_into(&mut self.path);
        Ok(())
    }
}

impl Write for Out {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if let Err(refused) = faults::step(&self.path, Call::Write) {
            if refused.is_first {
                // what the system has written before it fails
                let _ = self.file.write(&bytes[..bytes.len() / 2]);
            }
            return Err(refused.into());
        }
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Seek for Out {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}

/// Waits until the content of a file is on the disk.
fn flush_file(path: &Path) -> io::Result<()> {
    // some systems flush only files that are open for writing
    let file = File::options().write(true).open(path)?;
    if faults::step(path, Call::Flush)? { Ok(()) } else { file.sync_data() }
}

/// Waits until all files of a folder, and those below it, are on the disk.
///
/// # Errors
/// Those of the disk.
pub fn flush_all(folder: &Path) -> io::Result<()> {
    let (mut files, mut folders, mut next) = (Vec::new(), Vec::new(), vec![folder.to_owned()]);
    while let Some(folder) = next.pop() {
        for entry in fs::read_dir(&folder)? {
            let entry = entry?;
            let is_folder = entry.file_type()?.is_dir();
            if is_folder { next.push(entry.path()) } else { files.push(entry.path()) }
        }
        folders.push(folder);
    }
    // The disk flushes several files at about the cost of one. The steps of a test have one order.
    if faults::are_planned() {
        files.sort();
        files.iter().try_for_each(|file| flush_file(file))?;
    } else {
        files.par_iter().try_for_each(|file| flush_file(file))?;
    }
    folders.iter().try_for_each(|folder| flush_folder(folder))
}

/// Errors of a system that cannot flush a folder.
const CANNOT_FLUSH: [io::ErrorKind; 3] =
    [io::ErrorKind::InvalidInput, io::ErrorKind::Unsupported, io::ErrorKind::PermissionDenied];

/// Waits until the names in a folder are on the disk, where the system can.
///
/// # Errors
/// Those of the disk.
pub fn flush_folder(folder: &Path) -> io::Result<()> {
    let is_planned = faults::step(folder, Call::Flush)?;
    if is_planned || cfg!(not(unix)) {
        return Ok(());
    }
    match File::open(folder).and_then(|folder| folder.sync_all()) {
        // some file systems cannot, and a folder may be writable but not readable
        Err(error) if CANNOT_FLUSH.contains(&error.kind()) => Ok(()),
        flushed => flushed,
    }
}

/// Renames a file or a folder; a file that has the new name is replaced.
///
/// # Errors
/// Those of the system.
pub fn rename(from: &Path, to: &Path) -> io::Result<()> {
    faults::step(to, Call::Rename)?;
    fs::rename(from, to)?;
    faults::renamed(from, to);
    Ok(())
}

/// Removes a file.
///
/// # Errors
/// Those of the system.
pub fn remove_file(path: &Path) -> io::Result<()> {
    faults::step(path, Call::Remove)?;
    fs::remove_file(path)
}

/// Removes an empty folder.
///
/// # Errors
/// Those of the system.
pub fn remove_folder(path: &Path) -> io::Result<()> {
    faults::step(path, Call::Remove)?;
    fs::remove_dir(path)
}

/// Removes a folder with everything in it, file by file; links are not followed.
///
/// # Errors
/// Those of the system; some files are gone then.
pub fn remove_all(folder: &Path) -> io::Result<()> {
    if !faults::are_planned() {
        return fs::remove_dir_all(folder);
    }
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let is_folder = entry.file_type()?.is_dir();
        if is_folder { remove_all(&entry.path())? } else { remove_file(&entry.path())? }
    }
    remove_folder(folder)
}

/// Creates a folder that only its owner may read.
///
/// # Errors
/// Those of the system; [`io::ErrorKind::AlreadyExists`] if there is something of this name.
pub(super) fn create_private_folder(path: &Path) -> io::Result<()> {
    faults::step(path, Call::Create)?;
    let mut builder = fs::DirBuilder::new();
    #[cfg(unix)]
    {
        use std::os::unix::fs::DirBuilderExt as _;
        builder.mode(0o700);
    }
    builder.create(path)
}

/// Creates a folder.
///
/// # Errors
/// Those of the system; [`io::ErrorKind::AlreadyExists`] if there is something of this name.
pub fn create_folder(path: &Path) -> io::Result<()> {
    faults::step(path, Call::Create)?;
    fs::create_dir(path)
}

/// Creates a folder and those above it that are missing. Only its owner may write into a private one.
///
/// # Errors
/// Those of the system.
pub fn create_folders(path: &Path, access: Access) -> io::Result<()> {
    if path.is_dir() {
        return Ok(());
    }
    faults::step(path, Call::Create)?;
    let mut builder = fs::DirBuilder::new();
    #[cfg(unix)]
    if access == Access::Private {
        std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o755);
    }
    builder.recursive(true).create(path)
}

/// The folder of a file.
pub(super) fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}
