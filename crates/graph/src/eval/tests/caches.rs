//! Results cached in memory and on disk.

use std::{fs, path::PathBuf, time::Duration};

use super::*;

fn graph() -> Graph {
    Build::default()
        .node("base", &WAVES, &[])
        .node("soft", &BLUR, &[("height", "base")])
        .node("stats", &ANOMALY, &[("height", "soft")])
        .0
}

const ENDS: &[&str] = &["stats.height", "stats.report", "stats.lines"];

/// An evaluator with a disk cache only.
fn on_disk(folder: &Path, budget: u64) -> Evaluator {
    with(keeping(0, Some(StoreFolder { folder: folder.to_owned(), budget, worth: Duration::ZERO, trust: Trust::Own })))
}

/// The files of a store.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = |folder: &Path| fs::read_dir(folder).expect("a folder").map(|e| e.expect("an entry").path());
    let shards = entries(folder).filter(|path| path.is_dir());
    let mut files: Vec<PathBuf> = shards.flat_map(|shard| entries(&shard).collect::<Vec<_>>()).collect();
    files.sort();
    files
}

fn bits(values: &[Value]) -> Vec<Vec<u64>> {
    let one = |value: &Value| match value {
        Value::Field(field) => field.samples().iter().map(|v| u64::from(v.to_bits())).collect(),
        Value::Strata(strata) => strata.offset().samples().iter().map(|v| u64::from(v.to_bits())).collect(),
        Value::Lines(lines) => {
            lines.lines.iter().flat_map(|line| &line.vertices).map(|v| v.width_m.to_bits()).collect()
        }
        Value::Report(report) => report.measures.iter().map(|m| m.value.to_bits()).collect(),
        Value::State(_) => Vec::new(),
    };
    values.iter().map(one).collect()
}

#[test]
fn memory_stays_within_its_budget() {
    let window = Window::whole(world(64));
    let budget = 40_000; // two rasters of 16 KiB
    let evaluator = with(keeping(budget, None));
    for level in 0..10 {
        let graph = Build(graph()).set("base", "level", ParamValue::Float(f64::from(level))).0;
        run(&evaluator, &graph, ENDS, window).expect("runs");
        assert!(evaluator.store().bytes() <= budget);
    }
    assert!(evaluator.store().bytes() > 16 << 10);
}

#[test]
fn results_come_back_from_disk_bit_by_bit() {
    let folder = tempfile::tempdir().expect("a folder");
    let cache = folder.path().join("made/when/needed");
    let window = Window::whole(world(32));
    let first = run(&on_disk(&cache, 1 << 20), &graph(), ENDS, window).expect("runs");
    let second = run(&on_disk(&cache, 1 << 20), &graph(), ENDS, window).expect("runs");
    assert_eq!(second.from(Origin::Disk), ["stats"]);
    assert_eq!(second.origins.len(), 1);
    assert_eq!(bits(&first.values), bits(&second.values));
    assert!(second.values[2].as_lines().is_some_and(|lines| lines.lines.len() == 2));
    assert_eq!(second.values[2], first.values[2]);
    assert!(second.values[1].as_report().and_then(|r| r.get("undefined")).expect("kept").is_nan());
    assert!(files(&cache).iter().all(|file| file.extension().is_some_and(|e| e == "orovalue")), "no leftovers");
}

#[test]
fn an_invalid_file_is_replaced() {
    let folder = tempfile::tempdir().expect("a folder");
    let window = Window::whole(world(32));
    let good = run(&on_disk(folder.path(), 1 << 20), &graph(), ENDS, window).expect("runs");
    let sound: Vec<(PathBuf, Vec<u8>)> =
        files(folder.path()).into_iter().map(|path| (path.clone(), fs::read(path).expect("read"))).collect();
    // each file gets the content of another one of the same length, which is valid but has another key
    let foreign = |of: usize| {
        let others = sound.iter().cycle().skip(of + 1).map(|(_, bytes)| bytes);
        let mut as_long = others.take(sound.len()).filter(|bytes| bytes.len() == sound[of].1.len());
        as_long.next().expect("at least itself").clone()
    };
    type Damage = fn(&mut Vec<u8>);
    let damages: [(&str, Damage); 6] = [
        ("a bit of the payload", |bytes| *bytes.last_mut().expect("bytes") ^= 1),
        ("a bit of the hash", |bytes| bytes[70] ^= 1),
        ("a bit of the window", |bytes| bytes[40] ^= 1),
        ("half of it", |bytes| bytes.truncate(bytes.len() / 2)),
        ("nothing", |bytes| bytes.clear()),
        ("some text", |bytes| *bytes = b"something else".to_vec()),
    ];
    let damaged = damages.map(|(what, damage)| {
        let mut all: Vec<Vec<u8>> = sound.iter().map(|(_, bytes)| bytes.clone()).collect();
        all.iter_mut().for_each(damage);
        (what, all)
    });
    let swapped = ("another key", (0..sound.len()).map(foreign).collect());
    for (what, contents) in damaged.into_iter().chain([swapped]) {
        for ((path, _), bytes) in sound.iter().zip(&contents) {
            fs::write(path, bytes).expect("written");
        }
        let again = run(&on_disk(folder.path(), 1 << 20), &graph(), ENDS, window).expect("runs");
        assert_eq!(again.computed(), ["base", "soft", "stats"], "{what}");
        assert!(!again.warnings.is_empty(), "{what}");
        assert_eq!(bits(&good.values), bits(&again.values), "{what}");
        for (path, bytes) in &sound {
            assert!(&fs::read(path).expect("read") == bytes, "{what} was not replaced");
        }
    }
}

#[test]
fn a_folder_that_cannot_be_written_to_is_a_warning() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("file");
    fs::write(&file, "in the way").expect("written");
    let outcome = run(&on_disk(&file, 1 << 20), &graph(), ENDS, Window::whole(world(16))).expect("runs");
    assert_eq!(outcome.warnings.len(), 1, "told once: {:?}", outcome.warnings);
    assert!(outcome.warnings[0].contains("cannot be stored in"));
}

#[test]
fn the_least_recently_used_files_are_deleted_and_others_are_left_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("notes.txt"), vec![0; 100_000]).expect("written");
    let window = Window::whole(world(32)); // 4 KiB a raster
    let source = |level: f64| {
        let base = Build::default().node("base", &WAVES, &[]);
        base.set("base", "level", ParamValue::Float(level)).0
    };
    let evaluator = on_disk(folder.path(), 3 * 4300);
    for level in [1.0, 2.0, 3.0, 1.0, 4.0] {
        run(&evaluator, &source(level), &["base"], window).expect("runs");
        std::thread::sleep(std::time::Duration::from_millis(20)); // longer than a tick of the file system's clock
    }
    let origin = |level| run(&evaluator, &source(level), &["base"], window).expect("runs").origins["base"];
    assert_eq!([1.0, 3.0, 4.0].map(origin), [Origin::Disk; 3]);
    assert_eq!(origin(2.0), Origin::Computed);
    let held: u64 = files(folder.path()).iter().map(|file| fs::metadata(file).expect("a file").len()).sum();
    assert!(held <= 3 * 4300);
    assert!(folder.path().join("notes.txt").exists());
}

#[test]
fn what_is_larger_than_the_disk_budget_is_not_written() {
    let folder = tempfile::tempdir().expect("a folder");
    run(&on_disk(folder.path(), 1000), &graph(), &["soft"], Window::whole(world(32))).expect("runs");
    assert_eq!(files(folder.path()), Vec::<PathBuf>::new());
}
