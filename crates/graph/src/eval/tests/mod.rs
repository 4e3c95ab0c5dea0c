//! Tests of the evaluator with a few small nodes.

mod caches;
mod faults;
mod keys;
mod levels;
mod live;
mod pull;
mod random;
mod running;
mod store;
mod windows;

use std::{collections::BTreeMap, num::NonZero, path::Path, sync::Mutex};

use super::*;
use crate::{
    Field, FileName, Input, Instance, Job, Line, Lines, Node, NodeError, Output, Outputs, ParamSpec, ParamValue,
    ParamValues, PortType, Reach, Report, Unit, Vertex, World, params,
};

params! {
    /// A number added everywhere.
    level: f64 = 0.0, Metres, -1e6..=1e6;
    /// Radius of an average.
    radius: f64 = 3.0, Metres, 0.0..=100.0;
    /// Makes equal nodes different.
    seed: crate::Seed = crate::Seed(0), One, ..;
    /// Read by some nodes.
    file: FileName = FileName(String::new()), One, ..;
}

fn height(job: &Job<'_>, at: impl Fn(usize, usize) -> f32) -> Result<Outputs, NodeError> {
    let window = job.window();
    let samples = (0..window.ny()).flat_map(|j| (0..window.nx()).map(move |i| (i, j))).map(|(i, j)| at(i, j));
    Ok(Outputs::one("height", Field::new(window, samples.collect())))
}

const HEIGHT: &[Output] = &[Output::gives("height", PortType::Height, "H.")];
const ONE: &[Input] = &[Input::needs("height", PortType::Height, "H.")];

/// A polynomial of the position and the seed.
static WAVES: Node = Node {
    id: "Waves",
    outputs: HEIGHT,
    params: Params::specs,
    cpu: |job| {
        let level = Params::read(job.params).level;
        let seed = f64::from(job.seed() >> 16);
        height(job, |i, j| {
            let [x, y] = job.window().centre_m(i, j);
            (level + (x * 37.0 + y * 91.0 + x * y + seed) % 17.0) as f32
        })
    },
    ..Node::DEFAULT
};

/// The sum of its inputs; the second may be a number.
static ADD: Node = Node {
    id: "Add",
    inputs: &[ONE[0], Input::number("other", Unit::Metres, 1.0, [-1e6, 1e6], [0.0, 10.0], "O.")],
    outputs: HEIGHT,
    cpu: |job| {
        let mut inputs = crate::InputReader::new(job);
        let (a, b) = (inputs.required::<Field>("height")?.samples(), inputs.lane("other")?);
        let nx = job.window().nx();
        height(job, |i, j| a[j * nx + i] + b.at(j * nx + i))
    },
    ..Node::DEFAULT
};

/// The average over a square.
static BLUR: Node = Node {
    id: "Blur",
    inputs: ONE,
    outputs: HEIGHT,
    params: Params::specs,
    reach: Reach::Metres(|params, _| params.read("radius")),
    cpu: |job| {
        let field = crate::InputReader::new(job).required::<Field>("height")?;
        let reach = (Params::read(job.params).radius / job.cell_m()).ceil() as usize;
        let (nx, ny) = (job.window().nx(), job.window().ny());
        height(job, |i, j| {
            let (mut sum, mut count) = (0.0, 0.0);
            for y in j.saturating_sub(reach)..(j + reach + 1).min(ny) {
                for x in i.saturating_sub(reach)..(i + reach + 1).min(nx) {
                    sum += field.samples()[y * nx + x];
                    count += 1.0;
                }
            }
            sum / count
        })
    },
    ..Node::DEFAULT
};

/// The difference from the mean of the world, with the mean as a report.
static ANOMALY: Node = Node {
    id: "Anomaly",
    inputs: ONE,
    outputs: &[
        HEIGHT[0],
        Output::gives("report", PortType::Report, "R."),
        Output::gives("lines", PortType::Lines, "L."),
    ],
    reach: Reach::World,
    cpu: |job| {
        let samples = crate::InputReader::new(job).required::<Field>("height")?.samples();
        let mean = samples.iter().map(|v| f64::from(*v)).sum::<f64>() / samples.len() as f64;
        let mut report = Report::default();
        report.measure("mean", mean, "m");
        report.measure("undefined", f64::NAN, "");
        report.measure("infinite", f64::NEG_INFINITY, "");
        let nx = job.window().nx();
        let vertex = |x| Vertex { position_m: [x, 0.1], width_m: mean, area_m2: 1.0 / 3.0, ..Vertex::default() };
        let line = |downstream| Line { order: 3, downstream, vertices: vec![vertex(0.0), vertex(mean / 3.0)] };
        let lines = Lines::open(vec![line(Some(1)), line(None)]);
        let heights = height(job, |i, j| (f64::from(samples[j * nx + i]) - mean) as f32)?;
        Ok(heights.with("report", report).with("lines", lines))
    },
    ..Node::DEFAULT
};

/// A graph with short methods to build it.
#[derive(Default)]
struct Build(Graph);

impl Build {
    /// Adds a node whose wires are `input: end`.
    fn node(mut self, name: &str, node: &'static Node, wires: &[(&str, &str)]) -> Self {
        let index = self.0.add(Instance::new(name, node)).expect("a new name");
        for (input, end) in wires {
            let port = self.0.port(end).expect("exists");
            self.0.connect(port, index, input).expect("fits");
        }
        self
    }

    fn set(mut self, name: &str, parameter: &'static str, value: ParamValue) -> Self {
        set(&mut self.0, name, parameter, value);
        self
    }
}

fn set(graph: &mut Graph, name: &str, parameter: &'static str, value: ParamValue) {
    let index = graph.find(name).expect("exists");
    graph.instance_mut(index).params.set(parameter, value);
}

fn world(side: u32) -> World {
    World { size: [f64::from(side); 2], cells: [side; 2], seed: 7, ..World::default() }
}

fn evaluator(threads: usize) -> Evaluator {
    with(EvaluatorOptions { threads: NonZero::new(threads), ..EvaluatorOptions::default() })
}

fn with(options: EvaluatorOptions) -> Evaluator {
    Evaluator::new(options).expect("threads start")
}

/// All values, or the first error.
fn evaluate(
    evaluator: &Evaluator,
    graph: &Graph,
    requests: &[(Port, Window)],
    cancel: &Cancel,
    events: &(dyn Fn(Event) + Sync),
) -> Result<Vec<Value>, EvalError> {
    let requests: Vec<Request> =
        requests.iter().map(|(port, window)| Request { port: *port, window: *window }).collect();
    let evaluation = Evaluation { graph, folder: Path::new(""), requests: &requests, byproducts: &[] };
    evaluator.evaluate(&evaluation, cancel, events).into_iter().collect()
}

/// Evaluator options with a store of that memory and folder.
fn keeping(memory_budget: usize, folder: Option<StoreFolder>) -> EvaluatorOptions {
    EvaluatorOptions { store: Arc::new(Store::new(memory_budget, folder)), ..EvaluatorOptions::default() }
}

/// The result of an evaluation.
struct Outcome {
    values: Vec<Value>,
    /// The origin of each node's results.
    origins: BTreeMap<String, Origin>,
    warnings: Vec<String>,
}

impl Outcome {
    /// The nodes whose kernels ran.
    fn computed(&self) -> Vec<&str> {
        self.from(Origin::Computed)
    }

    fn from(&self, origin: Origin) -> Vec<&str> {
        self.origins.iter().filter(|(_, o)| **o == origin).map(|(name, _)| name.as_str()).collect()
    }
}

/// Evaluates outputs such as `blur` or `stats.report`.
fn run(evaluator: &Evaluator, graph: &Graph, ends: &[&str], window: Window) -> Result<Outcome, EvalError> {
    let requests: Vec<(Port, Window)> = ends.iter().map(|end| (graph.port(end).expect("exists"), window)).collect();
    run_requests(evaluator, graph, &requests)
}

fn run_requests(evaluator: &Evaluator, graph: &Graph, requests: &[(Port, Window)]) -> Result<Outcome, EvalError> {
    let told = Mutex::new(Vec::new());
    let events = |event: Event| told.lock().expect("no panic").push(event);
    let values = evaluate(evaluator, graph, requests, &Cancel::default(), &events)?;
    let mut outcome = Outcome { values, origins: BTreeMap::new(), warnings: Vec::new() };
    let mut finished = std::collections::BTreeSet::new();
    for event in told.into_inner().expect("no panic") {
        match event {
            Event::NodeFinished { name, origin, cells, .. } => {
                // some outputs may be stored while others have to be computed, and others belong to another world
                outcome.origins.insert(name.to_string(), origin);
                let is_new = finished.insert((name.to_string(), cells, origin == Origin::Computed));
                assert!(is_new, "`{name}` finished twice");
            }
            Event::Warning { message, .. } => outcome.warnings.push(message),
            _ => {}
        }
    }
    Ok(outcome)
}
