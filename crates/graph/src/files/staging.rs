//! A temporary folder that this process holds, and the commit of its files.

use std::{
    io::{self, Write as _},
    path::{Path, PathBuf},
};

use super::{
    calls::{
        Access, Out, create_folder, create_private_folder, flush_all, flush_folder, folder_of, remove_all, remove_file,
        rename,
    },
    exchange::{Change, CommitError, Ended, Entry, Exchange, NEW, OLD, PLAN, turn},
    hold::{LOCK, ending, hold},
    sweep::sweep,
};
use crate::memory::Leftover;

/// A temporary folder, in the folder in which its files will appear. Dropping it removes it with everything in it.
#[derive(Debug)]
pub struct Staging {
    path: PathBuf,
    /// The file that is locked while this lives.
    lock: PathBuf,
    _held: Out,
    /// Removes the folder if the program ends for lack of memory.
    leftover: Option<Leftover>,
    /// True if a later process must complete the exchange.
    is_left: bool,
}

impl Staging {
    /// Creates the folder in another one, in which it first completes the exchanges of dead processes and removes what
    /// they left. `around` are folders that were created for this one, innermost first; they are removed if the program
    /// ends for lack of memory.
    ///
    /// # Errors
    /// Those of the system, also if an exchange can be neither completed nor undone.
    pub fn begin(parent: &Path, around: &[&Path]) -> io::Result<Self> {
        let (held, lock, _noted) = hold(parent, LOCK, Access::Private)?;
        let path = lock.with_extension("");
        let leftover = Some(Leftover::note(&[&path, &lock], around));
        let staging = Self { path, lock, _held: held, leftover, is_left: false };
        sweep(parent, staging._held.file())?;
        create_private_folder(&staging.path)?;
        create_folder(&staging.files())?;
        Ok(staging)
    }

    /// The folder for the new files.
    #[must_use]
    pub fn files(&self) -> PathBuf {
        self.path.join(NEW)
    }

    /// Replaces the files of the folder around this one by the new files of the same names: all of them, or none.
    ///
    /// Files of both kinds are never there together. The earlier ones are taken away, those of the last changes first;
    /// then the new ones are put in place, in the order of the changes. A process that is killed meanwhile leaves a
    /// plan, and the next one that writes to the folder completes it.
    ///
    /// # Errors
    /// When a file cannot be renamed or flushed; the earlier files are then back in place, or the error says where they
    /// are.
    pub fn commit(mut self, changes: &[Change]) -> Result<(), CommitError> {
        let parent = folder_of(&self.path).to_owned();
        let _turn = turn(&parent);
        let before = |name: &str, error: io::Error| CommitError { name: name.to_owned(), error, left: None };
        let mut entries = Vec::with_capacity(changes.len());
        for Change { name, is_new } in changes {
            entries.push(Entry::of(&parent, name, *is_new).map_err(|error| before(name, error))?);
        }
        let named = changes.first().map_or("", |change| &change.name);
        self.prepare(&parent, &entries).map_err(|error| before(named, error))?;
        // From here on the folder can hold the only copy of earlier files.
        self.leftover = None;
        self.is_left = true;
        let exchange = Exchange { folder: &parent, staging: &self.path, entries: &entries };
        let ended = rename(&self.path.join(PART_OF_PLAN), &self.path.join(PLAN))
            .and_then(|()| flush_folder(&self.path))
            .map_or_else(|error| exchange.undo(named.to_owned(), error), |()| exchange.complete());
        self.is_left = !ended.is_over();
        match ended {
            Ended::Done { .. } => Ok(()),
            Ended::Undone { name, error, .. } => Err(CommitError { name, error, left: None }),
            Ended::Stuck { name, error } => Err(CommitError { name, error, left: Some(self.path.join(OLD)) }),
        }
    }

    /// Writes the plan of the exchange under another name, and waits until it and all new files are on the disk.
    fn prepare(&self, parent: &Path, entries: &[Entry]) -> io::Result<()> {
        create_folder(&self.path.join(OLD))?;
        let mut plan = Out::create(&self.path.join(PART_OF_PLAN), Access::Private)?;
        plan.write_all(&serde_json::to_vec(entries)?)?;
        flush_all(&self.path)?;
        flush_folder(parent)
    }
}

/// Completes the exchanges that dead processes have begun in a folder that is about to be read, and removes what they
/// left. Without permission to write there, the folder stays as it is.
pub fn settle(folder: &Path) {
    let mut names = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.file_name());
    if names.any(|name| name.to_str().and_then(ending).is_some()) {
        drop(Staging::begin(folder, &[]));
    }
}

/// The plan before it is decided.
const PART_OF_PLAN: &str = "plan.part";

impl Drop for Staging {
    /// Removes the folder. If that fails, the next process does it.
    fn drop(&mut self) {
        if !self.is_left && (remove_all(&self.path).is_ok() || !self.path.exists()) {
            let _ = remove_file(&self.lock);
        }
    }
}
