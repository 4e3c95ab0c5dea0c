//! Watches files: reports when they have been saved.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Component, Path, PathBuf},
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
    /// Places where files may change, each with the files that change there, as they were added: a file changes where
    /// it lies, and at each link on the way to it.
    files: BTreeMap<PathBuf, BTreeSet<PathBuf>>,
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

    /// Watches a file, through its folder, because many editors save by renaming a new file into place. If the folder does
    /// not exist, the file counts as changed when it appears. Also watches the links on the way to it, of files and of
    /// folders.
    ///
    /// # Errors
    /// When the system cannot watch the folder.
    pub fn add(&mut self, file: &Path) -> Result<(), Failure> {
        for at in ways(file) {
            // the file, or the first folder on the way to it that is missing
            let Some(at) = at.ancestors().find(|at| at.parent().is_some_and(Path::is_dir)) else { continue };
            let Some(folder) = at.parent() else { continue };
            if !self.folders.contains(folder) {
                self.watcher.watch(folder, RecursiveMode::NonRecursive).map_err(|error| refused(&error))?;
                self.folders.insert(folder.to_owned());
            }
            self.files.entry(at.to_owned()).or_default().insert(file.to_owned());
        }
        Ok(())
    }

    /// Waits this long for files to change; returns those that did, as they were added. If a link leads elsewhere now,
    /// its files are watched there.
    ///
    /// # Errors
    /// When the system reports a failure, or cannot watch a folder.
    pub fn poll(&mut self, wait: Duration) -> Result<BTreeSet<PathBuf>, Failure> {
        match self.events.recv_timeout(wait) {
            Ok(Ok(events)) => {
                // the system no longer watches a folder that is gone, even if there is another in its place
                let gone = events.iter().filter(|event| matches!(event.kind, EventKind::Remove(_)));
                let mut lost = BTreeSet::new();
                for folder in gone.flat_map(|event| &event.paths) {
                    if self.folders.remove(folder) {
                        let _ = self.watcher.unwatch(folder);
                        lost.extend(
                            self.files.iter().filter(|(at, _)| at.starts_with(folder)).flat_map(|(_, of)| of.clone()),
                        );
                    }
                }
                let places = events.iter().filter(|event| is_change(&event.kind)).flat_map(|event| &event.paths);
                let mut changed: BTreeSet<PathBuf> =
                    places.filter_map(|path| self.files.get(path)).flatten().cloned().collect();
                changed.union(&lost).cloned().collect::<Vec<_>>().iter().try_for_each(|file| self.add(file))?;
                changed.extend(lost.into_iter().filter(|file| file.exists()));
                Ok(changed)
            }
            Ok(Err(errors)) => errors.first().map_or_else(|| Ok(BTreeSet::new()), |error| Err(refused(error))),
            Err(RecvTimeoutError::Timeout) => Ok(BTreeSet::new()),
            Err(RecvTimeoutError::Disconnected) => Err(Failure::unable("the system stopped reporting changed files")),
        }
    }
}

impl std::fmt::Debug for Watch {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Watch").field("files", &self.files).finish_non_exhaustive()
    }
}

/// The links on the way to a file, and its place behind them, as the system reports them.
fn ways(file: &Path) -> Vec<PathBuf> {
    let parts = |path: &Path| path.components().rev().map(|part| part.as_os_str().to_owned()).collect::<Vec<_>>();
    let Ok(whole) = std::path::absolute(file) else { return Vec::new() };
    let (mut at, mut rest, mut links) = (PathBuf::new(), parts(&whole), Vec::new());
    while let Some(part) = rest.pop() {
        match Path::new(&part).components().next() {
            Some(Component::ParentDir) => {
                at.pop();
            }
            Some(Component::Normal(name)) => {
                let here = at.join(name);
                match here.read_link() {
                    Ok(target) if links.len() < MOST_LINKS => {
                        rest.extend(parts(&target));
                        links.push(here);
                    }
                    _ => at = here,
                }
            }
            Some(Component::CurDir) | None => {}
            Some(Component::RootDir | Component::Prefix(_)) => at.push(part),
        }
    }
    links.push(at);
    links
}

/// The path of a file as the system reports it. Returns None for a path without a folder.
#[cfg(feature = "editor")]
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

#[cfg(test)]
mod tests {
    use std::{fs, time::Instant};

    use super::*;

    /// The first files that are reported within ten seconds.
    #[expect(clippy::disallowed_methods, reason = "a limit for a test that fails")]
    fn next(watch: &mut Watch) -> BTreeSet<PathBuf> {
        let start = Instant::now();
        while start.elapsed() < Duration::from_secs(10) {
            let changed = watch.poll(Duration::from_millis(50)).expect("watching");
            if !changed.is_empty() {
                return changed;
            }
        }
        BTreeSet::new()
    }

    /// As when another branch is checked out and left again: the folder of a raster goes, and comes back.
    #[test]
    fn a_folder_that_comes_back_is_watched_again() {
        let root = tempfile::tempdir().expect("a folder");
        let root = root.path().canonicalize().expect("there");
        let (folder, file) = (root.join("data"), root.join("data/dem.tif"));
        let mut watch = Watch::new(|| {}).expect("a watch");
        // before it exists
        watch.add(&file).expect("added");
        let expected = BTreeSet::from([file.clone()]);
        for round in 0..2 {
            fs::create_dir(&folder).expect("made");
            assert_eq!(next(&mut watch), expected, "the folder appears, round {round}");
            fs::write(&file, "1").expect("written");
            assert_eq!(next(&mut watch), expected, "the file appears, round {round}");
            fs::write(&file, "2").expect("written");
            assert_eq!(next(&mut watch), expected, "the file changes, round {round}");
            fs::remove_dir_all(&folder).expect("removed");
            while !watch.poll(Duration::from_millis(400)).expect("watching").is_empty() {}
            watch.add(&file).expect("as after a build");
        }
    }
}
