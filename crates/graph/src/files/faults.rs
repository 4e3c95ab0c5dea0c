//! Failures of a disk, planned by tests: each call below a folder is a step, and the plan says what happens at one.
//!
//! Without a plan, a call costs the reading of one number more. Under a plan, flushing is recorded only, so that tests
//! need not wait for the disk.

use std::{
    collections::BTreeMap,
    fs::File,
    io,
    path::{Path, PathBuf},
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
    time::Duration,
};

/// What happens at a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The disk is full: the call fails, and from then on those that need room.
    Full,
    /// The disk cannot be written to from then on.
    ReadOnly,
    /// The call is not permitted.
    Denied,
    /// Each call takes a while from then on.
    Slow,
    /// The process is killed: a write is done by half, and nothing happens from then on.
    Killed,
    /// The power fails: as [`Self::Killed`], and what was not flushed is lost.
    PowerLost,
}

impl Fault {
    /// Every fault.
    pub const ALL: [Self; 6] = [Self::Full, Self::ReadOnly, Self::Denied, Self::Slow, Self::Killed, Self::PowerLost];

    /// Returns true if the process does not survive it.
    #[must_use]
    pub const fn ends_the_process(self) -> bool {
        matches!(self, Self::Killed | Self::PowerLost)
    }
}

/// The kind of a call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Call {
    Create,
    Write,
    Flush,
    Rename,
    Remove,
}

/// A planned failure; it ends when this is dropped.
#[derive(Debug)]
#[must_use = "the plan ends when this is dropped"]
pub struct Plan(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    root: PathBuf,
    fault: Fault,
    at: usize,
    steps: AtomicUsize,
    /// The length of each file when it was last flushed.
    flushed: Mutex<BTreeMap<PathBuf, u64>>,
}

static PLANS: Mutex<Vec<Arc<Inner>>> = Mutex::new(Vec::new());

/// Number of plans.
static COUNT: AtomicUsize = AtomicUsize::new(0);

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Plan {
    /// Plans a fault for the step with this number, counted from 0, of the calls below a folder.
    pub fn new(root: &Path, fault: Fault, at: usize) -> Self {
        let inner = Inner { root: root.to_owned(), fault, at, steps: AtomicUsize::new(0), flushed: Mutex::default() };
        let inner = Arc::new(inner);
        lock(&PLANS).push(Arc::clone(&inner));
        COUNT.fetch_add(1, Ordering::Relaxed);
        Self(inner)
    }

    /// Number of steps so far.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.0.steps.load(Ordering::Relaxed)
    }

    /// Returns true if the step of the fault has been reached.
    #[must_use]
    pub fn has_struck(&self) -> bool {
        self.steps() > self.0.at
    }
}

impl Drop for Plan {
    fn drop(&mut self) {
        lock(&PLANS).retain(|plan| !Arc::ptr_eq(plan, &self.0));
        COUNT.fetch_sub(1, Ordering::Relaxed);
    }
}

/// A call that failed as planned.
#[derive(Debug)]
pub(super) struct Refused {
    error: io::Error,
    /// True if a part of the call may have been done.
    pub(super) is_first: bool,
}

impl From<Refused> for io::Error {
    fn from(refused: Refused) -> Self {
        refused.error
    }
}

/// Returns true if there is a plan for any folder.
pub(super) fn are_planned() -> bool {
    COUNT.load(Ordering::Relaxed) > 0
}

/// Counts a call; fails if that is the plan. Returns true if there is a plan for the path.
pub(super) fn step(path: &Path, call: Call) -> Result<bool, Refused> {
    if !are_planned() {
        return Ok(false);
    }
    planned(path).map_or(Ok(false), |plan| plan.step(path, call).map(|()| true))
}

/// Notes a new name.
pub(super) fn renamed(from: &Path, to: &Path) {
    if let Some(plan) = are_planned().then(|| planned(to)).flatten() {
        let mut flushed = lock(&plan.flushed);
        let moved: Vec<PathBuf> = flushed.keys().filter(|file| file.starts_with(from)).cloned().collect();
        for file in moved {
            let bytes = flushed.remove(&file).unwrap_or_default();
            let inside = file.strip_prefix(from).unwrap_or(Path::new(""));
            flushed.insert(if inside.as_os_str().is_empty() { to.to_owned() } else { to.join(inside) }, bytes);
        }
    }
}

fn planned(path: &Path) -> Option<Arc<Inner>> {
    lock(&PLANS).iter().find(|plan| path.starts_with(&plan.root)).cloned()
}

impl Inner {
    fn step(&self, path: &Path, call: Call) -> Result<(), Refused> {
        let step = self.steps.fetch_add(1, Ordering::Relaxed);
        let is_first = step == self.at;
        let refused = |error: io::Error| Err(Refused { error, is_first });
        if step >= self.at {
            match self.fault {
                Fault::Full if is_first || matches!(call, Call::Create | Call::Write) => {
                    return refused(io::ErrorKind::StorageFull.into());
                }
                Fault::Denied if is_first => return refused(io::ErrorKind::PermissionDenied.into()),
                Fault::Full | Fault::Denied => {}
                Fault::ReadOnly => {
                    return Err(Refused { error: io::ErrorKind::ReadOnlyFilesystem.into(), is_first: false });
                }
                Fault::Slow => std::thread::sleep(Duration::from_micros(200)),
                Fault::Killed => return refused(io::Error::other("killed")),
                Fault::PowerLost => {
                    if is_first {
                        self.lose();
                    }
                    return Err(Refused { error: io::Error::other("the power failed"), is_first: false });
                }
            }
        }
        let mut flushed = lock(&self.flushed);
        match call {
            Call::Create if !path.exists() => drop(flushed.insert(path.to_owned(), 0)),
            Call::Flush => {
                if let Some(bytes) = flushed.get_mut(path) {
                    *bytes = std::fs::metadata(path).map_or(0, |file| file.len());
                }
            }
            Call::Remove => drop(flushed.remove(path)),
            Call::Create | Call::Write | Call::Rename => {}
        }
        Ok(())
    }

    /// Shortens files to what was flushed.
    fn lose(&self) {
        for (path, bytes) in lock(&self.flushed).iter() {
            if std::fs::metadata(path).is_ok_and(|file| file.is_file() && file.len() > *bytes) {
                let _ = File::options().write(true).open(path).and_then(|file| file.set_len(*bytes));
            }
        }
    }
}
