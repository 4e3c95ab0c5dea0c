//! Random edits of a graph of nodes with kernels for the GPU, each followed by an evaluation.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::Path,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
};

use orograph_graph::{
    Cancel, EvalError, Evaluation, Evaluator, EvaluatorOptions, Event, Fallback, Field, Graph, InputValue, Instance,
    NodeIndex, Origin, ParamValue, Port, Request, Store, Value, Window, World,
};
use orograph_nodes::gpu::Gpu;

use crate::{
    Draw, LAND, SELECTION, STEPPED,
    gpu::{Distance, distance, nodes, nudge, range},
    run::{Case, one_step_of_ice},
};

/// Nodes with kernels in the graph at most.
const MOST_NODES: usize = 16;
/// Cells along a side of the world: odd numbers, and some that fill workgroups.
const CELLS: [u32; 4] = [33, 48, 61, 64];
/// Side of the world in metres.
const SIDE_M: f64 = 6_400.0;
/// Longest simulated time of nodes whose steps are as short as their cells, in seconds per metre of a cell.
const BRIEF: f64 = 1.0;

/// One output in so many may hang on the last bit of an input.
pub const FEW: usize = 50;

/// What the edits have led to.
#[derive(Clone, Debug, Default)]
pub struct Soaked {
    /// Edits that were made.
    pub edits: usize,
    /// Edits that no node could follow, which were taken back.
    pub refused: usize,
    /// Runs of kernels on the device.
    pub on_device: usize,
    /// Runs that the device left to the CPU, with a warning.
    pub left: usize,
    /// Outputs that were compared with those of the CPU.
    pub compared: usize,
    /// Those beyond their tolerance that hang on the last bit of an input: the CPU's own result moves at least half as
    /// far when its inputs are one bit larger.
    pub nudged: usize,
    /// Kinds of nodes that were compared.
    pub kinds: BTreeSet<&'static str>,
    /// Most bytes on the device after an evaluation.
    pub held: u64,
    /// Most bytes on the device while kernels ran.
    pub busy: u64,
    /// What is wrong: outputs beyond their tolerance, a budget that was exceeded.
    pub faults: Vec<String>,
}

impl Soaked {
    /// Returns true if few outputs are beyond their tolerance because they hang on the last bit of an input: at most one
    /// in [`FEW`], and one more.
    #[must_use]
    pub const fn is_few_nudged(&self) -> bool {
        self.nudged <= 1 + self.compared / FEW
    }
}

/// A graph that is being edited.
struct Soak {
    gpu: Arc<Gpu>,
    evaluator: Evaluator,
    graph: Graph,
    draw: Draw,
    cells: u32,
    /// Nodes so far, for names.
    made: usize,
    found: Soaked,
}

/// What an evaluation gives.
struct Ran {
    values: BTreeMap<(NodeIndex, usize), Value>,
    /// Nodes whose kernels ran on the device.
    computed: Vec<NodeIndex>,
    left: usize,
    busy: u64,
}

/// Makes random edits: of parameters, constants, wires, nodes and the resolution. After each, what the graph ends in
/// is evaluated on the device, and each output that was computed there is compared with that of the CPU from the same
/// inputs. After each evaluation the device may hold `budget` bytes.
///
/// # Panics
/// When the system has no threads.
#[must_use]
pub fn soak(gpu: &Arc<Gpu>, budget: u64, edits: usize, seed: u32) -> Soaked {
    let store = Arc::new(Store::new(256 << 20, None));
    let options = EvaluatorOptions { backend: Arc::clone(gpu) as _, store, ..EvaluatorOptions::default() };
    let mut graph = Graph::default();
    for (name, node) in [("land", &LAND), ("selection", &SELECTION)] {
        graph.add(Instance::new(name, node)).expect("a new name");
    }
    let mut soak = Soak {
        gpu: Arc::clone(gpu),
        evaluator: Evaluator::new(options).expect("threads start"),
        graph,
        draw: Draw(seed),
        cells: CELLS[3],
        made: 0,
        found: Soaked::default(),
    };
    for _ in 0..edits {
        let (before, cells) = (soak.graph.clone(), soak.cells);
        soak.edit();
        soak.found.edits += 1;
        if let Err(error) = soak.evaluate() {
            // settings that make no sense together are refused, by the CPU as well
            if !matches!(error, EvalError::Node { .. } | EvalError::Output { .. } | EvalError::Type { .. }) {
                soak.found.faults.push(format!("edit {}: {error}", soak.found.edits));
            }
            soak.found.refused += 1;
            (soak.graph, soak.cells) = (before, cells);
        }
        let held = gpu.held();
        soak.found.held = soak.found.held.max(held);
        if held > budget {
            soak.found.faults.push(format!("edit {}: {held} bytes on the device", soak.found.edits));
        }
    }
    soak.found
}

impl Soak {
    fn window(&self) -> Window {
        Window::whole(World { size: [SIDE_M; 2], cells: [self.cells; 2], seed: 7, ..World::default() })
    }

    /// The nodes with kernels.
    fn kernels(&self) -> Vec<NodeIndex> {
        self.graph.indices().filter(|at| self.graph.instance(*at).node.gpu.is_some()).collect()
    }

    fn edit(&mut self) {
        let kernels = self.kernels();
        match self.draw.below(10) {
            0 => self.cells = self.draw.one(&CELLS),
            1 if kernels.len() > 2 => self.remove(&kernels),
            2 if !kernels.is_empty() => self.rewire(&kernels),
            3..=6 if !kernels.is_empty() => self.change(&kernels),
            _ if kernels.len() < MOST_NODES => self.add(),
            _ => self.remove(&kernels),
        }
    }

    /// Removes a node that none reads.
    fn remove(&mut self, kernels: &[NodeIndex]) {
        let read: BTreeSet<NodeIndex> = self.wires().into_iter().map(|(from, _, _)| from.node).collect();
        let ends: Vec<NodeIndex> = kernels.iter().copied().filter(|at| !read.contains(at)).collect();
        if !ends.is_empty() {
            let end = self.draw.one(&ends);
            self.graph.remove(end);
        }
    }

    /// All wires: from where, to which input.
    fn wires(&self) -> Vec<(Port, NodeIndex, usize)> {
        let inputs = |at: NodeIndex| (0..self.graph.instance(at).node.inputs.len()).map(move |input| (at, input));
        let all = self.graph.indices().flat_map(inputs);
        all.filter_map(|(at, input)| Some((self.graph.source(at, input)?, at, input))).collect()
    }

    /// Wires an input to another output.
    fn rewire(&mut self, kernels: &[NodeIndex]) {
        let at = self.draw.one(kernels);
        let inputs = self.graph.instance(at).node.inputs;
        if !inputs.is_empty() {
            let input = self.draw.one(&inputs.iter().map(|input| input.name).collect::<Vec<_>>());
            let ports = self.ports();
            let from = self.draw.one(&ports);
            // a wire that does not fit, or that closes a cycle, is refused
            let _ = self.graph.connect(from, at, input);
        }
    }

    /// Changes a parameter, or a constant.
    fn change(&mut self, kernels: &[NodeIndex]) {
        let at = self.draw.one(kernels);
        let node = self.graph.instance(at).node;
        let specs = node.specs();
        if !specs.is_empty() {
            let spec = self.draw.one(&specs);
            if let Some(value) = self.draw.value(&spec.kind) {
                self.graph.instance_mut(at).params.set(spec.name, value);
            }
        }
        for (position, input) in node.inputs.iter().enumerate() {
            if let Fallback::Constant { soft: [low, high], .. } = input.fallback
                && self.draw.share() < 0.2
            {
                let value = low + self.draw.share() * (high - low);
                self.graph.instance_mut(at).constants[position] = Some(value);
            }
        }
        self.shorten(at);
    }

    /// Limits the time of a node with many steps.
    fn shorten(&mut self, at: NodeIndex) {
        one_step_of_ice(self.graph.instance_mut(at));
        if STEPPED.contains(&self.graph.instance(at).node.id) {
            let most = BRIEF * SIDE_M / f64::from(CELLS[3]);
            let params = &mut self.graph.instance_mut(at).params;
            let duration = params.read::<f64>("duration").min(most);
            params.set("duration", ParamValue::Float(duration));
        }
    }

    /// The outputs that are rasters.
    fn ports(&self) -> Vec<Port> {
        let outputs = |node: NodeIndex| {
            (0..self.graph.instance(node).node.outputs.len()).map(move |output| Port { node, output })
        };
        let all = self.graph.indices().flat_map(outputs);
        all.filter(|port| self.graph.output_type(*port).planes().is_some()).collect()
    }

    /// Adds a node that reads the newest outputs that fit.
    fn add(&mut self) {
        let node = self.draw.one(&nodes());
        let ports = self.ports();
        let at = self.graph.add(Instance::new(format!("n{}", self.made), node)).expect("a new name");
        self.made += 1;
        for input in node.inputs {
            if input.fallback == Fallback::Required || self.draw.share() < 0.4 {
                let graph = &self.graph;
                let suits = ports.iter().rev().copied().filter(|port| input.ty.accepts(graph.output_type(*port)));
                let suits: Vec<Port> = suits.take(4).collect();
                if !suits.is_empty() {
                    let from = self.draw.one(&suits);
                    self.graph.connect(from, at, input.name).expect("it fits");
                }
            }
        }
        for spec in node.specs() {
            if let Some(value) = self.draw.value(&spec.kind) {
                self.graph.instance_mut(at).params.set(spec.name, value);
            }
        }
        self.shorten(at);
        if self.graph.unwired().iter().any(|(unwired, _)| *unwired == at) {
            self.graph.remove(at);
        }
    }

    /// Evaluates outputs; nothing is delivered of those that fail.
    fn values(&self, ports: &[Port]) -> Result<Ran, EvalError> {
        let window = self.window();
        let requests: Vec<Request> = ports.iter().map(|port| Request { port: *port, window }).collect();
        let evaluation = Evaluation { graph: &self.graph, folder: Path::new(""), requests: &requests, byproducts: &[] };
        let (busy, told) = (AtomicU64::new(0), Mutex::new((Vec::new(), 0)));
        let hear = |event: Event| {
            busy.fetch_max(self.gpu.held(), Ordering::Relaxed);
            let mut told = told.lock().unwrap_or_else(PoisonError::into_inner);
            match event {
                Event::NodeFinished { node, origin: Origin::Computed, backend: "gpu", .. } => told.0.push(node),
                Event::Warning { message, .. } if message.starts_with("computed on the CPU") => told.1 += 1,
                _ => {}
            }
        };
        let values = self.evaluator.evaluate(&evaluation, &Cancel::default(), &hear);
        let (computed, left) = told.into_inner().unwrap_or_else(PoisonError::into_inner);
        let values = ports.iter().zip(values).map(|(port, value)| Ok(((port.node, port.output), value?)));
        Ok(Ran { values: values.collect::<Result<_, EvalError>>()?, computed, left, busy: busy.into_inner() })
    }

    /// Evaluates what the graph ends in, so that what lies between stays on the device; then compares what was computed.
    fn evaluate(&mut self) -> Result<(), EvalError> {
        let read: BTreeSet<NodeIndex> = self.wires().into_iter().map(|(from, _, _)| from.node).collect();
        let ports = self.ports();
        let ends: Vec<Port> = ports.iter().copied().filter(|port| !read.contains(&port.node)).collect();
        let ran = self.values(&ends)?;
        self.found.on_device += ran.computed.len();
        self.found.left += ran.left;
        self.found.busy = self.found.busy.max(ran.busy);
        // the inputs and all outputs of what was computed
        let all = self.values(&ports)?;
        for at in ran.computed {
            self.compare(at, &all.values);
        }
        Ok(())
    }

    fn compare(&mut self, at: NodeIndex, values: &BTreeMap<(NodeIndex, usize), Value>) {
        let (instance, window) = (self.graph.instance(at), self.window());
        let (node, kernel) = (instance.node, instance.node.gpu.expect("a kernel"));
        let input = |(position, input): (usize, &orograph_graph::Input)| match (
            self.graph.source(at, position),
            input.fallback,
        ) {
            (Some(port), _) => InputValue::Value(values[&(port.node, port.output)].clone()),
            (None, Fallback::Constant { default, .. }) => {
                InputValue::Constant(instance.constants[position].unwrap_or(default))
            }
            (None, _) => InputValue::Absent,
        };
        let inputs: Vec<InputValue> = node.inputs.iter().enumerate().map(input).collect();
        let case = Case { name: instance.name.clone(), graph: self.graph.clone(), node: at };
        let by_cpu = |inputs: Vec<InputValue>| (node.cpu)(&case.job(inputs, window)).ok();
        let Some(mut expected) = by_cpu(inputs.clone()) else { return };
        let mut nudged = None;
        for (at_output, (output, tolerance)) in node.outputs.iter().zip(kernel.tolerance).enumerate() {
            let (Some(Value::Field(found)), Some(Value::Field(expected))) =
                (values.get(&(at, at_output)), expected.take(output.name))
            else {
                continue;
            };
            let apart = |other: &Field| distance(other.samples(), expected.samples(), range(&inputs), tolerance);
            let Distance { most, allowed, .. } = apart(found);
            self.found.compared += 1;
            self.found.kinds.insert(node.id);
            if most <= allowed {
                continue;
            }
            // where the result hangs on the last bit of an input, the kernel may be as far away as that bit moves it
            let moved =
                nudged.get_or_insert_with(|| by_cpu(inputs.iter().map(|input| nudge(input, |_| true)).collect()));
            let moved = moved.as_mut().and_then(|outputs| outputs.take(output.name));
            let moved = moved.as_ref().and_then(Value::as_field).map_or(0.0, |field| apart(field).most);
            if !most.is_nan() && most <= 2.0 * moved {
                self.found.nudged += 1;
            } else {
                let (edit, name) = (self.found.edits, output.name);
                let params = &instance.params;
                self.found.faults.push(format!(
                    "edit {edit}: {}.{name} is {most} from the CPU, and {allowed} is allowed; {params:?}",
                    node.id
                ));
            }
        }
    }
}
