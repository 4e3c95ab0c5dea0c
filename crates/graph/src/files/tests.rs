//! Tests of files that appear together, with a failure at each step.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs::{self, File},
    io::{self, Write as _},
    path::Path,
};

use tempfile::TempDir;

use super::{
    faults::{Fault, Plan},
    *,
};

/// The files of one build: side files first, as outputs are committed.
const NAMES: [&str; 5] = ["a.png.json", "b.r16.json", "a.png", "b.r16", "rivers.geojson"];

/// A side file that the first build has and the second has not.
const FORMER: &str = "rivers.geojson.json";

/// A folder for many small files, in memory where the system has such a place.
fn place() -> TempDir {
    tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir()).expect("a folder")
}

fn put(path: &Path, text: &str) -> io::Result<()> {
    let mut part = Part::begin(path, Access::Usual)?;
    part.write_all(text.as_bytes())?;
    part.persist().map(drop)
}

/// Writes the files of a build into a folder.
fn build(folder: &Path, version: &str) -> Result<(), CommitError> {
    let failed = |error: io::Error| CommitError { name: String::new(), error, left: None };
    let staging = Staging::begin(folder, &[]).map_err(failed)?;
    let is_first = version == "1";
    let names = NAMES.iter().chain(is_first.then_some(&FORMER)).copied();
    for name in names {
        put(&staging.files().join(name), &format!("{version} {name}")).map_err(failed)?;
    }
    let change = |name: &str, is_new| Change { name: name.to_owned(), is_new };
    let former = change(FORMER, is_first);
    staging.commit(&[vec![former], NAMES.map(|name| change(name, true)).to_vec()].concat())
}

/// The visible files with the build that each is from.
fn view(folder: &Path) -> BTreeMap<String, String> {
    let entries = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry"));
    let shown = entries.filter(|entry| !entry.file_name().to_string_lossy().starts_with('.'));
    shown
        .map(|entry| {
            let name = entry.file_name().to_string_lossy().into_owned();
            let text = fs::read_to_string(entry.path()).expect("text");
            let version = text.strip_suffix(&format!(" {name}")).expect("a whole file").to_owned();
            (name, version)
        })
        .collect()
}

/// The visible files if exactly this build is there; nothing for the build before the first.
fn whole(version: &str) -> BTreeMap<String, String> {
    let names: &[&str] = if version == "0" { &[] } else { &NAMES };
    let former = (version == "1").then_some(&FORMER);
    names.iter().chain(former).map(|name| ((*name).to_owned(), version.to_owned())).collect()
}

/// Nothing that a reader could take for one build is of two, and no raster lacks its side file.
#[track_caller]
fn is_of_one_build(folder: &Path, what: &str) {
    let view = view(folder);
    let versions: BTreeSet<&String> = view.values().collect();
    assert!(versions.len() <= 1, "{what}: {view:?}");
    for raster in ["a.png", "b.r16"] {
        assert!(!view.contains_key(raster) || view.contains_key(&format!("{raster}.json")), "{what}: {view:?}");
    }
}

fn hidden(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").file_name());
    entries.map(|name| name.to_string_lossy().into_owned()).filter(|name| name.starts_with('.')).collect()
}

#[test]
fn a_failure_at_any_step_leaves_one_whole_build() {
    let mut counts = BTreeMap::new();
    for fault in Fault::ALL {
        for before in ["0", "1"].into_iter().filter(|before| *before == "1" || fault == Fault::Killed) {
            let after = if before == "0" { "1" } else { "2" };
            for at in 0.. {
                let place = place();
                let folder = place.path();
                let quiet = Plan::new(folder, Fault::Slow, usize::MAX);
                if before == "1" {
                    build(folder, "1").expect("built");
                }
                drop(quiet);
                let what = format!("{fault:?} at step {at} of build {after}");
                let plan = Plan::new(folder, fault, at);
                let built = build(folder, after);
                let struck = plan.has_struck();
                drop(plan);
                is_of_one_build(folder, &what);
                if !fault.ends_the_process() {
                    let left = built.as_ref().err().and_then(|error| error.left.as_ref());
                    match &built {
                        Ok(()) => assert_eq!(view(folder), whole(after), "{what}"),
                        Err(_) if left.is_none() => assert_eq!(view(folder), whole(before), "{what}"),
                        Err(_) => assert!(left.is_some_and(|left| left.is_dir()), "{what}"),
                    }
                }
                // the next process
                let _quiet = Plan::new(folder, Fault::Slow, usize::MAX);
                // a test that starts a program may hold copies of all locks for a moment
                for _ in 0..100 {
                    drop(Staging::begin(folder, &[]).expect("settled"));
                    if hidden(folder).is_empty() {
                        break;
                    }
                    std::thread::sleep(std::time::Duration::from_millis(5));
                }
                let found = view(folder);
                assert!(found == whole(before) || found == whole(after), "{what}: {found:?}");
                assert!(built.is_err() || found == whole(after), "{what}: {found:?}");
                assert_eq!(hidden(folder), [""; 0], "{what}");
                if found == whole(after) && struck {
                    *counts.entry((fault.ends_the_process(), before)).or_insert(0) += 1;
                }
                if !struck || fault == Fault::Slow {
                    assert!(built.is_ok());
                    break;
                }
            }
        }
    }
    // some are completed by the next process
    assert!(counts[&(true, "0")] > 0 && counts[&(true, "1")] > 0, "{counts:?}");
}

/// A process that completes the exchange of another is killed as well.
#[test]
fn a_failure_while_settling_leaves_one_whole_build() {
    for (fault, first) in [(Fault::Killed, 32), (Fault::Killed, 36), (Fault::PowerLost, 42), (Fault::ReadOnly, 38)] {
        for at in 0.. {
            let place = place();
            let folder = place.path();
            let quiet = Plan::new(folder, Fault::Slow, usize::MAX);
            build(folder, "1").expect("built");
            drop(quiet);
            let plan = Plan::new(folder, fault, first);
            let error = build(folder, "2").expect_err("killed");
            drop(plan);
            let plan = Plan::new(folder, Fault::Killed, at);
            let settled = Staging::begin(folder, &[]);
            let struck = plan.has_struck();
            drop((settled, plan));
            let what = format!("{fault:?} at {first} ({error:?}), then killed at {at}");
            is_of_one_build(folder, &what);
            let _quiet = Plan::new(folder, Fault::Slow, usize::MAX);
            drop(Staging::begin(folder, &[]).expect("settled"));
            let found = view(folder);
            assert!(found == whole("1") || found == whole("2"), "{what}: {found:?}");
            assert_eq!(hidden(folder), [""; 0], "{what}");
            if !struck {
                break;
            }
        }
    }
}

#[test]
fn a_folder_in_the_way_leaves_the_earlier_files() {
    let place = tempfile::tempdir().expect("a folder");
    build(place.path(), "1").expect("built");
    fs::remove_file(place.path().join(NAMES[4])).expect("removed");
    fs::create_dir_all(place.path().join(NAMES[4]).join("in the way")).expect("made");
    let error = build(place.path(), "2").expect_err("a folder is there");
    assert_eq!((error.name.as_str(), error.error.kind()), (NAMES[4], io::ErrorKind::IsADirectory));
    assert_eq!(fs::read_to_string(place.path().join("a.png")).expect("there"), "1 a.png");
    assert_eq!(hidden(place.path()), [""; 0]);
}

#[test]
fn only_what_no_process_holds_is_removed() {
    let place = tempfile::tempdir().expect("a folder");
    let path = |name: &str| place.path().join(name);
    let held = Staging::begin(place.path(), &[]).expect("begun");
    let mut part = Part::begin(&path("graph.ron"), Access::Usual).expect("begun");
    part.write_all(b"text").expect("written");
    // of dead processes: two folders, one of which lost its lock, and a file
    let dead = [".orograph-00000000000000aa", ".orograph-00000000000000bb"].map(path);
    for folder in &dead {
        fs::create_dir_all(folder.join("new")).expect("made");
        fs::write(folder.join("new/height.exr"), "half").expect("written");
    }
    let files = [".orograph-00000000000000aa.lock", ".orograph-00000000000000cc.part"].map(path);
    files.iter().for_each(|file| drop(File::create(file).expect("made")));
    // of the user
    let kept = [".orograph-notes.part", ".orograph-00000000000000aa.txt", ".orographs", "orograph-00000000000000aa"];
    kept.map(path).iter().for_each(|file| drop(File::create(file).expect("made")));

    drop(Staging::begin(place.path(), &[]).expect("begun"));
    assert!(dead.iter().chain(&files).all(|path| !path.exists()), "{:?}", hidden(place.path()));
    assert!(kept.map(path).iter().all(|path| path.exists()));
    fs::write(held.files().join("a"), "text").expect("it is still there");
    part.persist().expect("it is still there");
    assert_eq!(fs::read_to_string(path("graph.ron")).expect("there"), "text");
    drop(held);
    assert_eq!(hidden(place.path()).len(), 3);
}

/// A folder from a stranger can have the plan of an exchange, too.
#[test]
fn plans_reach_no_other_folder() {
    for (name, is_link) in [("../mine", false), ("/etc/mine", false), (".git", false), ("mine", true)] {
        let root = tempfile::tempdir().expect("a folder");
        let (folder, other) = (root.path().join("theirs"), root.path().join("other"));
        let staging = folder.join(".orograph-00000000000000aa");
        fs::create_dir_all(staging.join("new")).expect("made");
        fs::create_dir(&other).expect("made");
        fs::write(staging.join("new/mine"), "theirs").expect("written");
        fs::write(other.join("mine"), "mine").expect("written");
        fs::write(root.path().join("mine"), "mine").expect("written");
        fs::write(folder.join("mine"), "mine").expect("written");
        #[cfg(unix)]
        if is_link {
            std::os::unix::fs::symlink(&other, staging.join("old")).expect("made");
        }
        if !is_link || cfg!(not(unix)) {
            fs::create_dir(staging.join("old")).expect("made");
        }
        let plan = format!(r#"[{{"name": "{name}", "new": true, "old": true}}]"#);
        fs::write(staging.join("commit.json"), plan).expect("written");
        if is_link && cfg!(not(unix)) {
            continue;
        }
        Staging::begin(&folder, &[]).expect_err("a plan that nobody here has made");
        for mine in [other.join("mine"), root.path().join("mine"), folder.join("mine")] {
            assert_eq!(fs::read_to_string(mine).expect("there"), "mine", "{name}");
        }
    }
}

#[cfg(unix)]
#[test]
fn builds_at_the_same_time_do_not_mix() {
    let place = tempfile::tempdir().expect("a folder");
    let _quiet = Plan::new(place.path(), Fault::Slow, usize::MAX);
    let folder = place.path();
    std::thread::scope(|scope| {
        for version in ["2", "3", "4"] {
            scope.spawn(move || (0..20).for_each(|_| build(folder, version).expect("built")));
        }
    });
    let found = view(place.path());
    assert!(["2", "3", "4"].iter().any(|version| found == whole(version)), "{found:?}");
    assert_eq!(hidden(place.path()), [""; 0]);
}

#[test]
fn a_failure_at_any_step_leaves_one_whole_file() {
    for fault in Fault::ALL {
        for at in 0.. {
            let place = place();
            let path = place.path().join("graph.ron");
            fs::write(&path, "before").expect("written");
            let plan = Plan::new(place.path(), fault, at);
            let written = put(&path, "after");
            let struck = plan.has_struck();
            drop(plan);
            let text = fs::read_to_string(&path).expect("there");
            assert!(text == "after" || written.is_err() && text == "before", "{fault:?} at {at}: {text}");
            put(&path, "next").expect("written");
            assert_eq!(hidden(place.path()), [""; 0], "{fault:?} at {at}");
            if !struck {
                break;
            }
        }
    }
}
