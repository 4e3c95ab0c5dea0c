//! Time per cell of every node as a table: `cargo run --release -p orograph-tests --example speed`, or with a side in cells and names
//! of nodes after `--` for some; see `docs/speed.md`.
//!
//! Each node runs on its example on the tests' land, its inputs computed before, on one thread. Told is the fastest of several runs in
//! nanoseconds of that thread per cell of the world: processor time where the system tells it, so that other work on the machine
//! hardly shows, else elapsed time.

#![expect(clippy::disallowed_methods, reason = "it measures time")]

use std::{
    error::Error,
    time::{Duration, Instant},
};

use orograph_graph::{Cancel, InputValue, Job, Node, Warnings, Window};
use orograph_nodes::{registry, simd};
use orograph_tests::{Case, data_folder, example, inputs, world};

/// Runs go on until they have taken so long together, or are so many.
const ENOUGH: (Duration, usize) = (Duration::from_millis(600), 12);

fn main() -> Result<(), Box<dyn Error>> {
    let (sides, names): (Vec<String>, Vec<String>) =
        std::env::args().skip(1).partition(|arg| arg.parse::<u32>().is_ok());
    let side = sides.first().map_or(Ok(1024), |side| side.parse())?;
    println!(
        "{side} x {side} cells, one thread, {} SIMD, {}.\n",
        format!("{:?}", simd::level()).to_uppercase(),
        machine()
    );
    println!("| category | node | ns per cell |\n| --- | --- | ---: |");
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    for node in registry().nodes().iter().filter(|node| names.is_empty() || names.iter().any(|name| name == node.id)) {
        let case = example(node);
        let window = Window::whole(world(side));
        let values = inputs(&case, window);
        let least = one.install(|| fastest(node, &case, &values, window))?;
        println!("| {} | {} | {:.2} |", node.category, node.id, least / window.len() as f64);
    }
    Ok(())
}

/// Nanoseconds of this thread: of the processor where the system tells them, else by the clock since `begun`.
fn thread_ns(begun: Instant) -> f64 {
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let processor = told.split(' ').next().and_then(|ns| ns.parse().ok());
    processor.unwrap_or_else(|| begun.elapsed().as_secs_f64() * 1e9)
}

/// The fastest of several runs of a kernel, in nanoseconds.
fn fastest(node: &'static Node, case: &Case, values: &[InputValue], window: Window) -> Result<f64, String> {
    let params = case.graph.instance(case.node).params.clone();
    let (begun, mut least, mut runs) = (Instant::now(), f64::MAX, 0);
    while runs == 0 || (begun.elapsed() < ENOUGH.0 && runs < ENOUGH.1) {
        let job = Job {
            node,
            params: &params,
            inputs: values.to_vec(),
            window,
            folder: data_folder(),
            cancel: Cancel::default(),
            progress: &|_| {},
            warnings: Warnings::default(),
            glimpses: None,
        };
        let start = thread_ns(begun);
        let outputs = (node.cpu)(&job).map_err(|error| format!("{}: {error}", node.id))?;
        least = least.min(thread_ns(begun) - start);
        drop(outputs);
        runs += 1;
    }
    Ok(least)
}

/// The processor by its own name, where the system tells it.
fn machine() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name =
        info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':')).map(|(_, name)| name.trim());
    name.map_or_else(|| std::env::consts::ARCH.to_owned(), str::to_owned)
}
