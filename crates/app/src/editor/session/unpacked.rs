//! The files of an archive while you edit a copy of it.
//!
//! Each archive has its own folder in that of [`state`], which is locked while a window uses it. The folder is deleted
//! when the work is saved, which copies the files, or discarded. Once a journal has been started the folder survives a
//! crash, so that recovered work finds its files; folders that a crash leaves without a journal are deleted when the
//! next archive is opened.

use std::{
    fs::{self, File},
    io,
    path::{Path, PathBuf},
};

use orograph_graph::{Document, Registry, input};

use crate::{
    editor::window::state,
    files::archive::unpack_into,
    files::read_by,
    report::failure::{Failure, reason},
};

/// Locked while a window uses the files.
const LOCK: &str = "lock";
/// Marks that a journal needs the files.
const NEEDED: &str = "needed";
/// The folder of the files.
const FILES: &str = "files";

/// The files of an archive; dropping this deletes them.
#[derive(Debug)]
pub(super) struct Unpacked {
    root: PathBuf,
    /// The lock on the folder.
    lock: Option<File>,
}

impl Unpacked {
    /// Unpacks an archive and returns a copy of its graph, which has no file.
    ///
    /// # Errors
    /// When the archive is unsafe, or there is no space for it.
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
        // Without file locks, nothing is deleted.
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

    /// The files of unsaved work. Returns None when it was not a copy of an archive, or another window has the files.
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

    /// Marks that a journal needs the files.
    pub(super) fn need(&self) {
        // Without the mark the files may be gone after a crash; the recovered work then reports them as missing.
        let _ = File::create(self.root.join(NEEDED));
    }

    /// Leaves the files for a later start.
    pub(super) fn leave(mut self) {
        self.root = PathBuf::new();
    }
}

impl Drop for Unpacked {
    fn drop(&mut self) {
        if self.root.as_os_str().is_empty() {
            return;
        }
        // Files that cannot be removed now are deleted another time.
        let _ = fs::remove_file(self.root.join(NEEDED));
        self.lock = None;
        let _ = fs::remove_dir_all(&self.root);
    }
}

fn archives() -> PathBuf {
    state::folder().unwrap_or_else(|| std::env::temp_dir().join("orograph")).join("archives")
}

/// Deletes folders that no window uses and no journal needs.
fn sweep(archives: &Path) {
    for entry in fs::read_dir(archives).into_iter().flatten().flatten() {
        let root = entry.path();
        if !root.join(NEEDED).exists() {
            drop(Unpacked::free(root));
        }
    }
}

/// Copies the files that a copy reads from the editor's own folder to the folder in which it will be saved, under the
/// same names; into a subfolder if other files have those names. Returns the folder that their names are relative to.
/// Returns None when there are no such files.
///
/// # Errors
/// When a file cannot be copied.
pub(super) fn take_along(document: &Document, to: &Path) -> io::Result<Option<Taken>> {
    let own = state::folder().is_some_and(|state| document.folder().starts_with(state));
    if document.path().is_some() || !own {
        return Ok(None);
    }
    let from = document.folder().canonicalize()?;
    let files = read_by(document);
    // Missing files, and files that you chose yourself, stay where they are.
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
            !there.exists() || input::has_same_contents(&there, &from.join(name)).is_ok_and(|same| same)
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

/// Files that were copied to the new place.
#[derive(Debug)]
pub(super) struct Taken {
    /// Their folder.
    pub(super) folder: PathBuf,
    /// The files that did not exist before.
    pub(super) new: Vec<PathBuf>,
}

impl Taken {
    /// Deletes the copies.
    pub(super) fn give_back(&self) {
        for file in &self.new {
            let _ = fs::remove_file(file);
        }
    }
}
