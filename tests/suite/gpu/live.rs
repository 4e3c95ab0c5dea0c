//! Processes on the GPU, step by step.

use std::{path::PathBuf, sync::Arc};

use orograph_graph::{
    Cancel, Document, Evaluation, Evaluator, EvaluatorOptions, Graph, Live, LiveNode, ParamValue, Prefer, Request,
    Stroke, Tool, Value, Wanted, Window, World,
};
use orograph_nodes::gpu::{Gpu, GpuOptions};
use orograph_tests::gpu::{distance, open};

/// Rain on hills.
const STORM: &str = r#"(
    nodes: {
        "hills": Perlin(wavelength: "600 m", amplitude: "80 m"),
        "storm": HydraulicPipe(version: 2, height: "hills", rain: 120, duration: 240, acceleration: 500, courant: 0.1, width: 50),
    },
    outputs: { "storm": "storm" },
)"#;

const SIDE: u32 = 64;

fn graph() -> Graph {
    Document::parse(STORM.to_owned(), &orograph_nodes::registry()).graph().clone()
}

fn world() -> World {
    World { size: [10.0 * f64::from(SIDE); 2], cells: [SIDE; 2], seed: 7, ..World::default() }
}

/// One evaluator with the CPU alone, and one that also has the device.
fn evaluators(gpu: &Arc<Gpu>) -> [Evaluator; 2] {
    let with = |options| Evaluator::new(options).expect("threads start");
    let on_device = EvaluatorOptions { backend: Arc::clone(gpu) as _, ..EvaluatorOptions::default() };
    [with(EvaluatorOptions::default()), with(on_device)]
}

fn storm_of(graph: &Graph) -> LiveNode {
    let node = graph.find("storm").expect("exists");
    LiveNode { graph: graph.clone(), folder: PathBuf::new(), node, world: world() }
}

fn begin(evaluator: &Evaluator, graph: &Graph) -> Live {
    Live::begin(evaluator, storm_of(graph), &Cancel::default(), &|_| {}).expect("begins")
}

fn step(live: &mut Live, evaluator: &Evaluator, steps: usize) {
    for _ in 0..steps {
        live.step(evaluator, &Cancel::default()).expect("goes on");
    }
}

fn outputs(live: &mut Live, evaluator: &Evaluator, wanted: Wanted) -> Vec<Option<Value>> {
    live.outputs(evaluator, wanted, &Cancel::default()).expect("there")
}

fn follow(live: &mut Live, evaluator: &Evaluator, graph: &Graph) -> bool {
    live.follow(evaluator, storm_of(graph), &Cancel::default()).expect("no fault")
}

/// The graph with these strokes, as painting makes it.
fn painted(strokes: &[Stroke]) -> Graph {
    let mut graph = graph();
    let node = graph.find("storm").expect("exists");
    graph.instance_mut(node).params.set("strokes", ParamValue::Strokes(strokes.to_vec()));
    graph
}

fn stroke(tool: Tool, strength: f64, time: f64, points: &[[f64; 2]]) -> Stroke {
    Stroke { tool, radius: 90.0, strength, hardness: 0.5, time, points: points.to_vec() }
}

/// Compares the current outputs of both within the tolerances of the kernel, the report by its balances.
fn compare(lives: [(&mut Live, &Evaluator); 2]) {
    let [found, expected] = lives.map(|(live, evaluator)| outputs(live, evaluator, Wanted::ALL));
    let node = orograph_nodes::registry().get("HydraulicPipe").expect("a node");
    let kernel = node.gpu.expect("a kernel");
    // the terrain is up to 80 m high
    let range = 80.0;
    for (((found, expected), tolerance), output) in found.iter().zip(&expected).zip(kernel.tolerance).zip(node.outputs)
    {
        match (found.as_ref().expect("wanted"), expected.as_ref().expect("wanted")) {
            (Value::Field(found), Value::Field(expected)) => {
                let distance = distance(found.samples(), expected.samples(), range, tolerance);
                assert!(distance.most <= distance.allowed, "{}: {distance:?}", output.name);
            }
            (Value::Report(found), Value::Report(expected)) => {
                for name in ["water", "sediment"] {
                    let [found, expected] = [found, expected].map(|report| report.balance_of(name).expect("a balance"));
                    let most = found.gained.iter().map(|amount| amount.volume).fold(1e-9, f64::max);
                    for (found, expected) in
                        found.gained.iter().chain(&found.lost).zip(expected.gained.iter().chain(&expected.lost))
                    {
                        let apart = (found.volume - expected.volume).abs();
                        assert!(apart <= 2e-5 * most, "{name}, {}: {apart} of {most}", found.name);
                    }
                    assert!(found.error.abs() < 1e-4, "{name}: {}", found.error);
                }
            }
            other => panic!("neither a field nor a report: {other:?}"),
        }
    }
}

/// Strokes are painted on the way, seen at once and taken back; each picture is that of the CPU, and the end is that of
/// an evaluation on the device, to the last bit.
#[test]
fn a_live_run_on_the_device_is_that_of_the_cpu() {
    let Some(gpu) = open("live run", &GpuOptions { poison: true, ..GpuOptions::default() }) else { return };
    let [on_cpu, on_gpu] = evaluators(&gpu);
    let (mut cpu, mut device) = (begin(&on_cpu, &graph()), begin(&on_gpu, &graph()));
    let mut strokes = Vec::new();
    let both = |cpu: &mut Live, device: &mut Live| {
        let [there, here] = [cpu.moment().now, device.moment().now];
        assert!((there - here).abs() < 1e-3, "{there} {here}");
        compare([(device, &on_gpu), (cpu, &on_cpu)]);
    };
    both(&mut cpu, &mut device);
    let lines: [&[[f64; 2]]; 4] = [
        // across the northern side, whose land beyond it is raised with it
        &[[100.0, 10.0], [500.0, 10.0]],
        &[[320.0, 320.0]],
        &[[320.0, 200.0], [320.0, 500.0]],
        &[[300.0, 300.0]],
    ];
    let tools = [(Tool::Raise, 12.0), (Tool::Rain, 900.0), (Tool::Lower, 6.0), (Tool::Erase, 0.7)];
    for ((tool, strength), line) in tools.into_iter().zip(lines) {
        step(&mut cpu, &on_cpu, 2);
        step(&mut device, &on_gpu, 2);
        both(&mut cpu, &mut device);
        let before = strokes.clone();
        // the clocks of both differ in the last bits
        let time = device.moment().time().max(cpu.moment().time());
        strokes.push(stroke(tool, strength, time, line));
        for strokes in [&strokes, &before, &strokes] {
            let graph = painted(strokes);
            assert!(follow(&mut cpu, &on_cpu, &graph) && follow(&mut device, &on_gpu, &graph), "no restart");
            both(&mut cpu, &mut device);
        }
        // taken back after it was seen, before it has acted: the ground is there as before
        if tool == Tool::Raise {
            let graph = painted(&before);
            assert!(follow(&mut cpu, &on_cpu, &graph) && follow(&mut device, &on_gpu, &graph));
            step(&mut cpu, &on_cpu, 1);
            step(&mut device, &on_gpu, 1);
            both(&mut cpu, &mut device);
            let time = device.moment().time().max(cpu.moment().time());
            strokes = before;
            strokes.push(stroke(tool, strength, time, line));
            let graph = painted(&strokes);
            assert!(follow(&mut cpu, &on_cpu, &graph) && follow(&mut device, &on_gpu, &graph));
        }
    }
    assert!(!follow(&mut device, &on_gpu, &painted(&strokes[1..])), "it has happened");
    assert_eq!(outputs(&mut device, &on_gpu, Wanted::NONE.with(1)).iter().flatten().count(), 1, "only what is shown");
    while !device.moment().is_over() {
        step(&mut device, &on_gpu, 1);
    }
    assert_eq!(device.warnings(), [""; 0]);
    let ended = outputs(&mut device, &on_gpu, Wanted::ALL);
    let (graph, window) = (painted(&strokes), Window::whole(world()));
    for (output, ended) in orograph_nodes::registry().get("HydraulicPipe").expect("a node").outputs.iter().zip(ended) {
        let port = graph.port(&format!("storm.{}", output.name)).expect("exists");
        let evaluation =
            Evaluation { graph: &graph, folder: "".as_ref(), requests: &[Request { port, window }], byproducts: &[] };
        let batch = on_gpu.evaluate(&evaluation, &Cancel::default(), &|_| {}).remove(0).expect("runs");
        assert!(Some(batch) == ended, "{}", output.name);
    }
}

/// The device is lost on the way: the CPU says so, catches up, and ends as if it had run alone.
#[test]
fn a_live_run_survives_a_lost_device() {
    let Some(gpu) = open("lost live run", &GpuOptions::default()) else { return };
    let [on_cpu, on_gpu] = evaluators(&gpu);
    let mut live = begin(&on_gpu, &graph());
    step(&mut live, &on_gpu, 3);
    let strokes = [stroke(Tool::Raise, 12.0, live.moment().time(), &[[320.0, 320.0]])];
    assert!(follow(&mut live, &on_gpu, &painted(&strokes)));
    step(&mut live, &on_gpu, 3);
    let now = live.moment().now;
    gpu.lose();
    // a picture is asked for while the run is paused
    let seen = outputs(&mut live, &on_gpu, Wanted::NONE.with(0));
    assert!(seen[0].is_some() && live.is_behind());
    let said = live.warnings().join("; ");
    assert!(said.contains("computed on the CPU: the graphics device failed"), "{said}");
    while live.is_behind() {
        step(&mut live, &on_gpu, 1);
    }
    assert!(live.moment().now >= now && !live.moment().is_over());
    while !live.moment().is_over() {
        step(&mut live, &on_gpu, 1);
    }
    let mut alone = begin(&on_cpu, &painted(&strokes));
    while !alone.moment().is_over() {
        step(&mut alone, &on_cpu, 1);
    }
    assert!(outputs(&mut live, &on_gpu, Wanted::ALL) == outputs(&mut alone, &on_cpu, Wanted::ALL));
}

/// A node that asks for the CPU runs there, and one that asks for a device on that, where others do not.
#[test]
fn a_live_run_is_where_the_node_asks_for() {
    let Some(gpu) = open("asked for", &GpuOptions::default()) else { return };
    let evaluator = |options| Evaluator::new(options).expect("threads start");
    let usual = evaluator(EvaluatorOptions { backend: Arc::clone(&gpu) as _, ..EvaluatorOptions::default() });
    let asked = evaluator(EvaluatorOptions { device: Arc::clone(&gpu) as _, ..EvaluatorOptions::default() });
    let alone = evaluator(EvaluatorOptions::default());
    let ended = |evaluator: &Evaluator, hills: Prefer, storm: Prefer| {
        let mut graph = graph();
        for (name, prefers) in [("hills", hills), ("storm", storm)] {
            let node = graph.find(name).expect("exists");
            graph.instance_mut(node).prefers = prefers;
        }
        let mut live = begin(evaluator, &graph);
        while !live.moment().is_over() {
            step(&mut live, evaluator, 1);
        }
        outputs(&mut live, evaluator, Wanted::NONE.with(1)).swap_remove(1).expect("wanted")
    };
    let (cpu, device) = (ended(&alone, Prefer::Auto, Prefer::Auto), ended(&usual, Prefer::Cpu, Prefer::Auto));
    assert!(cpu != device);
    assert!(ended(&usual, Prefer::Cpu, Prefer::Cpu) == cpu);
    assert!(ended(&asked, Prefer::Auto, Prefer::Device) == device);
    assert!(ended(&asked, Prefer::Auto, Prefer::Auto) == cpu);
}
