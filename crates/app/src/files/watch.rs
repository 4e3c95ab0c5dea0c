//! Watches files: reports when they have been saved.

use std::{
    collections::{BTreeMap, BTreeSet},
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

use crate::report::failure::Failure;

/// How long a file must be unchanged before it counts as saved.
const SETTLED: Duration = Duration::from_millis(150);

/// The watched folders, and the files in them that matter.
pub struct Watch {
    watcher: Debouncer<RecommendedWatcher, RecommendedCache>,
    events: Receiver<DebounceEventResult>,
    folders: BTreeSet<PathBuf>,
    /// Places where the files may change, with the places of the files: a link changes also where it leads.
    files: BTreeMap<PathBuf, PathBuf>,
}

/// Links are followed so far; systems follow about as many.
const MOST_LINKS: usize = 40;

impl Watch {
    /// Watches nothing yet. Calls `wake` when [`Self::poll`] may have something.
    ///
    /// # Errors
    /// When the system cannot watch files.
    pub fn new(wake: impl Fn() + Send + 'static) -> Result<Self, Failure> {
        let (tell, events) = channel();
        let handler = move |event: DebounceEventResult| {
            // Ignored: the receiver is gone once the watch has ended.
            let _ = tell.send(event);
            wake();
        };
        let watcher = new_debouncer(SETTLED, None, handler).map_err(|error| refused(&error))?;
        Ok(Self { watcher, events, folders: BTreeSet::new(), files: BTreeMap::new() })
    }

    /// Watches a file, through its folder, because many editors save by renaming a new file into place; a folder that
    /// does not exist is skipped. Also watches what a link leads to.
    ///
    /// # Errors
    /// When the system cannot watch the folder.
    pub fn add(&mut self, file: &Path) -> Result<(), Failure> {
        let Some(named) = place(file) else { return Ok(()) };
        let mut next = Some(named.clone());
        for _ in 0..MOST_LINKS {
            let Some(at) = next else { break };
            let folder = at.parent().unwrap_or(Path::new("/")).to_owned();
            if self.folders.insert(folder.clone()) {
                self.watcher.watch(&folder, RecursiveMode::NonRecursive).map_err(|error| refused(&error))?;
            }
            next = at.read_link().ok().and_then(|target| place(&folder.join(target)));
            // A file that is watched by its own name keeps it.
            if at == named {
                self.files.insert(at, named.clone());
            } else {
                self.files.entry(at).or_insert_with(|| named.clone());
            }
        }
        Ok(())
    }

    /// Waits this long for files to change; returns the path of the first one that did, as [`place`] gives it.
    ///
    /// # Errors
    /// When the system reports a failure.
    pub fn poll(&self, wait: Duration) -> Result<Option<PathBuf>, Failure> {
        match self.events.recv_timeout(wait) {
            Ok(Ok(events)) => {
                let changed = events.iter().filter(|event| is_change(&event.kind)).flat_map(|event| &event.paths);
                Ok(changed.into_iter().find_map(|path| self.files.get(path)).cloned())
            }
            Ok(Err(errors)) => errors.first().map_or(Ok(None), |error| Err(refused(error))),
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => Err(Failure::unable("the system stopped reporting changed files")),
        }
    }
}

impl std::fmt::Debug for Watch {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Watch").field("files", &self.files).finish_non_exhaustive()
    }
}

/// The path of a file as the system reports it. Returns None for a path without a folder.
#[must_use]
pub fn place(file: &Path) -> Option<PathBuf> {
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    Some(folder.canonicalize().ok()?.join(file.file_name()?))
}

/// Returns true if the content of a file may have changed. Reading one is an event too.
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
