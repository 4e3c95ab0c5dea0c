//! Shows how to add, check and profile a node: `cargo run --release -p orograph-tests --example new_node`.
//!
//! It declares a node, `Swell`, in this file, builds a graph that uses it, compares the result with its closed form,
//! and prints figures that are useful for reviewing a kernel: the number of cells that differ between SIMD levels,
//! thread counts and windows, and the time per cell. A node of the program has the same declaration in a file in
//! `crates/nodes/src/CATEGORY/`, with `NODE` listed in the `mod.rs` there; the conformance tests then make all these
//! comparisons for it.
//!
//! To step through a kernel: `rust-gdb --args target/debug/examples/new_node`, then `break new_node::run`. Give the
//! evaluator one thread, as [`build`] does with `threads: 1`. To see where its time goes:
//! `perf record target/release/examples/new_node`.

#![expect(clippy::disallowed_methods, reason = "the closed form is computed independently of the kernel")]

use std::{error::Error, f64::consts::TAU, num::NonZero, sync::Mutex, time::Duration};

use orograph_graph::{
    Cancel, Document, Evaluation, Evaluator, EvaluatorOptions, Event, Field, Job, Node, NodeError, Outputs, Reach,
    Registry, Request, Resolution, Window, World, inputs, outputs, params,
};
use orograph_nodes::numerics::{
    math, par,
    simd::{self, Level},
};

params! {
    /// Distance between crests, from west to east.
    wavelength: f64 = 800.0, Metres, 1.0..=1e6, soft 50..=5000;
    /// Height of a crest above the original terrain.
    amplitude: f64 = 40.0, Metres, 0.0..=1e4, soft 0..=200;
}

inputs! {
    /// Terrain height.
    height: Height;
    /// Where swells are added: fully at 1, not at 0.
    mask: Mask = 1.0, 0.0..=1.0;
}

outputs! {
    /// Terrain with swells.
    height: Height;
    /// The change in height.
    change: Scalar(Metres);
}

/// The declaration.
static NODE: Node = Node {
    id: "Swell",
    category: "filter",
    summary: "Adds straight waves to the terrain.",
    doc: "Adds $a \\sin(2 \\pi x / \\lambda)$, where x is the distance from the west side of the world.",
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    // Each cell depends only on the same cell of the inputs. A blur would declare its radius here.
    reach: Reach::Point,
    // The same terrain at any resolution, except for waves too short for the cells.
    resolution: Resolution::Within(0.01),
    cpu: run,
    example: "height: \"base\"",
    ..Node::DEFAULT
};

/// The kernel: a pure function of its job.
fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let Inputs { height, mask } = Inputs::read(job)?;
    let params = Params::read(job.params);
    let wants = Wants::of(job);
    let nx = job.window().nx();
    let mut change = orograph_graph::memory::zeroed(job.window().len())?;
    par::rows(job, &mut change, |j, row| {
        for (i, change) in row.iter_mut().enumerate() {
            let x_m = job.window().centre_m(i, j)[0];
            let wave = params.amplitude * math::sin(TAU * x_m / params.wavelength);
            *change = mask.at(j * nx + i) * wave as f32;
        }
    })?;
    let swollen = wants.height.then(|| {
        let sums = height.samples().iter().zip(&change).map(|(height, change)| height + change);
        Field::new(job.window(), sums.collect())
    });
    let change = wants.change.then(|| Field::new(job.window(), change));
    Ok(Given { height: swollen, change }.into())
}

/// A graph with the node. Problems of a file are reported with their line and a remedy.
const GRAPH: &str = r#"(
    nodes: {
        "ground": Perlin(wavelength: "3 km", amplitude: "200 m"),
        "swell": Swell(height: "ground", wavelength: "700 m"),
    },
    outputs: { "change": "swell.change" },
)"#;

/// Builds the change on a window. Returns the samples and the time of the node's kernel.
fn build(window: Window, threads: usize) -> Result<(Field, Duration), Box<dyn Error>> {
    let nodes = orograph_nodes::registry();
    let registry = Registry::new(nodes.nodes().iter().copied().chain([&NODE]));
    assert_eq!(registry.faults(), Vec::<String>::new(), "the declaration is sound");
    let document = Document::parse(GRAPH.to_owned(), &registry);
    if let Some(problem) = document.problems().first() {
        return Err(problem.message.clone().into());
    }
    let graph = document.graph();
    let evaluator = Evaluator::new(EvaluatorOptions { threads: NonZero::new(threads), ..EvaluatorOptions::default() })?;
    let requests = [Request { port: graph.port("swell.change")?, window }];
    let evaluation = Evaluation { graph, folder: ".".as_ref(), requests: &requests, byproducts: &[] };
    let took = Mutex::new(Duration::ZERO);
    let values = evaluator.evaluate(&evaluation, &Cancel::default(), &|event| {
        if let Event::NodeFinished { name, time, .. } = event
            && &*name == "swell"
        {
            *took.lock().unwrap_or_else(std::sync::PoisonError::into_inner) = time;
        }
    });
    let value = values.into_iter().next().ok_or("one request, one value")??;
    let field = value.as_field().ok_or("a raster")?.clone();
    Ok((field, took.into_inner()?))
}

fn main() -> Result<(), Box<dyn Error>> {
    let world = World { size: [6000.0; 2], cells: [1200; 2], ..World::default() };
    let whole = Window::whole(world);
    let (change, took) = build(whole, 1)?;

    // The difference from the closed form.
    let error = (0..whole.len()).map(|at| {
        let x_m = whole.centre_m(at % whole.nx(), at / whole.nx())[0];
        (f64::from(change.samples()[at]) - 40.0 * (TAU * x_m / 700.0).sin()).abs()
    });
    println!("largest difference from the closed form: {:.1e} m", error.fold(0.0, f64::max));

    // Differences between runs.
    let threads = build(whole, 4)?.0;
    let narrow = simd::at(Level::Baseline, || build(whole, 1))?.0;
    let part = Window { origin: [300, 500], cells: [256, 128], ..whole };
    let alone = build(part, 1)?.0;
    println!("cells that differ on four threads: {}", differing(&change, &threads));
    println!("cells that differ at the baseline instruction set: {}", differing(&change, &narrow));
    println!("cells that differ in a window: {}", differing(&change.crop(&part), &alone));

    println!("time: {:.1} ns per cell on one thread", took.as_secs_f64() * 1e9 / whole.len() as f64);
    Ok(())
}

/// The number of cells whose bits differ.
fn differing(one: &Field, other: &Field) -> usize {
    one.samples().iter().zip(other.samples()).filter(|(one, other)| one.to_bits() != other.to_bits()).count()
}
