//! The exchange of new files for earlier ones, which another process can complete or undo at any point.
//!
//! A temporary folder has the new files in `new`, room for the earlier ones in `old`, and a plan. While the plan is
//! named `commit.json`, the exchange goes on, and is completed by whoever finds it; named `undo.json`, it goes back.
//! Each step is a rename and shows by itself whether it has been done, so that nothing else has to be recorded.

use std::{
    fs, io,
    path::{Component, Path, PathBuf},
};

use serde::{Deserialize, Serialize};

use super::calls::{flush_folder, remove_file, rename};

/// The folder of the new files.
pub(super) const NEW: &str = "new";
/// The folder of the earlier files.
pub(super) const OLD: &str = "old";
/// The plan of an exchange that is to be completed.
pub(super) const PLAN: &str = "commit.json";
/// The plan of an exchange that is to be undone.
const UNDO: &str = "undo.json";

/// Maximum size of a plan in bytes.
const MAX_BYTES: u64 = 64 << 20;

/// A change of a commit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Change {
    /// The name of the file.
    pub name: String,
    /// True if there is a new file; otherwise the earlier one is only removed.
    pub is_new: bool,
}

/// Why a commit failed.
#[derive(Debug)]
pub struct CommitError {
    /// The file that could not be exchanged.
    pub name: String,
    /// The error of the system.
    pub error: io::Error,
    /// The folder of the earlier files, if they could not be put back; the next process that writes to the folder
    /// around it does that.
    pub left: Option<PathBuf>,
}

/// A file of the plan.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Entry {
    pub(super) name: String,
    /// True if there is a new file.
    pub(super) new: bool,
    /// True if there is an earlier file.
    old: bool,
}

impl Entry {
    /// Looks for the earlier file.
    pub(super) fn of(folder: &Path, name: &str, new: bool) -> io::Result<Self> {
        let old = fs::symlink_metadata(folder.join(name));
        if old.as_ref().is_ok_and(fs::Metadata::is_dir) {
            return Err(io::ErrorKind::IsADirectory.into());
        }
        Ok(Self { name: name.to_owned(), new, old: old.is_ok() })
    }

    /// Returns true if the name stays in the folder, and is not a hidden one.
    fn is_sound(&self) -> bool {
        let mut parts = Path::new(&self.name).components();
        matches!((parts.next(), parts.next()), (Some(Component::Normal(_)), None)) && !self.name.starts_with('.')
    }
}

/// The files of an exchange, with their places.
#[derive(Debug)]
pub(super) struct Exchange<'a> {
    /// The folder in which the files appear.
    pub(super) folder: &'a Path,
    /// The temporary folder.
    pub(super) staging: &'a Path,
    pub(super) entries: &'a [Entry],
}

/// How an exchange ended.
#[derive(Debug)]
pub(super) enum Ended {
    /// The new files are in place.
    Done {
        /// True if the plan is gone.
        is_over: bool,
    },
    /// The earlier files are in place, because this one could not be exchanged.
    Undone { name: String, error: io::Error, is_over: bool },
    /// Neither could be done.
    Stuck { name: String, error: io::Error },
}

impl Ended {
    /// Returns true if the temporary folder can be removed.
    pub(super) const fn is_over(&self) -> bool {
        matches!(self, Self::Done { is_over: true } | Self::Undone { is_over: true, .. })
    }
}

/// Completes or undoes an exchange that a dead process has begun in a folder. Returns None if there is none.
///
/// # Errors
/// When its plan cannot be read.
pub(super) fn resume(folder: &Path, staging: &Path) -> io::Result<Option<Ended>> {
    let Some(plan) = [PLAN, UNDO].into_iter().find(|plan| exists(&staging.join(plan))) else { return Ok(None) };
    let damaged = |what: &str| io::Error::other(format!("`{}` {what}", staging.join(plan).display()));
    // somebody else may have made the folder
    let is_folder = |path: &Path| fs::symlink_metadata(path).is_ok_and(|entry| entry.is_dir());
    let is_short = fs::symlink_metadata(staging.join(plan)).is_ok_and(|file| file.is_file() && file.len() <= MAX_BYTES);
    if !is_short || !is_folder(&staging.join(NEW)) || !is_folder(&staging.join(OLD)) {
        return Err(damaged("is not the plan of an exchange"));
    }
    let entries: Vec<Entry> = serde_json::from_slice(&fs::read(staging.join(plan))?)?;
    if let Some(entry) = entries.iter().find(|entry| !entry.is_sound()) {
        return Err(damaged(&format!("names `{}`, which is not in the folder", entry.name.escape_debug())));
    }
    let _turn = turn(folder);
    let exchange = Exchange { folder, staging, entries: &entries };
    let missing = entries
        .iter()
        .find(|entry| entry.new && !exists(&staging.join(NEW).join(&entry.name)) && !exists(&folder.join(&entry.name)));
    let is_missing = || io::Error::from(io::ErrorKind::NotFound);
    Ok(Some(match missing {
        Some(entry) => exchange.undo(entry.name.clone(), is_missing()),
        None if plan == UNDO => exchange.undo(String::new(), io::Error::other("it was being undone")),
        None => exchange.complete(),
    }))
}

impl Exchange<'_> {
    /// Puts the new files in place, or undoes everything if one of them cannot be.
    pub(super) fn complete(&self) -> Ended {
        match self.exchange(NEW, OLD) {
            Ok(()) => Ended::Done { is_over: self.forget(PLAN) },
            Err((name, error)) => self.undo(name, error),
        }
    }

    /// Puts the earlier files back, because of this error.
    pub(super) fn undo(&self, name: String, error: io::Error) -> Ended {
        let [plan, undo] = [PLAN, UNDO].map(|name| self.staging.join(name));
        let decided = if exists(&plan) { rename(&plan, &undo) } else { Ok(()) };
        match decided.and_then(|()| flush_folder(self.staging)).map_err(|_| ()) {
            Ok(()) if self.exchange(OLD, NEW).is_ok() => Ended::Undone { name, error, is_over: self.forget(UNDO) },
            _ => Ended::Stuck { name, error },
        }
    }

    /// Takes away the files of `taken` and puts those of `given` in place, as far as that has not been done.
    fn exchange(&self, given: &str, taken: &str) -> Result<(), (String, io::Error)> {
        let has = |entry: &Entry, side: &str| if side == NEW { entry.new } else { entry.old };
        let flush = |name: &str| flush_folder(self.folder).map_err(|error| (name.to_owned(), error));
        let last = self.entries.last().map_or("", |entry| &entry.name);
        for entry in self.entries.iter().rev().filter(|entry| has(entry, taken)) {
            let [there, to, from] = self.places(entry, taken, given);
            // what is there belongs to the taken side until the given file has left its folder
            let is_taken = !exists(&to) && exists(&there) && (!has(entry, given) || exists(&from));
            if is_taken {
                rename(&there, &to).map_err(|error| (entry.name.clone(), error))?;
            }
        }
        flush(last)?;
        for entry in self.entries.iter().filter(|entry| has(entry, given)) {
            let [there, _, from] = self.places(entry, taken, given);
            if exists(&from) {
                rename(&from, &there).map_err(|error| (entry.name.clone(), error))?;
            }
        }
        flush(last)
    }

    /// The final place of a file, and its places among those of both sides.
    fn places(&self, entry: &Entry, taken: &str, given: &str) -> [PathBuf; 3] {
        let inside = |side: &str| self.staging.join(side).join(&entry.name);
        [self.folder.join(&entry.name), inside(taken), inside(given)]
    }

    /// Removes the plan before anything else is removed. Returns true if it is gone.
    fn forget(&self, plan: &str) -> bool {
        match remove_file(&self.staging.join(plan)) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => false,
            _ => flush_folder(self.staging).is_ok(),
        }
    }
}

/// Waits until no other process exchanges files of the folder, where the system can lock folders.
pub(super) fn turn(folder: &Path) -> Option<fs::File> {
    let folder = fs::File::open(folder).ok()?;
    folder.lock().ok().map(|()| folder)
}

/// Returns true if there is anything of this name, also a link that leads nowhere.
fn exists(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok()
}
