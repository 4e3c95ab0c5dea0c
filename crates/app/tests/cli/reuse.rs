//! Tests of reuse: exposed parameters, subgraphs, sweeps and archives.

use std::fs;

use super::{Place, json_lines};

/// A graph file for use in others.
const STEP: &str = r#"// A plain with a step.
(
    world: (size: (3200, 1600), cells: (32, 16), seed: 7),
    inputs: { "land": "sum.a" },
    parameters: { "rise": (drives: "step.value", doc: "How high the step is.", range: (0, 2000)) },
    nodes: { "base": Constant(value: 100), "step": Constant(value: 10), "sum": Combine(a: "base", b: "step", mode: add) },
    outputs: { "height": "sum" },
)
"#;

/// A graph that uses it twice, the second time on the first.
const STAIRS: &str = r#"(
    world: (size: (3200, 1600), cells: (32, 16), seed: 7),
    parameters: { "top": "two.rise" },
    nodes: {
        "one": Subgraph(file: "parts/step.ron"),
        "two": Subgraph(file: "parts/step.ron", land: "one", rise: 500),
    },
    outputs: { "height": "two" },
)
"#;

fn stairs() -> Place {
    let place = Place::new();
    fs::create_dir(place.path("parts")).expect("made");
    place.write("parts/step.ron", STEP);
    place.write("g.ron", STAIRS);
    place
}

/// The single value of a constant output in a folder.
#[track_caller]
fn level(place: &Place, folder: &str) -> f32 {
    let land = orograph_nodes::raster::read(&place.path(folder).join("height.exr")).expect("readable");
    assert!(land.samples.iter().all(|v| *v == land.samples[0]));
    land.samples[0] as f32
}

#[test]
fn named_parameters_are_set_and_described() {
    let place = stairs();
    place.run(&["run", "parts/step.ron", "--set", "rise=200", "-q"]).done();
    assert_eq!(level(&place, "out"), 300.0);
    place.run(&["run", "parts/step.ron", "--set", "rise=3000"]).ended(1, &["its range is 0 to 2000"]);
    place.run(&["run", "parts/step.ron", "--set", "rize=3"]).ended(1, &["did you mean `rise`?"]);

    let page = place.run(&["check", "--describe", "parts/step.ron"]).done().out;
    for text in ["A plain with a step.", "3.2 km x 1.6 km in 32 x 16 cells, seed 7", "land", "How high", "default 10"] {
        assert!(page.contains(text), "`{text}` is not in:\n{page}");
    }
    let lines = json_lines(&place.run(&["check", "--describe", "--json", "g.ron"]).done().out);
    assert_eq!((&lines[0]["event"], &lines[1]["event"]), (&"checked".into(), &"described".into()));
    assert_eq!(
        (&lines[1]["parameters"][0]["name"], &lines[1]["parameters"][0]["default"]),
        (&"top".into(), &500.0.into())
    );
    assert_eq!(lines[1]["uses"].as_array().map(Vec::len), Some(1));
}

#[test]
fn a_graph_file_is_built_inside_another() {
    let place = stairs();
    let ran = place.run(&["run", "g.ron", "--timings"]).done();
    assert_eq!(level(&place, "out"), 610.0);
    assert!(ran.out.contains("two/sum") && ran.err.contains("one/sum (Combine): computed"), "{ran:?}");
    place.run(&["run", "g.ron", "--set", "top=1000", "-q"]).done();
    assert_eq!(level(&place, "out"), 1110.0);
    place.run(&["run", "g.ron", "--set", "one.rise=50", "-q"]).done();
    assert_eq!(level(&place, "out"), 650.0);
    assert!(place.run(&["nodes"]).done().out.contains("Subgraph"));
    place.run(&["render", "g.ron", "-o", "p.png", "-q"]).done();
}

#[test]
fn a_change_of_the_inner_file_is_noticed_by_the_cache() {
    let place = stairs();
    let computed = || {
        let lines = json_lines(&place.run(&["run", "g.ron", "--json", "--cache", "kept"]).done().out);
        let nodes = lines.into_iter().filter(|line| line["event"] == "node" && line["origin"] == "computed");
        let mut names: Vec<String> = nodes.map(|line| line["node"].as_str().unwrap_or_default().to_owned()).collect();
        names.sort();
        names
    };
    assert_eq!(computed(), ["one/base", "one/step", "one/sum", "two/step", "two/sum"]);
    assert_eq!(computed(), [""; 0]);
    place.write("parts/step.ron", &STEP.replace("value: 100", "value: 200"));
    assert_eq!(computed(), ["one/base", "one/sum", "two/sum"]);
    assert_eq!(level(&place, "out"), 710.0);
}

#[test]
fn errors_of_an_inner_file_are_shown_with_its_name() {
    let place = stairs();
    place.write("parts/step.ron", &STEP.replace("Constant(value: 10)", "Constent(value: 10)"));
    place
        .run(&["run", "g.ron"])
        .ended(1, &["parts/step.ron:6:52", "did you mean `Constant`?", "in parts/step.ron", "in g.ron"]);
    let lines = json_lines(&place.run(&["check", "--json", "g.ron"]).ended(1, &[]).out);
    assert_eq!((&lines[0]["file"], &lines[0]["line"]), (&"parts/step.ron".into(), &6.into()));
    assert_eq!(lines.iter().filter(|line| line["file"] == "g.ron" && line["event"] == "problem").count(), 2);

    place.write("parts/step.ron", &STEP.replace("Constant(value: 10)", r#"Subgraph(file: "../g.ron")"#));
    place.run(&["check", "g.ron"]).ended(1, &["the file uses itself: g.ron → parts/step.ron → parts/../g.ron"]);
    fs::remove_file(place.path("parts/step.ron")).expect("removed");
    place.run(&["run", "g.ron"]).ended(1, &["there is no file `parts/step.ron`"]);
}

#[test]
fn check_reports_missing_files() {
    let place = Place::new();
    place.write("g.ron", r#"(nodes: { "a": Import(file: "dem.tif") }, outputs: { "o": "a" })"#);
    place.run(&["check", "g.ron"]).ended(1, &["`a.file` names `dem.tif`, but there is no such file", "g.ron:1:29"]);
}

#[test]
fn a_sweep_builds_a_terrain_for_each_value() {
    let place = Place::new();
    place.write(
        "g.ron",
        r#"(
            world: (size: (3200, 1600), cells: (32, 16)),
            parameters: { "high": "hills.amplitude" },
            nodes: { "hills": Perlin(wavelength: "1 km"), "base": Constant(value: 10), "sum": Combine(a: "base", b: "hills", mode: add) },
            outputs: { "height": "sum" },
        )"#,
    );
    let ran = place.run(&["run", "g.ron", "--sweep", "seed=1..20", "-o", "out/{seed}", "--no-preview"]).done();
    assert!(ran.err.contains("20 of 20: seed=20"), "{}", ran.err);
    let lands: Vec<Vec<u8>> =
        (1..=20).map(|seed| fs::read(place.path(&format!("out/{seed}/height.exr"))).expect("written")).collect();
    for (at, land) in lands.iter().enumerate() {
        assert!(!lands[..at].contains(land), "seed {} has the land of another", at + 1);
    }
    place.run(&["run", "g.ron", "--seed", "7", "-o", "alone", "--no-preview", "-q"]).done();
    assert!(fs::read(place.path("alone/height.exr")).expect("written") == lands[6], "as when built by itself");

    // two sweeps build every combination; nodes that no value changes are computed once
    let args = ["run", "g.ron", "--json", "--sweep", "high=100 m,0.2 km", "--sweep", "base.value=1..3/2"];
    let ran = place.run(&[&args[..], &["-o", "p/{high}_{base.value}"]].concat()).done();
    assert_eq!(place.names("p"), ["0.2_km_1", "0.2_km_3", "100_m_1", "100_m_3"]);
    let lines = json_lines(&ran.out);
    let hills = |origin: &str| {
        let of =
            |line: &&serde_json::Value| line["node"] == "hills" && line["event"] == "node" && line["origin"] == origin;
        lines.iter().filter(of).count()
    };
    assert_eq!((hills("computed"), hills("memory")), (2, 2));
    let second = lines.iter().filter(|line| line["event"] == "sweep").nth(1).expect("four of them");
    assert_eq!((&second["index"], &second["of"], &second["values"]["base.value"]), (&2.into(), &4.into(), &"3".into()));
}

#[test]
fn sweeps_that_would_overwrite_files_are_refused() {
    let place = stairs();
    let refused = |args: &[&str], said: &[&str]| {
        place.run(&[&["run", "g.ron"], args].concat()).ended(1, said);
        assert!(!place.path("out").exists(), "{args:?}");
    };
    refused(&["--sweep", "seed=1..3"], &["the 3 terrains of `seed` would overwrite each other", "-o \"out/{seed}\""]);
    refused(&["--sweep", "seed=1..3", "-o", "out/{seeds}/{seed}"], &["`{seeds}`", "the sweeps are `{seed}`"]);
    refused(&["--sweep", "top=1 km,2 km", "-o", "out/{top}"], &["--sweep top=1 km"]);
    refused(&["--sweep", "top=1,2 km", "-o", "out/{top}"], &["`1` without a unit and `2 km` with one"]);
    refused(&["--sweep", "top=1,1", "-o", "out/{top}"], &["would both be written to `out/1`"]);
    refused(&["--sweep", "tip=1,2", "-o", "out/{tip}"], &["did you mean `top`?"]);
    refused(&["--sweep", "top=1..9000", "-o", "out/{top}"], &["but must be a plain number from 0 to 2000"]);
    refused(&["--sweep", "seed=1,x", "-o", "out/{seed}"], &["a seed is a whole number"]);
    refused(&["-o", "out/{seed}"], &["named by `seed`", "add `--sweep seed=VALUES`"]);
    refused(&["--sweep", "seed=1,2", "--seed", "3", "-o", "out/{seed}"], &["both set and swept"]);
}

#[test]
fn an_archive_builds_like_its_graph() {
    let place = stairs();
    fs::create_dir(place.path("work")).expect("made");
    fs::rename(place.path("parts"), place.path("work/parts")).expect("moved");
    fs::copy(super::repository("tests/data/glencoe_48x64_u16.png"), place.path("dem.png")).expect("copied");
    fs::copy(super::repository("tests/data/glencoe_48x64_u16.png.json"), place.path("dem.png.json")).expect("copied");
    place.write("outer.ron", &STEP.replace("value: 10)", "value: 20)"));
    let graph = r#"// kept
(
    world: (size: (3200, 1600), cells: (32, 16), seed: 7),
    nodes: {
        "dem": Import(version: 2, file: "../dem.png"), // outside
        "one": Subgraph(file: "parts/step.ron", land: "dem"),
        "two": Subgraph(file: "../outer.ron", land: "one", rise: 30),
    },
    outputs: { "height": "two" },
)
"#;
    place.write("work/g.ron", graph);
    place.run(&["run", "work/g.ron", "-o", "plain", "-q"]).done();
    place.run(&["pack", "work/g.ron"]).ended(1, &["`dem` in `g.ron` reads it", "not in the folder", "add `--outside`"]);
    let ran = place.run(&["pack", "work/g.ron", "--outside"]).done();
    assert!(ran.out.contains("`outside/outer.ron` in it") && ran.out.contains("5 files"), "{}", ran.out);
    place.run(&["run", "work/g.orograph", "-o", "packed", "-q"]).done();
    for name in place.names("plain").iter().filter(|name| !name.ends_with(".json")) {
        let bytes = |folder: &str| fs::read(place.path(folder).join(name)).expect("written");
        assert!(bytes("plain") == bytes("packed"), "{name}");
    }
    place.run(&["check", "work/g.orograph"]).done();
    place.run(&["unpack", "work/g.orograph", "-o", "far/away"]).done();
    assert_eq!(place.names("far/away"), ["g.ron", "outside", "parts"]);
    assert_eq!(place.names("far/away/outside"), ["dem.png", "dem.png.json", "outer.ron"]);
    let expected = graph.replace("../dem.png", "outside/dem.png").replace("../outer.ron", "outside/outer.ron");
    assert_eq!(place.read("far/away/g.ron"), expected, "only the names of files are changed");
    assert_eq!(place.run(&["diff", "work/g.ron", "work/g.orograph", "--exit-code"]).code, 1);

    // equal files give equal bytes, wherever and whenever they are packed
    place.run(&["pack", "far/away/g.ron", "-o", "again.orograph"]).done();
    let again = fs::read(place.path("again.orograph")).expect("written");
    assert!(again == fs::read(place.path("work/g.orograph")).expect("written"));

    place.run(&["unpack", "again.orograph", "-o", "far/away"]).ended(1, &["is not empty"]);
    place.run(&["unpack", "again.orograph"]).done();
    assert!(place.path("again/g.ron").is_file());
    place.run(&["pack", "work/g.ron", "-o", "g.zip"]).ended(1, &["does not end with .orograph"]);
    place.write("bad.orograph", "not an archive");
    place.run(&["run", "bad.orograph"]).ended(1, &["cannot be unpacked"]);
    place.run(&["pack", "none.ron"]).ended(1, &["there is no file"]);
}

#[test]
fn errors_inside_an_archive_are_shown_with_its_name() {
    let place = stairs();
    place.run(&["pack", "g.ron"]).done();
    let ran = place.run(&["run", "g.orograph", "--set", "tap=1"]).ended(1, &["did you mean `top`?"]);
    assert!(!ran.err.contains("/tmp"), "{}", ran.err);
}
