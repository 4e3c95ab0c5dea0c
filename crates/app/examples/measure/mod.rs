//! What the measuring examples share: a window without a graphics device, a chain of nodes, latencies and processor times.

use std::{
    fs,
    path::Path,
    thread,
    time::{Duration, Instant},
};

use egui_kittest::Harness;
use orograph::editor::App;

/// The time between two frames.
const FRAME: Duration = Duration::from_millis(16);

/// A graph of this many nodes `n0`, `n1` and so on, each reading the one before: first those of `head`, then `Terrace`.
pub fn chain(head: &[&str], count: usize, output: &str) -> String {
    let node = |number: usize| match head.get(number) {
        Some(node) => format!("\"n{number}\": {node}"),
        None => format!("\"n{number}\": Terrace(height: \"n{}\")", number - 1),
    };
    let nodes: Vec<String> = (0..count).map(node).collect();
    format!(
        "(world: (size: \"16 km\", cells: 512), nodes: {{ {} }}, outputs: {{ \"o\": \"{output}\" }})",
        nodes.join(", ")
    )
}

/// Runs frames until all conditions have been true. Returns the milliseconds from the start until each was first.
pub fn passed<const N: usize>(
    window: &mut Harness<'_, App>,
    start: Instant,
    are: impl Fn(&App) -> [bool; N],
) -> [f64; N] {
    let mut passed = [None; N];
    while passed.contains(&None) {
        let begun = Instant::now();
        window.step();
        let now = start.elapsed().as_secs_f64() * 1e3;
        for (passed, is) in passed.iter_mut().zip(are(window.state())) {
            *passed = passed.or(is.then_some(now));
        }
        // an event of the worker wakes the window; at most sixty frames a second
        thread::sleep(FRAME.saturating_sub(begun.elapsed()));
    }
    passed.map(Option::unwrap_or_default)
}

/// The cells along the longer side of the drawn terrain, if it is of this state of the document; otherwise 0.
pub fn seen(app: &App, revision: u64) -> u32 {
    app.seen().filter(|(seen, _)| *seen == revision).map_or(0, |(_, cells)| cells)
}

/// The median of each column.
pub fn medians<const N: usize>(rows: &[[f64; N]]) -> [f64; N] {
    std::array::from_fn(|column| {
        let mut values: Vec<f64> = rows.iter().map(|row| row[column]).collect();
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    })
}

/// A window of 1280 x 800 points on a graph, sixty frames a second.
pub fn window(folder: &Path, graph: &str) -> Harness<'static, App> {
    let path = folder.join("graph.ron");
    fs::write(&path, graph).expect("written");
    Harness::builder().with_size([1280.0, 800.0]).with_step_dt(1.0 / 60.0).build_eframe(|context| {
        context.wgpu_render_state = None;
        App::new(context, Some(path), orograph::build::storage::in_memory()).expect("the graph can be read")
    })
}

/// Runs frames until everything is built and drawn.
pub fn settle(window: &mut Harness<'_, App>) {
    let mut quiet = 0;
    while quiet <= 50 {
        window.step();
        thread::sleep(Duration::from_millis(2));
        quiet = if window.state().session().is_busy() { 0 } else { quiet + 1 };
    }
}

/// Milliseconds that this thread, or the whole program, has run, whatever else the machine does; 0 where the system does
/// not report it.
pub fn spent(all: bool) -> f64 {
    // The system updates the count when a thread yields.
    thread::yield_now();
    let own = Path::new("/proc/thread-self").canonicalize();
    let threads: Vec<_> = match fs::read_dir("/proc/self/task") {
        Ok(entries) if all => entries.flatten().map(|entry| entry.path()).collect(),
        _ => own.into_iter().collect(),
    };
    let told = threads.iter().filter_map(|thread| fs::read_to_string(thread.join("schedstat")).ok());
    told.filter_map(|told| told.split(' ').next()?.parse::<f64>().ok()).map(|ns| ns * 1e-6).sum()
}
