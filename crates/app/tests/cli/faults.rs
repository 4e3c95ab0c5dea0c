//! Killed runs, full disks and limits on files.

use std::{
    collections::BTreeMap,
    fs::{self, File},
    io::Read as _,
    process::Stdio,
    thread::sleep,
    time::Duration,
};

use super::{Place, SMALL};

const GRAPH: &str = r#"(
    world: (size: "8 km", cells: 64),
    nodes: { "land": Ridged(wavelength: "3 km"), "relief": Hillshade(height: "land") },
    outputs: { "height": "land", "relief": "relief.colour" },
)"#;

fn files(place: &Place, folder: &str) -> BTreeMap<String, Vec<u8>> {
    let names = place.names(folder).into_iter().filter(|name| !name.starts_with('.') && !name.starts_with("height.p"));
    names.map(|name| (name.clone(), place.bytes(&format!("{folder}/{name}")))).collect()
}

/// A small version of `tests/faults/run.sh`.
#[test]
fn a_killed_run_leaves_one_build() {
    let place = Place::new();
    place.write("g.ron", GRAPH);
    place.write("other.ron", &SMALL.replace("\"height\": \"plain\", \"picture\"", "\"other\": \"plain\", \"picture\""));
    let args =
        |seed: &'static str, out: &'static str| ["run", "g.ron", "-q", "--format", "r16", "--seed", seed, "-o", out];
    let builds = [("1", "first"), ("2", "second")].map(|(seed, out)| {
        place.run(&args(seed, out)).done();
        files(&place, out)
    });
    place.run(&args("1", "out")).done();
    for wait in 0..8 {
        let mut child =
            place.command(&args("2", "out")).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it starts");
        sleep(Duration::from_millis(15 + wait * 8));
        // it may have ended
        let _ = child.kill();
        child.wait().expect("a child");
        let seen = files(&place, "out");
        let is_of =
            |build: &&BTreeMap<String, Vec<u8>>| seen.iter().all(|(name, bytes)| build.get(name) == Some(bytes));
        assert!(builds.iter().any(|build| is_of(&build)), "after {wait}: {:?}", seen.keys());
        assert!(!seen.contains_key("height.r16") || seen.contains_key("height.r16.json"), "{:?}", seen.keys());
        // this one reads the folder
        place.run(&["metrics", "out/height.r16", "--json"]).done();
        assert!(builds.contains(&files(&place, "out")), "after {wait}");
        assert!(place.names("out").iter().all(|name| !name.starts_with('.')), "{:?}", place.names("out"));
    }
}

#[test]
fn leftovers_of_dead_processes_are_removed() {
    let place = Place::new();
    place.write("g.ron", SMALL);
    place.run(&["pack", "g.ron"]).done();
    let dead = |folder: &str| {
        fs::create_dir_all(place.path(&format!("{folder}/.orograph-0123456789abcdef/new"))).expect("made");
        for name in [".orograph-0123456789abcdef.lock", ".orograph-fedcba9876543210.part"] {
            place.write(&format!("{folder}/{name}"), "");
        }
    };
    dead("out");
    place.run(&["run", "g.ron", "-q"]).done();
    dead("temporary");
    let ran = place.command(&["check", "g.orograph"]).env("TMPDIR", place.path("temporary")).output();
    assert!(ran.expect("it starts").status.success());
    dead("in");
    place.run(&["unpack", "g.orograph", "-o", "in/g"]).done();
    for folder in ["out", "temporary", "in"] {
        let left: Vec<String> = place.names(folder).into_iter().filter(|name| name.starts_with('.')).collect();
        assert_eq!(left, [""; 0], "{folder}");
    }
}

/// The limit on the size of files counts as a full disk, and does not end the program by a signal.
#[test]
fn a_limit_on_files_is_an_error_with_a_remedy() {
    let place = Place::new();
    place.write("g.ron", &GRAPH.replace("64", "256"));
    place.write("big.ron", &format!("{SMALL}{}", "// a comment\n".repeat(4000)));
    place.run(&["pack", "big.ron", "-o", "big.orograph"]).done();
    fs::create_dir(place.path("noise")).expect("made");
    let mut noise = vec![0; 200_000];
    File::open("/dev/urandom").and_then(|mut from| from.read_exact(&mut noise)).expect("noise");
    fs::write(place.path("noise/land.r16"), &noise).expect("written");
    fs::write(place.path("noise/land.r16.json"), r#"{"columns": 400, "rows": 250, "cell_m": 10, "range": [0, 1]}"#)
        .expect("written");
    place.write(
        "noise/g.ron",
        r#"(nodes: { "a": Import(file: "land.r16") }, outputs: { "height": "a" }, world: (cells: 16))"#,
    );
    for (command, left) in [
        ("run g.ron -q", "out"),
        ("unpack big.orograph -o in", "in"),
        ("pack noise/g.ron -o noise.orograph", "noise.orograph"),
        ("render g.ron -o g.png --view map", "g.png"),
    ] {
        // blocks of 512 bytes or of 1 KiB
        let ran = place.shell(&format!("ulimit -f 16; exec \"$0\" {command}"));
        ran.ended(2, &["does not allow a file of that size", "ulimit -f"]);
        assert!(!place.path(left).exists(), "{command}: {:?}", place.names("."));
    }
    assert!(place.names(".").iter().all(|name| !name.starts_with('.')), "{:?}", place.names("."));
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_standard_output_is_an_error_with_a_remedy() {
    let place = Place::new();
    place.write("g.ron", SMALL);
    for command in ["nodes", "--help", "run --help", "--version", "check g.ron", "run g.ron", "run g.ron --json"] {
        let ran = place.shell(&format!("exec \"$0\" {command} > /dev/full"));
        ran.ended(2, &["cannot write to standard output: the disk is full", "free some space"]);
    }
    assert!(place.path("out/height.exr").exists());
}
