//! Commands whose files fail at each step: a full, read-only, slow or refusing disk, a killed process, a failure of
//! power.
//!
//! A test runs a command once for each step that it takes, with a fault at that step. Then it looks at the folder as
//! another program would, and again after the next process has worked there. The journal of the editor is tested beside
//! its code.

mod archives;
mod cubes;
mod documents;
mod outputs;
mod results;

use std::{collections::BTreeMap, fmt, fs, path::Path};

use orograph::Failure;
use orograph_graph::files::faults::{Fault, Plan};
use tempfile::TempDir;

/// How a command ended.
type Ended = Result<(), Failure>;

/// A fault, and the step at which it happened.
#[derive(Clone, Copy, Debug)]
struct At {
    fault: Fault,
    step: usize,
}

impl fmt::Display for At {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?} at step {}", self.fault, self.step)
    }
}

/// Runs a command in a new folder once for each step, with this fault at that step, and passes the folder and how the
/// command ended to `check`.
fn at_each_step(
    fault: Fault,
    prepare: &dyn Fn(&Path),
    run: &dyn Fn(&Path) -> Ended,
    check: &dyn Fn(&Path, At, &Ended),
) {
    for step in 0.. {
        let place = place();
        prepare(place.path());
        let plan = Plan::new(place.path(), fault, step);
        let ended = run(place.path());
        let has_struck = plan.has_struck();
        drop(plan);
        let at = At { fault, step };
        if let Err(failure) = &ended {
            tells_the_remedy(failure, at);
        }
        check(place.path(), at, &ended);
        if !has_struck || fault == Fault::Slow {
            assert_eq!(ended, Ok(()), "{at}");
            return;
        }
    }
}

/// A folder in memory where the system has such a place, because a disk is slow with many small files.
fn place() -> TempDir {
    tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir()).expect("a folder")
}

#[track_caller]
fn tells_the_remedy(failure: &Failure, at: At) {
    let remedy = match at.fault {
        Fault::Full => "free some space",
        Fault::ReadOnly => "make the disk writable",
        Fault::Denied => "allow writing to the folder",
        Fault::Slow | Fault::Killed | Fault::PowerLost => return,
    };
    assert!(failure.hint.as_ref().is_some_and(|hint| hint.contains(remedy)), "{at}: {failure:?}");
}

/// Names and contents of the files of a folder and those below it, without hidden ones. Empty if there is no folder.
fn view(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    for entry in fs::read_dir(folder).into_iter().flatten() {
        let path = entry.expect("an entry").path();
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        if name.starts_with('.') {
            continue;
        }
        if path.is_dir() {
            files.extend(view(&path).into_iter().map(|(inner, bytes)| (format!("{name}/{inner}"), bytes)));
        } else {
            files.insert(name, fs::read(&path).expect("readable"));
        }
    }
    files
}

/// The hidden names in a folder.
fn hidden(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().map(|entry| entry.expect("an entry").file_name());
    entries.map(|name| name.to_string_lossy().into_owned()).filter(|name| name.starts_with('.')).collect()
}

/// Writes files into a folder.
fn fill(folder: &Path, files: &BTreeMap<String, Vec<u8>>) {
    for (name, bytes) in files {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("made");
        fs::write(path, bytes).expect("written");
    }
}
