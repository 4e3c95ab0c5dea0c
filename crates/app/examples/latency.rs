//! The latency of an edit:
//!
//! ```text
//! cargo run --release -p orograph --example latency
//! ```
//!
//! First, for each kind of node, at 512 and 1024 cells per side: milliseconds from a slider's event until the first,
//! quick preview is built, until a finished result is first drawn as a map, until the preview with all cells is built,
//! and until that is drawn; and the processor time of all this. Medians of five edits in a window that draws sixty
//! times a second; the inputs of the node do not change, so they are not built again. Then the same for the last of
//! 100 nodes in a row. Then the time from the start of an export of the shown terrain until its first file has bytes,
//! and the time from opening a graph that was built before until its terrain is complete. There is neither a display
//! nor a graphics device, so their work is left out.

#![expect(clippy::disallowed_methods, reason = "it measures time")]

mod measure;

use std::{
    fs,
    path::Path,
    sync::Arc,
    thread,
    time::{Duration, Instant},
};

use measure::{settle, spent};
use orograph::{
    build::{
        Builder,
        request::{Changes, Request},
    },
    editor::Session,
    export::outputs::OutputOptions,
    report::progress::Quiet,
};
use orograph_graph::{Cancel, Edit, Store, StoreFolder, Trust};

const GRAPH: &str = r#"(
    world: (size: "16 km", cells: 1024, seed: 3),
    nodes: {
        "base":    Perlin(wavelength: "6 km", octaves: 10, amplitude: "900 m"),
        "point":   Terrace(height: "base"),
        "stencil": Slope(height: "base"),
        "rivers":  StreamPower(height: "base", uplift: 0.001, duration: "500 kyr"),
    },
    outputs: { "height": "base" },
)"#;

/// A node, the dragged value, the first value of the drag and its step.
type Drag = (&'static str, &'static str, [f64; 2]);
const DRAGS: [Drag; 2] = [("point", "step", [100.0, 3.0]), ("stencil", "from", [30.0, 0.5])];

/// The rivers of a preset, in its world of 60 km with `inland` sides.
const ALPS: &str = include_str!("../../../graphs/alps.ron");
const RIVERS: Drag = ("rivers", "duration", [1_380_000.0, 1000.0]);

/// Edits of each drag.
const EDITS: usize = 5;

fn main() {
    let folder = tempfile::tempdir().expect("a folder");
    println!("| node | cells | quick | drawn | all cells | drawn | processor |");
    println!("| --- | ---: | ---: | ---: | ---: | ---: | ---: |");
    for cells in [512, 1024] {
        for drag in DRAGS {
            latency(folder.path(), GRAPH, drag, cells, drag.0);
        }
        let alps = ALPS.replace("cells: (1000, 1000)", "cells: (1024, 1024)");
        assert_ne!(alps, ALPS, "more cells than the preset has");
        latency(folder.path(), &alps, RIVERS, cells, "rivers of alps.ron");
    }
    let chain = measure::chain(&["Perlin(wavelength: \"6 km\", amplitude: \"900 m\")"], 100, "n0");
    latency(folder.path(), &chain, ("n99", "step", [100.0, 3.0]), 512, "last of 100");
    println!("\n| 1024 cells | ms |\n| --- | ---: |");
    export_and_reopen(folder.path());
}

/// A row of the table: medians.
fn latency(folder: &Path, graph: &str, (node, name, [first, step]): Drag, cells: u32, title: &str) {
    let mut window = measure::window(folder, graph);
    let session = window.state_mut().session_mut();
    session.set_cells(cells);
    session.select_only(node);
    let port = session.shown().expect("it has an output");
    settle(&mut window);
    let times = (0..EDITS).map(|edit| {
        let text = format!("{}", first + step * (edit + 1) as f64);
        let (start, before) = (Instant::now(), spent(true));
        let edit = Edit::SetText { node: node.to_owned(), name: name.to_owned(), text };
        assert!(window.state_mut().session_mut().gesture(&edit));
        let revision = window.state().session().revision();
        let [quick, drawn, all, drawn_all] = measure::passed(&mut window, start, |app| {
            let built = app.session().built(&port).filter(|built| built.revision == revision);
            // a coarser level of a node that is still running is a preview, too
            let all = built.is_some_and(|built| built.step == 0 && built.cells >= cells);
            let seen = measure::seen(app, revision);
            [built.is_some(), seen > 0, all, all && seen >= cells]
        });
        [quick, drawn, all, drawn_all, spent(true) - before]
    });
    let times: Vec<[f64; 5]> = times.collect();
    let medians = measure::medians(&times).map(|median| format!("{median:.0}"));
    println!("| {title} | {cells} | {} |", medians.join(" | "));
}

/// Exports the shown terrain, closes the window and opens it again with the same store.
fn export_and_reopen(folder: &Path) {
    let (path, out) = (folder.join("graph.ron"), folder.join("out"));
    fs::write(&path, GRAPH.replace("\"height\": \"base\"", "\"height\": \"rivers\"")).expect("written");
    let place = StoreFolder {
        folder: folder.join("store"),
        budget: 1 << 30,
        worth: Duration::from_secs(3600),
        trust: Trust::Own,
    };
    let store = || Arc::new(Store::new(1 << 28, Some(place.clone())));
    let open = || {
        let mut session =
            Session::open(Some(path.clone()), orograph_nodes::registry(), store(), || {}).expect("a graph");
        session.set_cells(1024);
        session
    };
    let mut first = open();
    wait(|| {
        first.poll();
        !first.is_busy()
    });
    fs::create_dir(&out).expect("a folder");
    let request = Request::of_document(first.document().clone(), &Changes::default()).expect("a request");
    let builder = Builder::sharing(Arc::clone(first.evaluator()));
    let start = Instant::now();
    let begun = thread::scope(|scope| {
        scope.spawn(|| {
            builder.build(&request, &out, &OutputOptions::default(), &Cancel::default(), &Quiet).expect("built")
        });
        wait(|| has_bytes(&out));
        start.elapsed()
    });
    println!("| export of shown terrain begins to write | {:.1} |", begun.as_secs_f64() * 1e3);
    drop((builder, first));

    let start = Instant::now();
    let mut second = open();
    wait(|| {
        second.poll();
        second.built("rivers.height").is_some_and(|built| built.cells == 1024)
    });
    println!("| reopened at all cells | {:.1} |", start.elapsed().as_secs_f64() * 1e3);
}

/// Polls every fifth of a millisecond until a condition is true.
fn wait(mut is: impl FnMut() -> bool) {
    while !is() {
        thread::sleep(Duration::from_micros(200));
    }
}

/// Returns true if a file below the folder has bytes.
fn has_bytes(folder: &Path) -> bool {
    fs::read_dir(folder).into_iter().flatten().flatten().any(|entry| match entry.metadata() {
        Ok(found) if found.is_dir() => has_bytes(&entry.path()),
        Ok(found) => found.len() > 0,
        Err(_) => false,
    })
}
