//! The graph files that come with the program: each is in canonical form, has no problems, builds, and builds to the same
//! bytes on one and on two threads.

use std::{num::NonZero, path::PathBuf};

use orograph_graph::{Cancel, Document, Evaluator, EvaluatorOptions, Port, Value, Window, World, format_source};
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

fn build(document: &Document, threads: usize) -> Vec<Value> {
    // 128 cells on the longer side: the same land, quickly
    let world = document.world();
    let longest = f64::from(world.cells[0].max(world.cells[1]));
    let cells = world.cells.map(|n| (128.0 * f64::from(n) / longest).round() as u32);
    let window = Window::whole(World { cells, ..world });
    let expanded = document.expand();
    let requests: Vec<(Port, Window)> = expanded.outputs.iter().map(|output| (output.port, window)).collect();
    let evaluator = Evaluator::new(EvaluatorOptions { threads: NonZero::new(threads), ..EvaluatorOptions::default() })
        .expect("an evaluator");
    evaluator
        .evaluate(&expanded.graph, &folder(), &requests, &Cancel::default(), &|_| {})
        .unwrap_or_else(|error| panic!("{error}"))
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
        let one = build(&document, 1);
        assert_eq!(one.len(), document.outputs().len());
        assert!(one == build(&document, 2), "{}: other bytes on two threads", path.display());
    }
}
