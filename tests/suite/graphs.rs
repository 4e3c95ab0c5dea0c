//! The graph files that come with the program: each is in canonical form, has no problems, builds, and builds to the same
//! bytes on one and on two threads.

use std::{num::NonZero, path::PathBuf};

use orograph_graph::{Document, Evaluator, EvaluatorOptions, Port, Value, Window, World, format_source};
use orograph_nodes::registry;

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../graphs")
}

fn files() -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder()).expect("the folder of graphs");
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.expect("an entry").path()).collect();
    files.retain(|path| path.extension().is_some_and(|extension| extension == "ron"));
    files.sort();
    assert!(files.len() >= 5, "hello, ridges, alps, carve_dem and rivers_dem at least");
    files
}

/// All outputs, with that many cells on the world's longer side.
fn build(document: &Document, longer: f64, threads: usize) -> Vec<Value> {
    let world = document.world();
    let longest = f64::from(world.cells[0].max(world.cells[1]));
    let cells = world.cells.map(|n| (longer * f64::from(n) / longest).round() as u32);
    let window = Window::whole(World { cells, ..world });
    let expanded = document.expand();
    let ports: Vec<Port> = expanded.outputs.iter().map(|output| output.port).collect();
    let evaluator = Evaluator::new(EvaluatorOptions { threads: NonZero::new(threads), ..EvaluatorOptions::default() })
        .expect("an evaluator");
    evaluator.values(&expanded.graph, &folder(), &ports, window).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn every_graph_is_sound_and_in_canonical_form() {
    for path in files() {
        let source = std::fs::read_to_string(&path).expect("a graph file");
        let document = Document::parse_at(source.clone(), &path, &registry());
        let problems: Vec<&str> = document.problems().iter().map(|problem| problem.message.as_str()).collect();
        assert!(problems.is_empty(), "{}: {problems:?}", path.display());
        assert_eq!(document.source(), source, "{}: a load and a save change nothing", path.display());
        let canonical = format_source(&source).expect("no syntax errors");
        assert_eq!(canonical, source, "{}: run `orograph fmt` on it", path.display());
    }
}

#[test]
fn every_graph_builds_to_the_same_bytes_on_one_and_two_threads() {
    for path in files() {
        let document = Document::load(&path, &registry()).expect("a graph file");
        // the same land, quickly
        let one = build(&document, 128.0, 1);
        assert_eq!(one.len(), document.outputs().len());
        assert!(one == build(&document, 128.0, 2), "{}: other bytes on two threads", path.display());
    }
}

/// What the Alps measure on cells of 100 to 150 m: summits, local relief in windows of 2.5 km, slopes.
#[test]
fn the_alps_are_alpine() {
    let document = Document::load(folder().join("alps.ron"), &registry()).expect("a graph file");
    let values = build(&document, 500.0, 2);
    let report = values.iter().find_map(Value::as_report).expect("an output of measures");
    for (name, range) in
        [("elevation_max", 3300.0..4400.0), ("local_relief_mean", 960.0..1200.0), ("slope_mean", 28.0..32.0)]
    {
        let value = report.get(name).expect("a measure");
        assert!(range.contains(&value), "{name}: {value} is not in {range:?}");
    }
}
