//! Where the files of an archive lie while it is worked on as a copy in no file.
//!
//! Each archive has a folder of its own in that of [`state`], which is locked while a window works on it. It goes when the
//! work is saved, which takes the files along, or given up. Where a journal has been begun it outlives a crash, so that the
//! work that is taken up finds its files; what a crash leaves without a journal goes when the next archive is opened.

use std::{
    fs::{self, File},
    io,
    path::{Path, PathBuf},
};

use orograph_graph::{Document, Registry};

use crate::{
    archive::unpack_into,
    editor::state,
    failure::{Failure, reason},
};

/// What is locked while a window works on the files.
const LOCK: &str = "lock";
/// What says that a journal needs the files.
const NEEDED: &str = "needed";
/// The folder of the files.
const FILES: &str = "files";

/// The files of an archive; they are removed with it.
#[derive(Debug)]
pub(super) struct Unpacked {
    root: PathBuf,
    /// Locked.
    lock: Option<File>,
}

impl Unpacked {
    /// Unpacks an archive; gives a copy of its graph that is in no file.
    ///
    /// # Errors
    /// When the archive cannot be trusted, or there is no room for it.
    pub(super) fn new(archive: &Path, registry: &Registry) -> Result<(Self, Document), Failure> {
        let unable = |error: io::Error| {
            Failure::unable(format!("cannot make a folder to unpack `{}`: {}", archive.display(), reason(&error)))
        };
        let archives = archives();
        fs::create_dir_all(&archives).map_err(unable)?;
        sweep(&archives);
        let root = tempfile::tempdir_in(&archives).map_err(unable)?.keep();
        let mut new = Self { root, lock: None };
        let lock = File::create_new(new.root.join(LOCK)).map_err(unable)?;
        // Where locks are unknown, nothing is swept.
        let _ = lock.try_lock();
        new.lock = Some(lock);
        let folder = new.root.join(FILES);
        fs::create_dir(&folder).map_err(unable)?;
        let graph = folder.join(unpack_into(archive, &folder)?.graph);
        let text = Document::load(&graph, registry).map_err(|error| Failure::wrong(error.to_string()))?;
        let inside = graph.parent().unwrap_or(&folder);
        let document = Document::parse_in(text.source(), inside, registry);
        Ok((new, document))
    }

    /// The files that work of an earlier time was left with, if it was a copy out of an archive, and nobody else has them.
    pub(super) fn left(folder: &Path) -> Option<Self> {
        let archives = archives();
        let root = archives.join(folder.strip_prefix(&archives).ok()?.components().next()?);
        Self::free(root)
    }

    fn free(root: PathBuf) -> Option<Self> {
        let lock = File::open(root.join(LOCK)).ok()?;
        lock.try_lock().ok()?;
        Some(Self { root, lock: Some(lock) })
    }

    /// Notes that a journal needs the files from now on.
    pub(super) fn need(&self) {
        // Without it, the files may be gone after a crash, which the work then tells.
        let _ = File::create(self.root.join(NEEDED));
    }

    /// Leaves the files for another time.
    pub(super) fn leave(mut self) {
        self.root = PathBuf::new();
    }
}

impl Drop for Unpacked {
    fn drop(&mut self) {
        if self.root.as_os_str().is_empty() {
            return;
        }
        // What cannot be removed is swept another time.
        let _ = fs::remove_file(self.root.join(NEEDED));
        self.lock = None;
        let _ = fs::remove_dir_all(&self.root);
    }
}

fn archives() -> PathBuf {
    state::folder().unwrap_or_else(|| std::env::temp_dir().join("orograph")).join("archives")
}

/// Removes what nobody works on and no journal needs.
fn sweep(archives: &Path) {
    for entry in fs::read_dir(archives).into_iter().flatten().flatten() {
        let root = entry.path();
        if !root.join(NEEDED).exists() {
            drop(Unpacked::free(root));
        }
    }
}

/// Copies the files that a copy reads from the editor's own folder to the folder in which it is to be saved, where they have
/// the same names; in a folder of their own where other files have those. Gives the folder from which their names lead to
/// them, if there are any.
///
/// # Errors
/// When a file cannot be copied.
pub(super) fn take_along(document: &Document, to: &Path) -> io::Result<Option<Taken>> {
    let own = state::folder().is_some_and(|state| document.folder().starts_with(state));
    if document.path().is_some() || !own {
        return Ok(None);
    }
    let from = document.folder().canonicalize()?;
    let files = document.files();
    // What is missing, or was named by the person, stays where it is.
    let files = files.iter().filter_map(|file| file.canonicalize().ok());
    let names: Vec<PathBuf> = files.filter_map(|file| Some(file.strip_prefix(&from).ok()?.to_owned())).collect();
    if names.is_empty() {
        return Ok(None);
    }
    let beside = to.parent().unwrap_or(Path::new("")).to_owned();
    let stem = to.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let numbered = (2..).map(|number| format!("{stem}_files_{number}"));
    let others = [format!("{stem}_files")].into_iter().chain(numbered).map(|name| beside.join(name));
    let mut taken = Taken { folder: beside.clone(), new: Vec::new() };
    for folder in [beside.clone()].into_iter().chain(others) {
        let free = |name: &PathBuf| {
            let there = folder.join(name);
            !there.exists()
                || fs::read(&there).is_ok_and(|bytes| fs::read(from.join(name)).is_ok_and(|own| own == bytes))
        };
        if names.iter().all(free) {
            taken.folder = folder;
            break;
        }
    }
    for name in names {
        let there = taken.folder.join(&name);
        if there.exists() {
            continue;
        }
        if let Some(parent) = there.parent().filter(|parent| !parent.as_os_str().is_empty()) {
            fs::create_dir_all(parent)?;
        }
        taken.new.push(there.clone());
        if let Err(error) = fs::copy(from.join(&name), &there) {
            taken.give_back();
            return Err(error);
        }
    }
    Ok(Some(taken))
}

/// Files that were taken along.
#[derive(Debug)]
pub(super) struct Taken {
    /// Where they are.
    pub(super) folder: PathBuf,
    /// Those that were not there before.
    pub(super) new: Vec<PathBuf>,
}

impl Taken {
    /// Removes them again.
    pub(super) fn give_back(&self) {
        for file in &self.new {
            let _ = fs::remove_file(file);
        }
    }
}
