//! Random chains of processes: what each moves is accounted for in the ledger of its report.

use std::collections::BTreeSet;

use orograph_graph::{
    Boundary, Edge, EvalError, Evaluator, EvaluatorOptions, Fallback, Graph, Instance, Node, ParamValue, Port, Window,
    World,
};
use orograph_nodes::registry;
use orograph_tests::{LAND, data_folder};

use super::chains::Draw;

const CELLS: u32 = 48;
const CHAINS: u32 = 24;
/// Processes of a chain.
const LINKS: usize = 3;

/// The largest error of a balance, as a fraction of what moved. Most processes count in double precision; the others
/// state what single precision leaves.
fn bound(node: &Node, material: &str) -> f64 {
    match (node.id, material) {
        ("HydraulicPipe", _) => 1e-5,
        // heights, debris and what slides are in single precision
        ("Thermal" | "Weathering", _) => 1e-5,
        // debris is spread over the ice in single precision
        ("Glacial", "till") => 1e-6,
        _ => 1e-9,
    }
}

/// The processes: what makes a report of a terrain and changes it.
fn processes() -> Vec<&'static Node> {
    let registry = registry();
    let nodes = registry.nodes().iter().copied().filter(|node| {
        let gives = |name: &str| node.outputs.iter().any(|output| output.name == name);
        gives("height") && gives("report")
    });
    nodes.collect()
}

/// Adds a process with random parameters that reads the terrain, and random numbers for inputs without a wire.
fn add(graph: &mut Graph, node: &'static Node, land: Port, draw: &mut Draw) -> Port {
    let mut instance = Instance::new(format!("n{}", graph.indices().count()), node);
    for spec in node.specs() {
        // methods that trace water back do not conserve what it carries, and say so
        let value = if spec.name == "transport" { None } else { draw.value(&spec.kind) };
        if let Some(value) = value {
            instance.params.set(spec.name, value);
        }
    }
    // short runs: this is about accounts
    for (name, most) in [("steps", 12), ("count", 12)] {
        if let Some(ParamValue::Int(steps)) = instance.params.get(name).cloned() {
            instance.params.set(name, ParamValue::Int(steps.min(most)));
        }
    }
    match node.id {
        "HydraulicPipe" => instance.params.set("duration", ParamValue::Float(600.0)),
        // years for which ice flows in each step
        "Glacial" => instance.params.set("relaxation", ParamValue::Float(5.0)),
        // thirty steps instead of up to ten thousand
        "StreamPower" => {
            let number = |name: &str| match instance.params.get(name) {
                Some(ParamValue::Float(value)) => Some(*value),
                _ => None,
            };
            let least = number("duration").unwrap_or(2e6) / 30.0;
            let step = number("time_step").unwrap_or(0.0).max(least);
            instance.params.set("time_step", ParamValue::Float(step));
        }
        _ => {}
    }
    let at = graph.add(instance).expect("a new name");
    for input in node.inputs.iter().filter(|input| input.fallback == Fallback::Required) {
        graph.connect(land, at, input.name).expect("a terrain");
    }
    graph.port(&format!("{}.height", graph.instance(at).name)).expect("an output")
}

#[test]
fn what_processes_move_is_accounted_for() {
    let nodes = processes();
    let (mut found, mut faults) = (BTreeSet::new(), Vec::new());
    for number in 0..CHAINS {
        let mut draw = Draw(number);
        let side = draw.one(&[4_000.0, 16_384.0, 60_000.0]);
        let edge = draw.one(&[Edge::Base, Edge::Open, Edge::Wall, Edge::Inland, Edge::Periodic]);
        // water finds a way out in the south
        let north = if edge == Edge::Periodic { Edge::Open } else { edge };
        let boundary = Boundary { west: edge, east: edge, south: Edge::Base, north };
        let world = World { size: [side; 2], cells: [CELLS; 2], seed: number, boundary, ..World::default() };
        let mut graph = Graph::default();
        let mut land = Port { node: graph.add(Instance::new(LAND.id, &LAND)).expect("a new name"), output: 0 };
        let mut reports = Vec::new();
        for _ in 0..LINKS {
            let node = draw.one(&nodes);
            land = add(&mut graph, node, land, &mut draw);
            let name = &graph.instance(land.node).name;
            reports.push((node, graph.port(&format!("{name}.report")).expect("an output")));
        }
        let evaluator = Evaluator::new(EvaluatorOptions::default()).expect("threads");
        let ports: Vec<Port> = reports.iter().map(|(_, port)| *port).collect();
        let values = match evaluator.values(&graph, &data_folder(), &ports, Window::whole(world)) {
            Ok(values) => values,
            // combinations that make no sense may be refused, with a remedy
            Err(EvalError::Node { hint: Some(_), .. }) => continue,
            Err(error) => {
                faults.push(format!("chain {number}: {error}"));
                continue;
            }
        };
        for ((node, _), value) in reports.iter().zip(&values) {
            let report = value.as_report().expect("a report");
            for balance in &report.ledger {
                found.insert(node.id);
                let bound = bound(node, &balance.material);
                if balance.error.is_nan() || balance.error.abs() > bound {
                    faults.push(format!("chain {number}: {} {balance:?}", node.id));
                }
            }
        }
    }
    faults.extend(nodes.iter().filter(|node| !found.contains(node.id)).map(|node| format!("no ledger of {}", node.id)));
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
