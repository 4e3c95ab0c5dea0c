//! Running one node of the registry on test terrain.

use std::{
    num::NonZero,
    path::PathBuf,
    sync::{Arc, LazyLock},
};

use orograph_graph::{
    Cancel, Document, EvalError, Evaluator, EvaluatorOptions, Fallback, Graph, InputValue, Instance, Job, Kind, Layer,
    Node, NodeIndex, ParamValue, Port, Registry, Stop, Store, Unit, Value, Warnings, Waypoint, Window, World,
};

use crate::land::{LAND, SELECTION, world};

/// A node wired to test terrain, with certain parameters.
#[derive(Clone)]
pub struct Case {
    /// The name of the case, such as `default` or `mode=max`.
    pub name: String,
    /// The node with its inputs.
    pub graph: Graph,
    /// The node in the graph.
    pub node: NodeIndex,
}

impl Case {
    /// The node's kind.
    #[must_use]
    pub fn kind(&self) -> &'static Node {
        self.graph.instance(self.node).node
    }

    /// All outputs of the node.
    #[must_use]
    pub fn outputs(&self) -> Vec<Port> {
        (0..self.kind().outputs.len()).map(|output| Port { node: self.node, output }).collect()
    }

    /// The job of the node's kernel, with the given inputs and no progressive preview.
    #[must_use]
    pub fn job(&self, inputs: Vec<InputValue>, window: Window) -> Job<'_> {
        Job {
            node: self.kind(),
            params: &self.graph.instance(self.node).params,
            inputs,
            window,
            wanted: orograph_graph::Wanted::ALL,
            folder: data_folder(),
            cancel: Cancel::default(),
            progress: &|_| {},
            level: orograph_graph::LevelJob::default(),
            warnings: Warnings::default(),
            glimpses: None,
        }
    }
}

/// The registry with the test's own nodes added.
fn registry() -> Registry {
    let nodes = orograph_nodes::registry();
    Registry::new(nodes.nodes().iter().copied().chain([&LAND, &SELECTION]))
}

/// The terrain for the tests.
const TEST_LAND: &str = r#"
    "base": TestLand,
    "other": TestLand,
    "mask": TestSelection,
"#;

/// The node with the arguments of its declaration's example, in a graph with the names that examples use.
///
/// # Panics
/// When the example has a problem.
#[must_use]
pub fn example(node: &'static Node) -> Case {
    on_one_grid(example_on(TEST_LAND, node, node.example))
}

/// A kernel that can run on levels, on the cells asked for alone: levels, of which the evaluator runs one after the other,
/// have tests of their own.
fn on_one_grid(case: Case) -> Case {
    let has_levels = case.kind().levels.is_some();
    if has_levels { set(case, &[("schedule", ParamValue::Choice("full"))]) } else { case }
}

/// Filters with a radius: their title, the node, and all arguments but the last, which is the radius.
pub const REACHING: [(&str, &str, &str); 7] = [
    ("Blur", "Blur", r#"value: "base", radius"#),
    ("Median", "Median", r#"value: "base", radius"#),
    ("Despike", "Despike", r#"height: "base", radius"#),
    ("Bilateral", "Bilateral", r#"value: "base", radius"#),
    ("Morphology, dilated land", "Morphology", r#"value: "base", operation: dilate, radius"#),
    ("Morphology, a dilated mask of 0 and 1", "Morphology", r#"value: "patches", operation: dilate, radius"#),
    ("Distance", "Distance", r#"selection: "patches", side: both, limit"#),
];

/// One of [`REACHING`] on the terrain for the tests, with a radius in metres.
///
/// # Panics
/// When it has a problem.
#[must_use]
pub fn reaching((_, id, arguments): (&str, &str, &str), radius_m: f64) -> Case {
    let land = format!(r#"{TEST_LAND} "patches": Select(value: "base", from: 1000, falloff: 0),"#);
    example_on(&land, registry().get(id).expect("a node"), &format!("{arguments}: {radius_m}"))
}

/// The example of a node that reads layers of rock, in this even number of layers, 8 km thick together; with 0, without
/// layers. Every other layer is harder by a thousandth: layers of equal rock are one.
///
/// # Panics
/// When the node has no input `strata`.
#[must_use]
pub fn layered(node: &'static Node, layers: u32) -> Case {
    if layers == 0 {
        return example(node);
    }
    let layer =
        |hardness: f64| format!("(thickness: {}, hardness: {hardness}, repose: 38),", 8000.0 / f64::from(layers));
    let column = format!("{}{}", layer(1.0), layer(1.001)).repeat(layers as usize / 2);
    let land = format!(r#"{TEST_LAND} "column": Stratify(height: "base", top: 4000, dip: 5, layers: [{column}]),"#);
    let mut case = on_one_grid(example_on(&land, node, node.example));
    let strata = case.graph.port("column.strata").expect("just written");
    case.graph.connect(strata, case.node, "strata").expect("it reads layers");
    case
}

fn example_on(land: &str, node: &'static Node, arguments: &str) -> Case {
    let source = format!(
        r#"(
            nodes: {{
                {land}
                "flow": Flow(height: "base"),
                "strata": Stratify(height: "base", dip: 5),
                "path": Path(width: 200),
                "tint": Ramp(version: 2, value: "base", range: set, high: 2000),
                "relief": Hillshade(version: 1, height: "base"),
                "node": {},
            }},
            outputs: {{ "node": "node" }},
        )"#,
        node.written(arguments)
    );
    let document = Document::parse(source, &registry());
    let problems: Vec<String> = document.problems().iter().map(|problem| problem.message.clone()).collect();
    assert!(problems.is_empty(), "the example of {} has problems: {problems:?}", node.id);
    let graph = document.graph().clone();
    let index = graph.find("node").expect("just written");
    Case { name: "example".into(), graph, node: index }
}

/// The cases that every node is tested with: its example; every choice and switch; all numbers at their minimum and at
/// their maximum; test terrain wired to every input that accepts it.
#[must_use]
pub fn cases(node: &'static Node) -> Vec<Case> {
    let mut cases = vec![example(node), wired(node)];
    for spec in node.specs() {
        match &spec.kind {
            Kind::Choice { options, .. } => {
                for (option, _) in *options {
                    cases.push(changed(
                        node,
                        format!("{}={option}", spec.name),
                        &[(spec.name, ParamValue::Choice(option))],
                    ));
                }
            }
            Kind::Bool { default } => {
                cases.push(changed(
                    node,
                    format!("{}={}", spec.name, !default),
                    &[(spec.name, ParamValue::Bool(!default))],
                ));
            }
            _ => {}
        }
    }
    for (name, end) in [("least", 0), ("most", 1)] {
        let mut case = example(node);
        let instance = case.graph.instance_mut(case.node);
        for spec in node.specs() {
            match spec.kind {
                Kind::Float { hard, .. } => instance.params.set(spec.name, ParamValue::Float(hard[end])),
                Kind::Int { hard, .. } => instance.params.set(spec.name, ParamValue::Int(hard[end])),
                Kind::Point { hard, .. } => instance.params.set(spec.name, ParamValue::Point([hard[end]; 2])),
                _ => {}
            }
        }
        for (position, input) in node.inputs.iter().enumerate() {
            if let Fallback::Constant { hard, .. } = input.fallback {
                instance.constants[position] = Some(hard[end]);
            }
        }
        case.name = name.into();
        cases.push(case);
    }
    cases
}

/// The example with each of its lengths and areas at either end of its range.
#[must_use]
pub fn lengths(node: &'static Node) -> Vec<Case> {
    let mut cases = vec![example(node)];
    for spec in node.specs().iter().filter(|spec| matches!(spec.unit, Unit::Metres | Unit::SquareMetres)) {
        let Kind::Float { hard, .. } = spec.kind else { continue };
        for end in hard {
            cases.push(changed(node, format!("{}={end:e}", spec.name), &[(spec.name, ParamValue::Float(end))]));
        }
    }
    cases
}

/// Nodes whose steps, in time or in depth, are as short as their cells, so that their work has no bound: they must stop
/// when told.
pub const STEPPED: [&str; 2] = ["HydraulicPipe", "Weathering"];

/// Longest time for which ice flows before it erodes, in years.
const BRIEF_ICE_YR: f64 = 20.0;

/// Gives `Glacial` one of its steps of erosion, after a short time: what ice and debris do later depends on the last bit.
pub fn one_step_of_ice(instance: &mut Instance) {
    if instance.node.id == "Glacial" {
        let params = &mut instance.params;
        let share = params.read::<f64>("duration") / params.read::<i64>("steps").max(1) as f64;
        let years = params.read::<f64>("relaxation").min(BRIEF_ICE_YR);
        params.set("duration", ParamValue::Float(share));
        params.set("steps", ParamValue::Int(1));
        params.set("relaxation", ParamValue::Float(years));
    }
}

/// Worlds of 16 x 16 cells: of 1 m, the smallest and the largest that a file may have.
#[must_use]
pub fn extreme_worlds() -> [World; 3] {
    [16.0, 16.0 * World::LEAST_CELL_M, World::MOST_SIDE_M].map(|side| World { size: [side; 2], ..world(16) })
}

fn changed(node: &'static Node, name: String, values: &[(&'static str, ParamValue)]) -> Case {
    Case { name, ..set(example(node), values) }
}

/// A case with other parameter values.
#[must_use]
pub fn set(mut case: Case, values: &[(&'static str, ParamValue)]) -> Case {
    for (param, value) in values {
        case.graph.instance_mut(case.node).params.set(param, value.clone());
    }
    case
}

/// All values of a choice or a switch; empty for other kinds of parameters.
#[must_use]
pub fn options(kind: &Kind) -> Vec<ParamValue> {
    match kind {
        Kind::Choice { options, .. } => options.iter().map(|(name, _)| ParamValue::Choice(name)).collect(),
        Kind::Bool { .. } => vec![ParamValue::Bool(false), ParamValue::Bool(true)],
        _ => Vec::new(),
    }
}

/// Values of a parameter that differ from each other and from those in examples.
#[must_use]
pub fn others(kind: &Kind) -> Vec<ParamValue> {
    match kind {
        Kind::Float { soft: [low, high], .. } => {
            [0.3, 0.8].map(|share| ParamValue::Float(low + share * (high - low))).to_vec()
        }
        Kind::Int { soft: [low, high], .. } => vec![ParamValue::Int(*low), ParamValue::Int(*high)],
        Kind::Seed { .. } => vec![ParamValue::Seed(77)],
        Kind::Point { hard: [low, high], .. } => {
            let within = |v: f64| v.clamp(*low, *high);
            vec![ParamValue::Point([within(3000.0), within(9000.0)]), ParamValue::Point([within(20.0), within(60.0)])]
        }
        Kind::Curve { .. } => vec![ParamValue::Curve(vec![[0.0, 3.0], [300.0, 5.0], [900.0, 4.0]])],
        Kind::Path { .. } => vec![ParamValue::Path(vec![[1000.0, 9000.0], [7000.0, 8000.0], [15000.0, 12000.0]])],
        Kind::Waypoints { .. } => {
            let high = Waypoint { height: Some(800.0), width: Some(300.0), ..Waypoint::new([7000.0, 8000.0]) };
            let ends = [[1000.0, 9000.0], [15000.0, 12000.0]].map(Waypoint::new);
            vec![ParamValue::Waypoints(ends.to_vec()), ParamValue::Waypoints(vec![ends[0], high, ends[1]])]
        }
        Kind::Stops { default } => {
            let turned = default.iter().rev().map(|stop| stop.colour);
            let stops = default.iter().zip(turned).map(|(stop, colour)| Stop { at: stop.at + 10.0, colour });
            vec![ParamValue::Stops(stops.collect())]
        }
        kind @ (Kind::Choice { .. } | Kind::Bool { .. }) => options(kind),
        Kind::Layers { .. } => {
            let hard = Layer { thickness: 150.0, hardness: 4.0, repose: 60.0, ..Layer::USUAL };
            vec![ParamValue::Layers(vec![hard]), ParamValue::Layers(vec![Layer::USUAL, hard])]
        }
        Kind::Strokes { .. } | Kind::File => Vec::new(),
    }
}

/// The example with the defaults of all parameters except files, and wires at required inputs only; if no input is
/// required, with the wires of the example.
///
/// # Panics
/// When the example has a problem.
#[must_use]
pub fn plain(node: &'static Node) -> Case {
    let mut case = example(node);
    let needs = node.inputs.iter().any(|input| input.fallback == Fallback::Required);
    for (position, input) in node.inputs.iter().enumerate() {
        if needs && input.fallback != Fallback::Required && case.graph.source(case.node, position).is_some() {
            case.graph.disconnect(case.node, position);
        }
    }
    let instance = case.graph.instance_mut(case.node);
    instance.constants.fill(None);
    for spec in node.specs().into_iter().filter(|spec| spec.kind != Kind::File) {
        instance.params.set(spec.name, spec.kind.default_value());
    }
    Case { name: "plain".into(), ..case }
}

/// The example with test terrain at every input that accepts it.
///
/// # Panics
/// When the example has a problem.
#[must_use]
pub fn wired(node: &'static Node) -> Case {
    let mut case = example(node);
    for (position, input) in node.inputs.iter().enumerate() {
        if case.graph.source(case.node, position).is_some() {
            continue;
        }
        let ports = ["other", "mask", "flow.lake_depth", "strata.strata", "path.lines"]
            .map(|port| case.graph.port(port).expect("a test node"));
        if let Some(port) = ports.into_iter().find(|port| input.ty.accepts(case.graph.output_type(*port))) {
            case.graph.connect(port, case.node, input.name).expect("the types fit");
        }
    }
    Case { name: "wired".into(), ..case }
}

/// All outputs of a case over the whole of a world.
///
/// # Errors
/// The evaluator's error.
pub fn evaluate(case: &Case, world: World, threads: usize) -> Result<Vec<Value>, EvalError> {
    evaluate_window(case, Window::whole(world), threads)
}

/// All outputs of a case over a window.
///
/// # Errors
/// The evaluator's error.
pub fn evaluate_window(case: &Case, window: Window, threads: usize) -> Result<Vec<Value>, EvalError> {
    let evaluator = Evaluator::new(EvaluatorOptions {
        store: Arc::new(Store::new(0, None)),
        threads: NonZero::new(threads),
        ..EvaluatorOptions::default()
    })?;
    evaluator.values(&case.graph, &data_folder(), &case.outputs(), window)
}

/// The inputs of a case over a window, as passed to its kernel.
///
/// # Panics
/// When the sources of the inputs fail.
#[must_use]
pub fn inputs(case: &Case, window: Window) -> Vec<InputValue> {
    // cases share their terrain
    static EVALUATOR: LazyLock<Evaluator> =
        LazyLock::new(|| Evaluator::new(EvaluatorOptions::default()).expect("an evaluator"));
    let value =
        |port: Port| EVALUATOR.values(&case.graph, &data_folder(), &[port], window).expect("an input").remove(0);
    let instance = case.graph.instance(case.node);
    let declared = instance.node.inputs.iter().enumerate();
    declared
        .map(|(position, input)| match (case.graph.source(case.node, position), input.fallback) {
            (Some(port), _) => InputValue::Value(value(port)),
            (None, Fallback::Constant { default, .. }) => {
                InputValue::Constant(instance.constants[position].unwrap_or(default))
            }
            (None, _) => InputValue::Absent,
        })
        .collect()
}

/// The folder that examples read files from.
#[must_use]
pub fn data_folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("data")
}
