//! Reuse: named parameters, graph files in others, sweeps and archives.

use std::fs;

use super::{Place, json_lines};

/// A file for others to use.
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

/// The one value of a plain that was built into a folder.
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
    assert_eq!(
        (&lines[0]["parameters"][0]["name"], &lines[0]["parameters"][0]["default"]),
        (&"top".into(), &500.0.into())
    );
    assert_eq!(lines[0]["uses"].as_array().map(Vec::len), Some(1));
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
fn faults_of_an_inner_file_are_shown_with_its_name() {
    let place = stairs();
    place.write("parts/step.ron", &STEP.replace("Constant(value: 10)", "Constent(value: 10)"));
    place
        .run(&["run", "g.ron"])
        .ended(1, &["parts/step.ron:6:52", "did you mean `Constant`?", "in parts/step.ron", "in g.ron"]);
    let lines = json_lines(&place.run(&["check", "--json", "g.ron"]).ended(1, &[]).out);
    assert_eq!((&lines[0]["file"], &lines[0]["line"]), (&"parts/step.ron".into(), &6.into()));
    assert_eq!(lines.iter().filter(|line| line["file"] == "g.ron").count(), 2);

    place.write("parts/step.ron", &STEP.replace("Constant(value: 10)", r#"Subgraph(file: "../g.ron")"#));
    place.run(&["check", "g.ron"]).ended(1, &["the file uses itself: g.ron → parts/step.ron → parts/../g.ron"]);
    fs::remove_file(place.path("parts/step.ron")).expect("removed");
    place.run(&["run", "g.ron"]).ended(1, &["there is no file `parts/step.ron`"]);
}

#[test]
fn files_that_are_not_there_are_told_by_check() {
    let place = Place::new();
    place.write("g.ron", r#"(nodes: { "a": Import(file: "dem.tif") }, outputs: { "o": "a" })"#);
    place.run(&["check", "g.ron"]).ended(1, &["`a.file` names `dem.tif`, but there is no such file", "g.ron:1:29"]);
}
