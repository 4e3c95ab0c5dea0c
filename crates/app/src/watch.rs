//! Files that are watched: told of when they have been saved.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
    sync::mpsc::{Receiver, RecvTimeoutError, channel},
    time::Duration,
};

use notify_debouncer_full::{
    DebounceEventResult, Debouncer, RecommendedCache, new_debouncer,
    notify::{
        self, EventKind, RecommendedWatcher, RecursiveMode,
        event::{AccessKind, AccessMode},
    },
};

use crate::failure::Failure;

/// How long a file must be left alone before it counts as saved.
const SETTLED: Duration = Duration::from_millis(150);

/// Folders that are watched, and the files in them that matter.
pub struct Watch {
    watcher: Debouncer<RecommendedWatcher, RecommendedCache>,
    events: Receiver<DebounceEventResult>,
    folders: BTreeSet<PathBuf>,
    files: BTreeSet<PathBuf>,
}

impl Watch {
    /// Watches nothing yet. `wake` is called when there may be something to [`Self::poll`] for.
    ///
    /// # Errors
    /// When the system cannot watch files.
    pub fn new(wake: impl Fn() + Send + 'static) -> Result<Self, Failure> {
        let (tell, events) = channel();
        let handler = move |event: DebounceEventResult| {
            // Nobody listens any more when the watch has ended.
            let _ = tell.send(event);
            wake();
        };
        let watcher = new_debouncer(SETTLED, None, handler).map_err(|error| refused(&error))?;
        Ok(Self { watcher, events, folders: BTreeSet::new(), files: BTreeSet::new() })
    }

    /// Watches a file. Its folder is what the system watches, since many editors save by renaming a new file into place;
    /// a folder that does not exist is left out.
    ///
    /// # Errors
    /// When the system cannot watch the folder.
    pub fn add(&mut self, file: &Path) -> Result<(), Failure> {
        let Some(place) = place(file) else { return Ok(()) };
        let folder = place.parent().unwrap_or(Path::new("/")).to_owned();
        self.files.insert(place);
        if self.folders.insert(folder.clone()) {
            self.watcher.watch(&folder, RecursiveMode::NonRecursive).map_err(|error| refused(&error))?;
        }
        Ok(())
    }

    /// Waits so long for files to change; gives the first one that did, where it is.
    ///
    /// # Errors
    /// When the system tells of a fault.
    pub fn poll(&self, wait: Duration) -> Result<Option<PathBuf>, Failure> {
        match self.events.recv_timeout(wait) {
            Ok(Ok(events)) => {
                let changed = events.iter().filter(|event| is_change(&event.kind)).flat_map(|event| &event.paths);
                Ok(changed.into_iter().find(|path| self.files.contains(*path)).cloned())
            }
            Ok(Err(errors)) => errors.first().map_or(Ok(None), |error| Err(refused(error))),
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => Err(Failure::unable("the system stopped telling of changed files")),
        }
    }
}

impl std::fmt::Debug for Watch {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Watch").field("files", &self.files).finish_non_exhaustive()
    }
}

/// Where a file is, by the name that the system tells of it; `None` without a folder.
#[must_use]
pub fn place(file: &Path) -> Option<PathBuf> {
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    Some(folder.canonicalize().ok()?.join(file.file_name()?))
}

/// Whether a file may say something else after the event. Reading one is an event too.
const fn is_change(kind: &EventKind) -> bool {
    match kind {
        EventKind::Create(_) | EventKind::Modify(_) | EventKind::Any => true,
        EventKind::Access(kind) => matches!(kind, AccessKind::Close(AccessMode::Write)),
        EventKind::Remove(_) | EventKind::Other => false,
    }
}

fn refused(error: &notify::Error) -> Failure {
    Failure::unable(format!("cannot watch files: {error}"))
}
