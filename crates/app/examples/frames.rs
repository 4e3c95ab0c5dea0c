//! The editor's own work in a frame of a large graph with a large preview, and the latency of handles:
//!
//! ```text
//! cargo run --release -p orograph --example frames
//! ```
//!
//! A graph of 1000 nodes, all in view, with a map of 4096 x 4096 cells in the viewport. Each line is the processor time
//! of the window's thread for a frame, whatever else the machine does: the median and the longest of 120 frames. There is
//! no graphics device, so drawing is left out.
//!
//! Then the milliseconds from an event until its first preview is drawn, and until its preview of 512 cells is drawn:
//! for a handle that is dragged on the map, and for values of two nodes in a chain of 100, of which the last is shown:
//! the one behind the slowest node, and the last. Medians of five events.

#![expect(clippy::disallowed_methods, reason = "it measures time")]

mod measure;

use std::{path::Path, time::Instant};

use egui::{Event, Key, Modifiers, MouseWheelUnit, PointerButton, Pos2, TouchPhase, vec2};
use egui_kittest::{Harness, kittest::Queryable as _};
use measure::{settle, spent};
use orograph::editor::App;
use orograph_graph::Edit;

/// Frames of a line, and edits of a latency.
const FRAMES: usize = 120;
const EDITS: usize = 5;

fn main() {
    let folder = tempfile::tempdir().expect("a folder");
    println!("| 1000 nodes, 4096 cells | ms a frame | longest |");
    println!("| --- | ---: | ---: |");
    frames(folder.path());
    println!("\n| 512 cells | first preview, ms | full preview | kernels |");
    println!("| --- | ---: | ---: | ---: |");
    handle(folder.path());
    behind_the_slowest(folder.path());
}

/// 1000 nodes in rows; the viewport shows the first of them.
fn large() -> String {
    let registry = orograph_nodes::registry();
    let terrace = registry.get("Terrace").expect("a node");
    let node = |number: usize| match number {
        0 => "\"n0\": Crater(version: 2, pattern: one, centre: (8000, 8000), diameter: 5000)".to_owned(),
        _ => format!("\"n{number}\": {}", terrace.written(&format!("height: \"n{}\"", (number - 1) / 2))),
    };
    let nodes: Vec<String> = (0..1000).map(node).collect();
    let place = |number: usize| format!("\"n{number}\": ({}, {})", number % 40 * 240, number / 40 * 240);
    let places: Vec<String> = (0..1000).map(place).collect();
    let (nodes, places) = (nodes.join(", "), places.join(", "));
    format!(
        "(world: (size: \"16 km\", cells: 4096), nodes: {{ {nodes} }}, layout: {{ {places} }}, outputs: {{ \"o\": \"n0\" }})"
    )
}

/// A line of the table: what is done before each frame.
fn line(window: &mut Harness<'_, App>, what: &str, mut before: impl FnMut(&mut Harness<'_, App>, usize)) {
    let mut times: Vec<f64> = (0..FRAMES)
        .map(|frame| {
            before(window, frame);
            let start = spent(false);
            window.step();
            spent(false) - start
        })
        .collect();
    times.sort_by(f64::total_cmp);
    println!("| {what} | {:.1} | {:.1} |", times[FRAMES / 2], times[FRAMES - 1]);
}

fn button(window: &mut Harness<'_, App>, pos: Pos2, pressed: bool) {
    let (button, modifiers) = (PointerButton::Primary, Modifiers::NONE);
    window.event(Event::PointerButton { pos, button, pressed, modifiers });
    window.step();
}

fn wheel(window: &Harness<'_, App>, steps: f32) {
    let (unit, phase) = (MouseWheelUnit::Line, TouchPhase::Move);
    window.event(Event::MouseWheel { unit, delta: vec2(0.0, steps), phase, modifiers: Modifiers::NONE });
}

fn frames(folder: &Path) {
    let mut window = measure::window(folder, &large());
    let session = window.state_mut().session_mut();
    session.set_cells(4096);
    session.select_only("n0");
    settle(&mut window);
    let graph = window.get_by_label("graph").rect();
    let map = egui::pos2(graph.center().x, 0.4 * graph.top());
    window.hover_at(graph.center());
    window.run_steps(2);
    window.key_press(Key::Home);
    window.run_steps(30);
    let around = |centre: Pos2, frame: usize| centre + vec2((frame % 40) as f32, (frame % 30) as f32);
    line(&mut window, "at rest", |_, _| {});
    line(&mut window, "pointer over the graph", |window, frame| window.hover_at(around(graph.center(), frame)));
    line(&mut window, "pointer over the map", |window, frame| window.hover_at(around(map, frame)));
    line(&mut window, "wheel over the map", |window, frame| wheel(window, if frame % 20 < 10 { 0.4 } else { -0.4 }));
    button(&mut window, map + vec2(150.0, 0.0), true);
    line(&mut window, "map dragged", |window, frame| {
        window.hover_at(around(map + vec2(150.0, 0.0), frame));
    });
    button(&mut window, map + vec2(150.0, 0.0), false);
    settle(&mut window);
    window.hover_at(graph.center());
    window.run_steps(2);
    line(&mut window, "wheel over the graph", |window, frame| {
        wheel(window, if frame < FRAMES / 2 { 0.2 } else { -0.2 })
    });
    window.key_press(Key::Home);
    window.run_steps(30);
    line(&mut window, "node moved", |window, frame| {
        let at = Some([9600.0 + 3.0 * frame as f64, 0.0]);
        window.state_mut().session_mut().gesture(&Edit::SetLayout { node: "n39".to_owned(), at });
    });
    window.state_mut().session_mut().end_gesture();
    line(&mut window, "value of the shown terrain dragged", |window, frame| {
        let text = format!("{}", 5000 + 10 * frame);
        let edit = Edit::SetText { node: "n0".to_owned(), name: "diameter".to_owned(), text };
        window.state_mut().session_mut().gesture(&edit);
    });
    window.state_mut().session_mut().end_gesture();
    settle(&mut window);
    let centre = window.get_by_label_contains("point 1 of centre").rect().center();
    window.hover_at(centre);
    window.step();
    button(&mut window, centre, true);
    line(&mut window, "handle dragged", |window, frame| window.hover_at(centre + vec2((frame % 40) as f32, 0.0)));
    button(&mut window, centre, false);
}

/// Milliseconds until the newest state of the document is drawn, with any and with all cells.
fn drawn(window: &mut Harness<'_, App>, start: Instant) -> [f64; 2] {
    let revision = window.state().session().revision();
    measure::passed(window, start, |app| [1, 512].map(|cells| measure::seen(app, revision) >= cells))
}

fn row(what: &str, times: &[[f64; 2]], kernels: &str) {
    let [first, full] = measure::medians(times);
    println!("| {what} | {first:.0} | {full:.0} | {kernels} |");
}

/// A handle that is dragged on the map.
fn handle(folder: &Path) {
    let graph = r#"(world: (size: "16 km", cells: 512), nodes: {
        "base": Perlin(wavelength: "6 km", octaves: 10, amplitude: "900 m"),
        "hole": Crater(version: 2, height: "base", pattern: one, centre: (8000, 8000), diameter: 5000) },
        outputs: { "height": "hole" })"#;
    let mut window = measure::window(folder, graph);
    let session = window.state_mut().session_mut();
    session.set_cells(512);
    session.select_only("hole");
    settle(&mut window);
    let mut at = window.get_by_label_contains("point 1 of centre").rect().center();
    window.hover_at(at);
    window.step();
    button(&mut window, at, true);
    let times = (0..EDITS).map(|_| {
        at += vec2(9.0, 5.0);
        let start = Instant::now();
        window.hover_at(at);
        window.step();
        let times = drawn(&mut window, start);
        settle(&mut window);
        times
    });
    let times: Vec<[f64; 2]> = times.collect();
    button(&mut window, at, false);
    row("handle dragged", &times, "");
}

/// A value of the node behind the slowest of 100 nodes; the last of them is shown.
fn behind_the_slowest(folder: &Path) {
    let head = [
        "Perlin(wavelength: \"6 km\", octaves: 10, amplitude: \"900 m\")",
        "StreamPower(height: \"n0\", uplift: 0.001, duration: \"500 kyr\")",
    ];
    let graph = measure::chain(&head, 100, "n99");
    for (edited, what) in [(2, "98 nodes behind the edit"), (99, "the last node")] {
        let mut window = measure::window(folder, &graph);
        let session = window.state_mut().session_mut();
        session.set_cells(512);
        session.select_only("n99");
        settle(&mut window);
        let mut times = Vec::new();
        for edit in 0..EDITS {
            let text = format!("{}", 100 + 3 * edit);
            let edit = Edit::SetText { node: format!("n{edited}"), name: "step".to_owned(), text };
            let start = Instant::now();
            assert!(window.state_mut().session_mut().gesture(&edit));
            times.push(drawn(&mut window, start));
            settle(&mut window);
        }
        let session = window.state().session();
        let kernels = (edited..100).filter_map(|number| session.node(&format!("n{number}")).time);
        let kernels: f64 = kernels.map(|(time, _)| time.as_secs_f64() * 1e3).sum();
        row(what, &times, &format!("{kernels:.0}"));
    }
}
