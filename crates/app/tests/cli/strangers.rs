//! Graphs of others: what they name is not given away, and nothing that they name makes the program wait.

use std::{
    fs,
    os::unix::fs::symlink,
    process::Command,
    time::{Duration, Instant},
};

use super::{Place, repository};

fn importing(file: &str) -> String {
    format!("(nodes: {{ \"dem\": Import(file: \"{file}\") }}, outputs: {{ \"height\": \"dem\" }})")
}

fn using(file: &str) -> String {
    format!("(nodes: {{ \"a\": Subgraph(file: \"{file}\") }}, outputs: {{ \"height\": \"a\" }})")
}

/// Much longer than a refusal takes on a busy machine, much shorter than 10^14 nodes.
const PATIENCE: Duration = Duration::from_secs(60);

#[expect(clippy::disallowed_methods, reason = "measures the time")]
fn now() -> Instant {
    Instant::now()
}

#[test]
fn only_rasters_and_graphs_are_packed() {
    let place = Place::new();
    for folder in ["work", "work/.cache", "other"] {
        fs::create_dir(place.path(folder)).expect("made");
    }
    let raster = repository("tests/data/glencoe_128.tif");
    for copy in ["work/dem.tif", "work/.cache/dem.tif", "other/dem.tif"] {
        fs::copy(&raster, place.path(copy)).expect("copied");
    }
    let long = format!("{}.tif", "a".repeat(110));
    fs::copy(&raster, place.path("work").join(&long)).expect("copied");
    place.write("work/secret", "root:hash");
    place.write("work/secret.r16", "root:has");
    place.write("other/secret", "root:hash");
    symlink(place.path("other/secret"), place.path("work/link.r16")).expect("linked");
    symlink(place.path("other/dem.tif"), place.path("work/link.tif")).expect("linked");
    fs::copy(repository("tests/data/glencoe_48x64_u16.png"), place.path("work/a.png")).expect("copied");
    symlink(place.path("other/secret.json"), place.path("work/a.png.json")).expect("linked");
    for (file, said) in [
        ("secret", "its format is not known; `dem` in `g.ron` reads it"),
        ("link.r16", "its format is not known"),
        ("/etc/hostname", "its format is not known"),
        ("/proc/self/environ", "its format is not known"),
        ("link.tif", "other/dem.tif` cannot be packed: `dem` in `g.ron` reads it, but it is not in the folder"),
        ("../other/dem.tif", "add `--outside`"),
        (".cache/dem.tif", "its name in the archive, `.cache/dem.tif`, has a part that begins with a dot"),
        (&long, "has a part longer than 100 bytes"),
    ] {
        place.write("work/g.ron", &importing(file));
        let ran = place.run(&["pack", "work/g.ron"]).ended(1, &["cannot be packed", said]);
        assert!(!ran.err.contains("hash") && !place.path("work/g.orograph").exists(), "{file}: {ran:?}");
    }
    for (secret, said) in [("{\"key\": \"hash\"}", "says nothing about a raster"), ("{\"range\": [0, 5]}", "--outside")]
    {
        place.write("other/secret.json", secret);
        place.write("work/g.ron", &importing("a.png"));
        let ran = place.run(&["pack", "work/g.ron"]).ended(1, &[said]);
        assert!(!ran.err.contains("hash"), "{ran:?}");
    }
    place.write("work/g.ron", &importing("link.tif"));
    place.run(&["pack", "work/g.ron", "--outside"]).done();
    place.run(&["unpack", "work/g.orograph", "-o", "new"]).done();
    assert!(fs::read(place.path("new/outside/dem.tif")).expect("there") == fs::read(raster).expect("there"));
    place.write("work/g.ron", &importing("dem.tif"));
    symlink(place.path("work/g.ron"), place.path("work/alias.ron")).expect("linked");
    place.run(&["pack", "work/alias.ron"]).done();
    place.run(&["unpack", "work/alias.orograph", "-o", "alias"]).done();
    assert_eq!(place.names("alias"), ["alias.ron", "dem.tif"]);
}

#[test]
fn lines_of_other_files_are_not_printed() {
    let place = Place::new();
    place.write("secret", "root:hash\nuser:hash\n");
    place.write("secret.ron", "root:hash\nuser:hash\n");
    symlink(place.path("secret"), place.path("link.ron")).expect("linked");
    for file in ["secret", "secret.ron", "link.ron", "/etc/passwd"] {
        place.write("g.ron", &using(file));
        for args in [&["check", "g.ron"][..], &["check", "--json", "g.ron"], &["run", "g.ron"], &["pack", "g.ron"]] {
            let ran = place.run(args).ended(1, &[]);
            let all = ran.out.clone() + &ran.err;
            assert!(all.contains("is not a graph file"), "{file}: {ran:?}");
            assert!(!all.contains("hash") && !all.contains("root:"), "{file}: {ran:?}");
        }
    }
}

/// 15 files that each use the next ten times.
#[test]
fn files_that_multiply_are_refused() {
    let place = Place::new();
    place.write("14.ron", "(nodes: { \"n0\": Constant }, outputs: { \"o\": \"n0\" })");
    for level in 0..14 {
        let one = |at| format!("\"n{at}\": Subgraph(file: \"{}.ron\"), ", level + 1);
        let nodes: String = (0..10).map(one).collect();
        place.write(&format!("{level}.ron"), &format!("(nodes: {{ {nodes} }}, outputs: {{ \"o\": \"n0\" }})"));
    }
    for command in ["check", "run"] {
        let start = now();
        let said = ["the graph has 211110 nodes", "10.ron` has 21110 nodes and is used 10 times", "9.ron:1:"];
        place.run(&[command, "0.ron"]).ended(1, &said);
        assert!(start.elapsed() < PATIENCE, "{command}: {:?}", start.elapsed());
    }
}

#[test]
fn pipes_devices_and_folders_are_refused_instead_of_waited_for() {
    let place = Place::new();
    for name in ["pipe", "pipe.ron", "pipe.orograph", "a.png.json"] {
        assert!(Command::new("mkfifo").arg(place.path(name)).status().expect("mkfifo").success());
    }
    fs::create_dir(place.path("folder.ron")).expect("made");
    fs::copy(repository("tests/data/glencoe_48x64_u16.png"), place.path("a.png")).expect("copied");
    let pipe = "a pipe, a device or a socket";
    for (graph, said) in [
        (importing("pipe"), pipe),
        (importing("/dev/zero"), pipe),
        (importing("folder.ron"), "that is a folder"),
        (using("pipe.ron"), pipe),
        (using("folder.ron"), "is a folder"),
        (using("/dev/zero"), "is not a graph file"),
    ] {
        place.write("g.ron", &graph);
        place.run(&["check", "g.ron"]).ended(1, &[said]);
        place.run(&["run", "g.ron"]).ended(1, &[said]);
    }
    place.write("g.ron", &importing("a.png"));
    place.run(&["run", "g.ron"]).ended(1, &["`a.png.json`", "not a regular file"]);
    for args in [
        &["check", "pipe.ron"][..],
        &["run", "pipe.ron"],
        &["watch", "pipe.ron"],
        &["fmt", "pipe.ron"],
        &["run", "pipe.orograph"],
        &["unpack", "pipe.orograph"],
        &["metrics", "pipe"],
        &["run", "folder.ron"],
    ] {
        let ran = place.run(args);
        assert!([1, 2].contains(&ran.code), "{args:?}: {ran:?}");
    }
}

#[test]
fn the_number_of_threads_is_limited() {
    let place = Place::new();
    place.write("g.ron", "(nodes: { \"a\": Constant }, outputs: { \"o\": \"a\" }, world: (cells: 16))");
    for wrong in ["100000", "0", "x"] {
        place.run(&["run", "g.ron", "--threads", wrong]).ended(1, &["from 1 to "]);
    }
}
