//! Tests with too little memory: the program reports it with a hint and leaves no unfinished files.

use std::{fs, path::PathBuf, process::Command};

use super::{Place, Ran};

/// Nodes of several categories whose kernels allocate memory of many sizes.
const GRAPH: &str = r#"(
    world: (size: "8 km", cells: 768, seed: 7),
    nodes: {
        "hills": Ridged(wavelength: "5 km", amplitude: "300 m"),
        "rivers": Flow(height: "hills"),
        "scree": Thermal(height: "hills"),
        "smooth": Blur(value: "scree", radius: "100 m"),
        "relief": Hillshade(height: "smooth"),
    },
    outputs: { "height": "smooth", "picture": "relief.colour", "area": "rivers.area" },
)
"#;

const RUN: &str = "run g.ron -q --threads 2";

/// In KiB, as the shell counts.
const MIB: u64 = 1024;

/// The program with an address space of this many KiB.
fn limited(place: &Place, kib: u64, args: &str) -> Command {
    let mut shell = Command::new("sh");
    shell.current_dir(place.path(".")).env("NO_COLOR", "1").env("OROGRAPH_CACHE", "");
    shell.args(["-c", &format!("ulimit -v {kib}; exec \"$0\" {args}"), env!("CARGO_BIN_EXE_orograph")]);
    shell
}

/// Runs the program, again if it did not end in good order. How much memory threads reserve differs between runs. Where
/// it runs out while a stack grows, while the runtime starts a thread, or while the last files are removed, no program
/// can end in good order; a limit at which it never does is a defect.
fn run(place: &Place, kib: u64, args: &str) -> Ran {
    const MOST: usize = 5;
    let mut output = limited(place, kib, args).output().expect("a shell");
    for _ in 1..MOST {
        let left = unfinished(place);
        if output.status.code().is_some() && left.is_empty() {
            break;
        }
        for path in left {
            let removed = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
            removed.expect("removed");
        }
        // it stays if it has files
        let _ = fs::remove_dir(place.path("out"));
        output = limited(place, kib, args).output().expect("a shell");
    }
    Ran::from(output)
}

/// Unfinished files of a run.
fn unfinished(place: &Place) -> Vec<PathBuf> {
    let entries = fs::read_dir(place.path("out")).into_iter().flatten().flatten();
    let is_ours = |entry: &fs::DirEntry| entry.file_name().to_string_lossy().starts_with(".orograph");
    entries.filter(is_ours).map(|entry| entry.path()).collect()
}

/// The smallest limit, rounded to a MiB, with which the program succeeds; it succeeds with `most`.
fn least(place: &Place, most: u64, args: &str) -> u64 {
    // below some limit the system's loader fails before the program starts
    let does = |kib| limited(place, kib, args).output().expect("a shell").status.success();
    let (mut low, mut high) = (0, most);
    assert!(does(high), "it takes more than {} MiB", most / MIB);
    while high - low > MIB {
        let middle = u64::midpoint(low, high);
        *(if does(middle) { &mut high } else { &mut low }) = middle;
    }
    high
}

/// The smallest limit with which the program starts and can report an error.
fn start(place: &Place) -> u64 {
    // The main thread's stack grows as it is used, and counts as well. Where it cannot grow the system ends the program;
    // a run takes about 50 KiB more of it than the version.
    least(place, 512 * MIB, "--version") + MIB
}

/// Checks that the program succeeded, or failed with a hint. Removes the output files; no others may be left.
#[track_caller]
fn ended_in_good_order(place: &Place, ran: &Ran, what: &str) {
    assert!([0, 1, 2].contains(&ran.code), "{what}: {ran:?}");
    let out = place.path("out");
    if ran.code == 0 {
        assert!(place.names("out").iter().all(|name| !name.starts_with(".orograph")), "{what}: {ran:?}");
        fs::remove_dir_all(out).expect("removed");
    } else {
        assert!(ran.err.contains("error:") && ran.err.contains("fewer"), "{what}: {ran:?}");
        assert!(!out.exists(), "{what}: {:?} is left, {ran:?}", place.names("out"));
    }
}

#[test]
fn every_memory_limit_fails_cleanly_or_succeeds() {
    let place = Place::new();
    place.write("g.ron", GRAPH);
    let starts = start(&place);
    let enough = least(&place, 4096 * MIB, RUN);
    assert!(starts < enough);
    fs::remove_dir_all(place.path("out")).expect("written");
    let mut codes = Vec::new();
    for step in 0..=20 {
        let kib = starts + (enough - starts) * step / 20;
        let ran = run(&place, kib, "run g.ron --json --threads 2");
        ended_in_good_order(&place, &ran, &format!("{kib} KiB of {starts} to {enough}"));
        let last = ran.out.lines().last().expect("lines of JSON");
        let last: serde_json::Value = serde_json::from_str(last).unwrap_or_else(|error| panic!("{error}: {ran:?}"));
        assert_eq!(last["event"], if ran.code == 0 { "done" } else { "error" }, "{ran:?}");
        codes.push(ran.code);
    }
    assert!(codes.contains(&0) && codes.contains(&2), "{codes:?}");
}

#[test]
fn earlier_files_stay_when_memory_is_refused_in_the_middle() {
    let place = Place::new();
    place.write("g.ron", GRAPH);
    let starts = start(&place);
    let enough = least(&place, 4096 * MIB, "run g.ron -q --threads 2 -o other");
    let mut refused = 0;
    // what is enough differs between runs, as the allocator reserves memory for threads
    for share in [10, 30, 50, 70] {
        fs::create_dir(place.path("out")).expect("made");
        place.write("out/height.exr", "from before");
        let ran = run(&place, starts + (enough - starts) * share / 100, RUN);
        assert!([0, 2].contains(&ran.code), "{ran:?}");
        if ran.code == 2 {
            refused += 1;
            assert_eq!(place.names("out"), ["height.exr"], "{ran:?}");
            assert_eq!(place.read("out/height.exr"), "from before");
        }
        fs::remove_dir_all(place.path("out")).expect("removed");
    }
    assert!(refused > 0, "{} MiB are enough, and little more than {}", enough / MIB, starts / MIB);
}

#[test]
fn a_failure_to_start_threads_is_an_error() {
    let place = Place::new();
    place.write("g.ron", GRAPH);
    for threads in [60, 40, 20] {
        let ran = run(&place, 300 * MIB, &format!("run g.ron -q --threads {threads}"));
        ended_in_good_order(&place, &ran, &format!("{threads} threads"));
    }
    run(&place, 300 * MIB, "run g.ron -q --threads 200").ended(2, &["threads", "use fewer threads"]);
}

/// `StreamPower` on 23170 x 23170 cells needs 12 GiB for values, and 14 GiB more. The shell limits the program to 24
/// GiB of address space, whatever memory the machine has.
#[test]
fn kernel_memory_counts_for_the_refusal_of_a_graph() {
    let place = Place::new();
    let graph = concat!(env!("CARGO_MANIFEST_DIR"), "/../../graphs/alps.ron");
    let ran = run(&place, 24 * 1024 * MIB, &format!("run {graph} --threads 2 --cells 23170"));
    ran.ended(2, &["rivers", "GiB of memory", "fewer cells"]);
    assert!(!place.path("out").exists(), "nothing has run");
}
