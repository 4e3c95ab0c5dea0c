//! How long it takes from a slider's event to the new land, in the session that the window shows:
//!
//! ```text
//! cargo run --release -p orograph --example latency
//! ```
//!
//! For each kind of node, at 512 and 1024 cells a side: milliseconds to the first, quick land, and to the land with all
//! cells; medians of five edits. What the node reads stays as it is, so it is not built again.

#![expect(clippy::disallowed_methods, reason = "it measures time")]

use std::{
    thread,
    time::{Duration, Instant},
};

use orograph::editor::Session;
use orograph_graph::Edit;

const GRAPH: &str = r#"(
    world: (size: "16 km", cells: 1024, seed: 3),
    nodes: {
        "base":    Perlin(wavelength: "6 km", octaves: 10, amplitude: "900 m"),
        "point":   Remap(value: "base", from: (-900, 900), to: (0, 2000), quantity: height),
        "stencil": Slope(height: "base"),
        "rivers":  StreamPower(height: "base", uplift: 0.001, duration: "500 kyr"),
    },
    outputs: { "height": "base" },
)"#;

/// A node, the value that is dragged, and what it is dragged to.
const DRAGS: [(&str, &str, [&str; 5]); 3] = [
    ("point", "to", ["(0, 2100)", "(0, 2200)", "(0, 2300)", "(0, 2400)", "(0, 2500)"]),
    ("stencil", "method", ["central", "horn", "central", "horn", "central"]),
    ("rivers", "duration", ["510000", "520000", "530000", "540000", "550000"]),
];

fn main() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("graph.ron");
    std::fs::write(&path, GRAPH).expect("written");
    println!("{:10} {:>6} {:>10} {:>10}", "node", "cells", "quick ms", "full ms");
    for cells in [512, 1024] {
        for (node, name, texts) in DRAGS {
            let mut session = Session::open(Some(path.clone()), orograph_nodes::registry(), || {}).expect("it opens");
            session.set_cells(cells);
            session.select_only(node);
            let port = session.shown().expect("it has an output");
            wait(&mut session, &port, cells);
            let mut times = texts.map(|text| {
                let start = Instant::now();
                let (node, name) = (node.to_owned(), name.to_owned());
                session.gesture(&Edit::SetText { node, name, text: text.to_owned() });
                let quick = wait(&mut session, &port, 0) - start;
                let full = wait(&mut session, &port, cells) - start;
                [quick, full].map(|time| time.as_secs_f64() * 1e3)
            });
            let mut median = |of: usize| {
                times.sort_by(|a, b| a[of].total_cmp(&b[of]));
                times[2][of]
            };
            println!("{node:10} {cells:>6} {:>10.1} {:>10.1}", median(0), median(1));
        }
    }
}

/// Waits for the present land with at least that many cells.
fn wait(session: &mut Session, port: &str, cells: u32) -> Instant {
    loop {
        session.poll();
        let built = session.built(port);
        if built.is_some_and(|built| built.revision == session.revision() && built.step == 0 && built.cells >= cells) {
            return Instant::now();
        }
        thread::sleep(Duration::from_micros(200));
    }
}
