//! A file under a temporary name, which is renamed when it is complete.

use std::{
    io::{self, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

use super::{
    calls::{Access, Out, flush_folder, folder_of, remove_file},
    hold::{PART, hold, is_temporary},
    sweep::sweep,
};
use crate::memory::Leftover;

/// A file that is being written. Readers never see it incomplete, and an earlier file of its name stays as it was until
/// then. Dropped before [`Self::persist`], it leaves nothing.
#[derive(Debug)]
pub struct Part {
    out: Out,
    target: PathBuf,
    /// The temporary name. None when it has been renamed.
    temporary: Option<PathBuf>,
    /// Removes it if the program ends for lack of memory. None in a folder that is removed as a whole.
    _leftover: Option<Leftover>,
}

impl Part {
    /// Begins the file of this name, and removes what dead processes have left in its folder.
    ///
    /// # Errors
    /// Those of the system.
    pub fn begin(target: &Path, access: Access) -> io::Result<Self> {
        let part = Self::begin_beside(target, access)?;
        if !is_temporary(folder_of(target)) {
            // what cannot be removed or completed now does not prevent this file
            let _ = sweep(folder_of(target), part.out.file());
        }
        Ok(part)
    }

    /// Begins the file of this name.
    ///
    /// # Errors
    /// Those of the system.
    pub(crate) fn begin_beside(target: &Path, access: Access) -> io::Result<Self> {
        let (out, temporary, noted) = hold(folder_of(target), PART, access)?;
        // a temporary folder is removed with its contents
        let leftover = (!is_temporary(folder_of(target))).then_some(noted);
        Ok(Self { out, target: target.to_owned(), temporary: Some(temporary), _leftover: leftover })
    }

    /// The open file.
    #[must_use]
    pub const fn file(&self) -> &std::fs::File {
        self.out.file()
    }

    /// Renames the file, when its content is on the disk. Returns its size in bytes.
    ///
    /// In a folder of [`Staging`](super::Staging), the commit flushes the file.
    ///
    /// # Errors
    /// Those of the system; an earlier file of this name is then unchanged.
    pub fn persist(self) -> io::Result<u64> {
        let folder = folder_of(&self.target).to_owned();
        if is_temporary(&folder) {
            return self.persist_unflushed();
        }
        self.out.flush_to_disk()?;
        let bytes = self.persist_unflushed()?;
        // the file is complete under either name
        let _ = flush_folder(&folder);
        Ok(bytes)
    }

    /// Renames the file, which may be incomplete after a failure of power.
    ///
    /// # Errors
    /// As [`Self::persist`].
    pub(crate) fn persist_unflushed(mut self) -> io::Result<u64> {
        let bytes = self.out.file().metadata()?.len();
        self.out.rename(&self.target)?;
        self.temporary = None;
        Ok(bytes)
    }
}

impl Write for Part {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.out.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

impl Seek for Part {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.out.seek(to)
    }
}

impl Drop for Part {
    /// Removes the temporary file. If that fails, the next process does it.
    fn drop(&mut self) {
        if let Some(temporary) = &self.temporary {
            let _ = remove_file(temporary);
        }
    }
}
