//! The folder of results, shared by several programs.

use std::{
    fs::{self, File},
    path::PathBuf,
    sync::atomic::{AtomicBool, Ordering},
    time::{Duration, SystemTime},
};

use super::*;
use crate::mix;

fn folder_of(folder: &Path, budget: u64) -> StoreFolder {
    StoreFolder { folder: folder.to_owned(), budget, worth: Duration::ZERO, trust: Trust::Own }
}

fn on_disk(folder: &Path, budget: u64) -> Evaluator {
    with(keeping(0, Some(folder_of(folder, budget))))
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = |folder: &Path| fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    entries(folder).filter(|path| path.is_dir()).flat_map(|shard| entries(&shard).collect::<Vec<_>>()).collect()
}

fn graph(level: f64) -> Graph {
    Build::default()
        .node("base", &WAVES, &[])
        .set("base", "level", ParamValue::Float(level))
        .node("soft", &BLUR, &[("height", "base")])
        .node("stats", &ANOMALY, &[("height", "soft")])
        .0
}

#[test]
fn a_window_is_read_out_of_a_wider_stored_raster() {
    let folder = tempfile::tempdir().expect("a folder");
    let whole = Window::whole(world(700));
    let all = run(&on_disk(folder.path(), 1 << 30), &graph(0.0), &["soft"], whole).expect("runs").values.remove(0);
    let all = all.as_field().expect("a field").clone();
    // windows across bands of rows, within one, at the corners, and of a single cell
    for (origin, cells) in
        [([100, 300], [50, 390]), ([3, 5], [20, 30]), ([0, 0], [1, 1]), ([699, 699], [1, 1]), ([0, 374], [700, 2])]
    {
        let part = Window { origin, cells, ..whole };
        let got = run(&on_disk(folder.path(), 1 << 30), &graph(0.0), &["soft"], part).expect("runs");
        assert_eq!(got.from(Origin::Disk), ["soft"], "{origin:?}");
        assert_eq!(got.values[0].as_field(), Some(&all.crop(&part)), "{origin:?}");
    }
    // damage outside the part that is read goes unnoticed, damage inside does not
    let stored = files(folder.path());
    let largest = stored.iter().max_by_key(|path| fs::metadata(path).map_or(0, |meta| meta.len())).expect("stored");
    let mut bytes = fs::read(largest).expect("read");
    *bytes.last_mut().expect("bytes") ^= 1;
    for path in &stored {
        fs::write(path, &bytes).expect("written");
    }
    let corner = Window { origin: [690, 690], cells: [10, 10], ..whole };
    let got = run(&on_disk(folder.path(), 1 << 30), &graph(0.0), &["soft"], corner).expect("runs");
    assert!(got.computed().contains(&"soft") && !got.warnings.is_empty());
    assert_eq!(got.values[0].as_field(), Some(&all.crop(&corner)));
}

/// An entry with correct hashes and numbers that no kernel may return.
#[test]
fn forged_results_are_checked_like_those_of_kernels() {
    let folder = tempfile::tempdir().expect("a folder");
    let window = Window::whole(world(16));
    let expected = run(&on_disk(folder.path(), 1 << 20), &graph(0.0), &["soft"], window).expect("runs").values;
    for path in files(folder.path()) {
        let mut bytes = fs::read(&path).expect("read");
        // fields, their hash, the hash of the only band, and the samples
        let (fields, table) = (64, 96);
        bytes[table + 32..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
        let band = blake3::hash(&bytes[table + 32..]);
        bytes[table..][..32].copy_from_slice(band.as_bytes());
        let head = blake3::Hasher::new().update(&bytes[..fields]).update(band.as_bytes()).finalize();
        bytes[fields..table].copy_from_slice(head.as_bytes());
        fs::write(&path, bytes).expect("written");
    }
    let got = run(&on_disk(folder.path(), 1 << 20), &graph(0.0), &["soft"], window).expect("runs");
    assert_eq!(got.values, expected);
    assert!(got.warnings.iter().any(|warning| warning.contains("NaN at cell (0, 0)")), "{:?}", got.warnings);
}

/// A folder into which everyone may write is neither read nor written, with one warning.
#[cfg(unix)]
#[test]
fn a_folder_open_to_all_is_left_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    let window = Window::whole(world(16));
    let again = |trust: Trust| {
        let place = StoreFolder { trust, ..folder_of(folder.path(), 1 << 20) };
        run(&with(keeping(0, Some(place))), &graph(0.0), &["soft"], window).expect("runs")
    };
    assert_eq!(again(Trust::Own).computed().len(), 2);
    fs::set_permissions(folder.path(), std::os::unix::fs::PermissionsExt::from_mode(0o777)).expect("set");
    let stored = files(folder.path());
    let got = again(Trust::Own);
    assert_eq!((got.computed().len(), got.warnings.len()), (2, 1), "{:?}", got.warnings);
    assert!(got.warnings[0].contains("everyone may write"), "{:?}", got.warnings);
    assert_eq!(files(folder.path()), stored);
    assert_eq!(again(Trust::Anyone).from(Origin::Disk), ["soft"]);
}

#[test]
fn programs_share_a_folder_whatever_happens_to_its_files() {
    let scratch = tempfile::tempdir().expect("a folder");
    let folder = scratch.path();
    let window = Window::whole(world(40));
    let expected: Vec<Vec<Value>> = (0..6)
        .map(|level| run(&evaluator(1), &graph(f64::from(level)), &["soft", "stats"], window).expect("runs").values)
        .collect();
    let is_over = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let is_over = &is_over;
        let vandal = move || {
            let mut round = 0;
            while !is_over.load(Ordering::Relaxed) {
                for path in files(folder) {
                    round = mix(round + 1);
                    match round % 7 {
                        0 => drop(fs::remove_file(&path)),
                        1 => drop(fs::write(&path, b"something else")),
                        2 => drop(File::options().write(true).open(&path).and_then(|file| file.set_len(200))),
                        _ => {}
                    }
                }
                std::thread::sleep(Duration::from_millis(1));
            }
        };
        scope.spawn(vandal);
        let programs: Vec<_> = (0..2)
            .map(|program| {
                let expected = &expected;
                scope.spawn(move || {
                    for round in 0..60_u32 {
                        // a new store each time, as in a program that has just started; a small budget evicts results
                        let evaluator = on_disk(folder, if round % 3 == 0 { 40_000 } else { 1 << 20 });
                        let level = (mix(round + 1000 * program) % 6) as usize;
                        let graph = graph(level as f64);
                        let requests = ["soft", "stats"].map(|end| (graph.port(end).expect("exists"), window));
                        // results that are lost after being found are read or computed again
                        let got = evaluate(&evaluator, &graph, &requests, &Cancel::default(), &|_| {}).expect("runs");
                        assert!(got == expected[level], "level {level} in round {round}");
                    }
                })
            })
            .collect();
        let ends: Vec<_> = programs.into_iter().map(std::thread::ScopedJoinHandle::join).collect();
        is_over.store(true, Ordering::Relaxed);
        assert!(ends.iter().all(Result::is_ok));
    });
}

#[test]
#[expect(clippy::disallowed_methods, reason = "the clock is set back, so to say")]
fn entries_from_the_future_go_first_and_a_full_folder_shrinks() {
    let folder = tempfile::tempdir().expect("a folder");
    let window = Window::whole(world(32));
    let source =
        |level: f64| Build::default().node("base", &WAVES, &[]).set("base", "level", ParamValue::Float(level)).0;
    for level in 0..6 {
        run(&on_disk(folder.path(), 1 << 20), &source(f64::from(level)), &["base"], window).expect("runs");
    }
    let all = files(folder.path());
    let later = SystemTime::now() + Duration::from_secs(3600);
    for path in &all[..3] {
        File::options().append(true).open(path).and_then(|file| file.set_modified(later)).expect("set");
    }
    // six files of about 4.3 kB exceed this program's limit
    run(&on_disk(folder.path(), 4 * 4400), &source(9.0), &["base"], window).expect("runs");
    let left = files(folder.path());
    assert_eq!(left.len(), 4);
    assert!(all[..3].iter().all(|path| !left.contains(path)), "the clock was set back since they were used");
}

#[test]
fn a_folder_reports_its_size_and_is_cleared() {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder_of(&folder.path().join("not yet"), 1 << 20);
    assert_eq!(place.usage().expect("listed"), Usage::default());
    let place = folder_of(folder.path(), 1 << 20);
    fs::write(folder.path().join("notes.txt"), "mine").expect("written");
    run(&on_disk(folder.path(), 1 << 20), &graph(0.0), &["soft", "stats.report"], Window::whole(world(16)))
        .expect("runs");
    let usage = place.usage().expect("listed");
    assert_eq!(usage.files, files(folder.path()).len() as u64);
    assert!(usage.files >= 3 && usage.bytes > 2 * 1024);
    assert_eq!(place.clear().expect("cleared"), usage);
    assert_eq!(place.usage().expect("listed"), Usage::default());
    assert!(folder.path().join("notes.txt").exists() && files(folder.path()).is_empty());
}

#[test]
fn persist_writes_requested_results() {
    let folder = tempfile::tempdir().expect("a folder");
    let slow = StoreFolder { worth: Duration::from_secs(3600), ..folder_of(folder.path(), 1 << 20) };
    let graph = graph(0.0);
    let requests = [Request { port: graph.port("soft").expect("exists"), window: Window::whole(world(16)) }];
    let evaluation = Evaluation { graph: &graph, folder: Path::new(""), requests: &requests, byproducts: &[] };
    let first = with(keeping(1 << 20, Some(slow)));
    first.evaluate(&evaluation, &Cancel::default(), &|_| {});
    assert!(files(folder.path()).is_empty(), "it took no time");
    first.persist(&evaluation, &Cancel::default()).expect("written");
    let second = run(&on_disk(folder.path(), 1 << 20), &graph, &["soft"], requests[0].window).expect("runs");
    assert_eq!((second.from(Origin::Disk), second.computed()), (vec!["soft"], vec![]));
}

#[test]
fn byproducts_are_stored_where_their_kernel_runs_and_only_there() {
    let graph = graph(0.0);
    let window = Window::whole(world(16));
    let request = |end: &str| Request { port: graph.port(end).expect("exists"), window };
    let evaluator = evaluator(2);
    let run_with = |requests: &[Request], byproducts: &[Request]| {
        let evaluation = Evaluation { graph: &graph, folder: Path::new(""), requests, byproducts };
        let answers = evaluator.evaluate(&evaluation, &Cancel::default(), &|_| {});
        assert!(answers.iter().all(Result::is_ok));
    };
    run_with(&[request("stats")], &[request("stats.report"), request("base")]);
    assert!(run(&evaluator, &graph, &["stats.report", "base"], window).expect("runs").computed().is_empty());
    assert_eq!(run(&evaluator, &graph, &["stats.lines"], window).expect("runs").computed(), ["stats"]);
    run_with(&[request("soft")], &[request("stats.lines")]);
}
