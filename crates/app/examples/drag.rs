//! The cost of a drag in a large graph, by part:
//!
//! ```text
//! cargo run --release -p orograph --example drag
//! ```
//!
//! Chains of 1000 and of 10,000 nodes are opened and edited without a display. Each line is the median processor time
//! of the window's thread for one event, whatever else the machine does: the edit itself (text, parse, check, journal
//! entry), the session's frame after it (expansion and the order for the worker) and, with 1000 nodes, the frame of the
//! window (canvas model, inspector and painting; what a graphics device would do is left out).

use std::{fs, path::Path, thread, time::Duration};

use egui_kittest::Harness;
use orograph::editor::{App, Session};
use orograph_graph::{Document, Edit};

/// Events of each drag.
const EVENTS: usize = 31;

fn main() {
    let folder = tempfile::tempdir().expect("a folder");
    println!("| nodes | event | edit, ms | session, ms | window, ms | in all, ms |");
    println!("| ---: | --- | ---: | ---: | ---: | ---: |");
    for count in [1000, 10_000] {
        let path = folder.path().join(format!("chain_{count}.ron"));
        fs::write(&path, chain(count)).expect("written");
        reading(&path, count);
        session(&path, count);
    }
    let path = folder.path().join("chain_1000.ron");
    window(&path, 1000);
}

/// This many nodes, each reading the one before, in rows on the canvas.
fn chain(count: usize) -> String {
    let node = |number: usize| match number.checked_sub(1) {
        None => "        \"n0\": Perlin(wavelength: \"6 km\", amplitude: \"900 m\"),\n".to_owned(),
        Some(before) => format!("        \"n{number}\": Clamp(value: \"n{before}\", high: 800),\n"),
    };
    let place = |number: usize| format!("        \"n{number}\": ({}, {}),\n", number % 40 * 240, number / 40 * 240);
    let nodes: String = (0..count).map(node).collect();
    let places: String = (0..count).map(place).collect();
    let outputs = format!("outputs: {{ \"height\": \"n{}\" }}", count - 1);
    format!(
        "(\n    world: (size: \"16 km\", cells: 16),\n    nodes: {{\n{nodes}    }},\n    {outputs},\n    layout: {{\n{places}    }},\n)\n"
    )
}

/// Reading and expanding the file alone.
fn reading(path: &Path, count: usize) {
    let registry = orograph_nodes::registry();
    let text = fs::read_to_string(path).expect("it was written");
    let read = median(5, |_| drop(Document::parse(text.as_str(), &registry)));
    let document = Document::parse(text.as_str(), &registry);
    assert!(!document.has_errors(), "{:?}", document.problems());
    line(count, "file read", [Some(read), None, None]);
    let mut copies = vec![document; 5];
    let expanded = median(5, |_| drop(copies.pop().map(|document| document.expand())));
    line(count, "graph expanded", [None, Some(expanded), None]);
}

/// A drag of the table: its name, and the edit of an event.
type Drag = (&'static str, Box<dyn Fn(usize) -> Edit>);

fn drags(count: usize) -> [Drag; 3] {
    let (last, middle) = (format!("n{}", count - 1), format!("n{}", count / 2));
    let set = |node: String, name: &'static str, first: usize| {
        move |event: usize| Edit::SetText { node: node.clone(), name: name.into(), text: format!("{}", first + event) }
    };
    let place = move |event: usize| Edit::SetLayout { node: middle.clone(), at: Some([event as f64 * 12.0, 36.0]) };
    [
        ("node moved", Box::new(place)),
        ("slider of the first node", Box::new(set("n0".into(), "amplitude", 901))),
        ("slider of the last node", Box::new(set(last, "high", 801))),
    ]
}

/// Drags in the session alone.
fn session(path: &Path, count: usize) {
    let mut opened = None;
    let open = median(1, |_| {
        opened = Session::open(
            Some(path.to_owned()),
            orograph_nodes::registry(),
            orograph::build::storage::in_memory(),
            || {},
        )
        .ok()
    });
    let mut session = opened.expect("the file can be read");
    line(count, "file opened", [Some(open), None, None]);
    session.set_cells(16);
    session.poll();
    for (name, edit) in drags(count) {
        session.end_gesture();
        assert!(session.gesture(&edit(EVENTS)), "{:?}", session.take_notes());
        let mut polls = Vec::new();
        let edits = median(EVENTS, |event| {
            let start = spent();
            session.poll();
            polls.push(spent() - start);
            assert!(session.gesture(&edit(event)));
        });
        let polls = middle(polls);
        line(count, name, [Some(edits - polls), Some(polls), None]);
    }
    session.end_gesture();
    let select = median(EVENTS, |event| {
        session.select_only(&format!("n{event}"));
        session.poll();
    });
    line(count, "another node selected", [None, Some(select), None]);
    let undo = median(1, |_| assert!(session.undo()));
    line(count, "edit undone", [Some(undo), None, None]);
}

/// Drags with everything that the window does.
fn window(path: &Path, count: usize) {
    let mut window: Harness<'static, App> =
        Harness::builder().with_size([1280.0, 800.0]).with_step_dt(1.0 / 60.0).build_eframe(|context| {
            context.wgpu_render_state = None;
            App::new(context, Some(path.to_owned()), orograph::build::storage::in_memory())
                .expect("the graph can be read")
        });
    window.state_mut().session_mut().set_cells(16);
    window.state_mut().session_mut().select_only("n5");
    for _ in 0..20 {
        window.step();
        thread::sleep(Duration::from_millis(5));
    }
    let idle = median(EVENTS, |_| window.step());
    line(count, "window without an event", [None, None, Some(idle)]);
    for (name, edit) in drags(count) {
        window.state_mut().session_mut().end_gesture();
        assert!(window.state_mut().session_mut().gesture(&edit(EVENTS)));
        let mut frames = Vec::new();
        let whole = median(EVENTS, |event| {
            assert!(window.state_mut().session_mut().gesture(&edit(event)));
            let start = spent();
            window.step();
            frames.push(spent() - start);
        });
        let frames = middle(frames);
        line(count, &format!("{name}, whole window"), [Some(whole - frames), None, Some(frames)]);
    }
}

fn line(count: usize, event: &str, parts: [Option<f64>; 3]) {
    let shown = parts.map(|part| part.map_or_else(String::new, |part| format!("{part:.2}")));
    println!("| {count} | {event} | {} | {:.2} |", shown.join(" | "), parts.iter().flatten().sum::<f64>());
}

/// The median processor time of some events, in milliseconds.
fn median(events: usize, mut event: impl FnMut(usize)) -> f64 {
    let times = (0..events).map(|number| {
        let start = spent();
        event(number);
        spent() - start
    });
    middle(times.collect())
}

fn middle(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times.get(times.len() / 2).copied().unwrap_or(0.0)
}

/// Milliseconds that this thread has run. Returns None when the system does not report it.
fn spent() -> f64 {
    // The system updates the count when a thread yields.
    thread::yield_now();
    let text = fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    text.split(' ').next().and_then(|ns| ns.parse::<f64>().ok()).unwrap_or(0.0) * 1e-6
}
