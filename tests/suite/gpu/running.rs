//! Graphs on the GPU: what stays on the device, what happens when it fails, and what the store keeps.

use std::{path::Path, sync::Arc};

use orograph_graph::{
    Backend, Cancel, Cpu, Document, Evaluation, Evaluator, EvaluatorOptions, Event, Graph, Node, Port, PortType,
    Request, Store, Value, Window, World,
    gpu::{GpuKernel, Passes, Shader, Slot, Tolerance},
};
use orograph_nodes::gpu::{Gpu, GpuOptions};
use orograph_tests::gpu::open;

/// Hills with ridges on them: two generators, and sums of both.
const CHAIN: &str = r#"(
    nodes: {
        "hills": Perlin(wavelength: "5 km", amplitude: "600 m"),
        "other": Perlin(wavelength: "2 km", amplitude: "200 m", seed: 5),
        "sum": Combine(a: "hills", b: "other"),
        "half": Combine(a: "sum", b: 0.5, mode: multiply),
        "last": Combine(a: "half", b: "hills", mode: max),
    },
    outputs: { "last": "last" },
)"#;

fn graph(source: &str) -> Graph {
    Document::parse(source.to_owned(), &orograph_nodes::registry()).graph().clone()
}

fn window(cells: u32) -> Window {
    Window::whole(World { size: [16_384.0; 2], cells: [cells; 2], seed: 7, ..World::default() })
}

fn evaluator(backend: Arc<dyn Backend>, store: &Arc<Store>) -> Evaluator {
    let store = Arc::clone(store);
    Evaluator::new(EvaluatorOptions { backend, store, ..EvaluatorOptions::default() }).expect("threads start")
}

/// What an evaluation gives and tells.
struct Ran {
    value: Value,
    warnings: Vec<String>,
    /// The names of nodes with the backends that computed them.
    backends: Vec<(String, &'static str)>,
}

fn ran(evaluator: &Evaluator, graph: &Graph, end: &str, window: Window, on: impl Fn(&Event) + Sync) -> Ran {
    let requests = [Request { port: graph.port(end).expect("exists"), window }];
    let evaluation = Evaluation { graph, folder: Path::new(""), requests: &requests, byproducts: &[] };
    let told = std::sync::Mutex::new(Vec::new());
    let events = |event: Event| {
        on(&event);
        told.lock().expect("no panic").push(event);
    };
    let mut values = evaluator.evaluate(&evaluation, &Cancel::default(), &events);
    let mut ran = Ran { value: values.remove(0).expect("a value"), warnings: Vec::new(), backends: Vec::new() };
    for event in told.into_inner().expect("no panic") {
        match event {
            Event::Warning { message, .. } => ran.warnings.push(message),
            Event::NodeFinished { name, backend, .. } => ran.backends.push((name.to_string(), backend)),
            _ => {}
        }
    }
    ran
}

fn store() -> Arc<Store> {
    Arc::new(Store::new(1 << 30, None))
}

fn most_apart(a: &Value, b: &Value) -> f32 {
    let [a, b] = [a, b].map(|value| value.as_field().expect("a raster").samples());
    a.iter().zip(b).fold(0.0, |most, (a, b)| most.max((a - b).abs()))
}

fn by_cpu(graph: &Graph, end: &str, window: Window) -> Value {
    ran(&evaluator(Arc::new(Cpu), &store()), graph, end, window, |_| ()).value
}

/// Between kernels on the device nothing comes to the host; only the delivered value does.
#[test]
fn a_chain_stays_on_the_device() {
    let Some(gpu) = open("chain", &GpuOptions::default()) else { return };
    let (graph, window, store) = (graph(CHAIN), window(96), store());
    let evaluator = evaluator(Arc::clone(&gpu) as Arc<dyn Backend>, &store);
    let ran = ran(&evaluator, &graph, "last", window, |_| ());
    assert_eq!(ran.warnings, Vec::<String>::new());
    assert!(ran.backends.len() == 5 && ran.backends.iter().all(|(_, backend)| *backend == "gpu"), "{:?}", ran.backends);
    assert!(ran.value.as_field().is_some_and(|field| field.host().is_some()), "what is delivered is on the host");
    assert!(most_apart(&ran.value, &by_cpu(&graph, "last", window)) < 0.01);
    assert!(gpu.held() >= 5 * 96 * 96 * 4, "the values of the chain are on the device: {}", gpu.held());
}

/// With a store that both backends used, results of the CPU keep their keys and bytes.
#[test]
fn results_of_the_cpu_keep_their_bytes_in_a_store_that_both_used() {
    let Some(gpu) = open("one store", &GpuOptions::default()) else { return };
    let (graph, window) = (graph(CHAIN), window(64));
    let alone = by_cpu(&graph, "last", window);
    let folder = tempfile::tempdir().expect("a folder");
    let disk = orograph_graph::StoreFolder {
        folder: folder.path().to_owned(),
        budget: 1 << 30,
        worth: std::time::Duration::ZERO,
        trust: orograph_graph::Trust::Own,
    };
    let keep = || Arc::new(Store::new(1 << 30, Some(disk.clone())));
    let key = |evaluator: &Evaluator, end: &str| {
        let port: Port = graph.port(end).expect("exists");
        evaluator.key(&graph, Path::new(""), port, window).expect("a key")
    };
    let shared = keep();
    let (on_gpu, on_cpu) =
        (evaluator(Arc::clone(&gpu) as Arc<dyn Backend>, &shared), evaluator(Arc::new(Cpu), &shared));
    let first = ran(&on_gpu, &graph, "last", window, |_| ());
    let second = ran(&on_cpu, &graph, "last", window, |_| ());
    assert!(second.backends.len() == 5 && second.backends.iter().all(|(_, backend)| *backend == "cpu"));
    assert!(second.value == alone, "the bytes of the CPU");
    for end in ["hills", "last"] {
        assert_ne!(key(&on_gpu, end), key(&on_cpu, end));
    }
    // another run of the program finds both on disk
    let again = keep();
    let (on_gpu, on_cpu) = (evaluator(gpu, &again), evaluator(Arc::new(Cpu), &again));
    assert!(ran(&on_cpu, &graph, "last", window, |_| ()).value == alone);
    assert!(ran(&on_gpu, &graph, "last", window, |_| ()).value == first.value);
}

/// A device that is lost after the first node: the CPU computes the graph, and nothing is lost.
#[test]
fn a_lost_device_loses_nothing() {
    let Some(gpu) = open("lost device", &GpuOptions::default()) else { return };
    let (graph, window) = (graph(CHAIN), window(96));
    let evaluator = evaluator(Arc::clone(&gpu) as Arc<dyn Backend>, &store());
    let lose = |event: &Event| {
        if matches!(event, Event::NodeFinished { name, .. } if &**name == "sum") {
            gpu.lose();
        }
    };
    let found = ran(&evaluator, &graph, "last", window, lose);
    assert!(found.value == by_cpu(&graph, "last", window), "the bytes of the CPU");
    assert!(found.backends.iter().any(|(_, backend)| *backend == "gpu"), "{:?}", found.backends);
    assert!(found.backends.iter().any(|(_, backend)| *backend == "cpu"), "{:?}", found.backends);
    let node = graph.instance(graph.find("sum").expect("exists"));
    assert!(!gpu.supports(node.node, &node.params), "a lost device is not used again");
}

/// Values beyond the budget go to the host, and come back when they are read.
#[test]
fn the_device_keeps_its_budget() {
    let raster = 128 * 128 * 4;
    let Some(gpu) = open("budget", &GpuOptions { budget: Some(3 * raster), ..GpuOptions::default() }) else { return };
    let (graph, window) = (graph(CHAIN), window(128));
    let evaluator = evaluator(Arc::clone(&gpu) as Arc<dyn Backend>, &store());
    let most = std::sync::atomic::AtomicU64::new(0);
    let look = |event: &Event| {
        if matches!(event, Event::NodeFinished { .. }) {
            most.fetch_max(gpu.held(), std::sync::atomic::Ordering::Relaxed);
        }
    };
    let found = ran(&evaluator, &graph, "last", window, look);
    assert_eq!(found.warnings, Vec::<String>::new());
    assert!(most_apart(&found.value, &by_cpu(&graph, "last", window)) < 0.01);
    // small buffers of numbers come besides, and the inputs of a kernel that runs stay
    let most = most.into_inner();
    assert!(most <= 4 * raster, "{most}");
}

/// A world that the memory of the device does not hold: what does not fit is computed on the CPU, with the reason, and
/// a smaller world runs on the device again.
#[test]
fn a_world_larger_than_the_device_is_left_to_the_cpu() {
    let raster = |cells: u64| cells * cells * 4;
    let Some(gpu) = open("memory", &GpuOptions { memory: Some(raster(200)), ..GpuOptions::default() }) else { return };
    let graph = graph(CHAIN);
    let evaluator = evaluator(Arc::clone(&gpu) as Arc<dyn Backend>, &store());
    // two rasters of 128 x 128 cells have room, and none of 256 x 256
    let small = ran(&evaluator, &graph, "hills", window(128), |_| ());
    assert_eq!((small.warnings.len(), small.backends[0].1), (0, "gpu"));
    let large = ran(&evaluator, &graph, "last", window(256), |_| ());
    assert!(most_apart(&large.value, &by_cpu(&graph, "last", window(256))) < 0.01);
    let said = large.warnings.join("; ");
    assert!(said.contains("computed on the CPU: the graphics device has too little memory; close other"), "{said}");
    assert!(large.backends.iter().all(|(_, backend)| *backend == "cpu"), "{:?}", large.backends);
    let small = ran(&evaluator, &graph, "other", window(128), |_| ());
    assert_eq!((small.warnings.len(), small.backends[0].1), (0, "gpu"));
    assert!(gpu.held() <= raster(200));
}

static BROKEN: Node = Node {
    id: "Broken",
    category: "test",
    outputs: &[orograph_graph::Output::gives("height", PortType::Height, "Elevation.")],
    cpu: |job| Ok(orograph_graph::Outputs::one("height", orograph_graph::Field::constant(job.window(), 12.0))),
    gpu: Some(&GpuKernel {
        shaders: &[&Shader {
            name: "test/broken",
            source: "@compute @workgroup_size(64) fn main() { out_height[0] = checked(unknown); }",
            library: &[],
            values: &[],
            slots: &[Slot::output("height")],
        }],
        passes: Passes::POINT,
        tolerance: &[Tolerance::ROUNDING],
        ..GpuKernel::DEFAULT
    }),
    ..Node::DEFAULT
};

/// A shader that the driver refuses: the CPU computes the node, a warning says why, and other nodes run on the device.
#[test]
fn a_refused_shader_is_left_to_the_cpu() {
    let Some(gpu) = open("refused shader", &GpuOptions::default()) else { return };
    let mut graph = Graph::default();
    graph.add(orograph_graph::Instance::new("broken", &BROKEN)).expect("a new name");
    let perlin = orograph_nodes::registry().get("Perlin").expect("a node");
    graph.add(orograph_graph::Instance::new("hills", perlin)).expect("a new name");
    let evaluator = evaluator(gpu, &store());
    for _ in 0..2 {
        let found = ran(&evaluator, &graph, "broken", window(16), |_| ());
        assert_eq!(found.value.as_field().and_then(|field| field.range(0)), Some((12.0, 12.0)));
        let said = found.warnings.join("; ");
        assert!(said.contains("computed on the CPU: the graphics driver refuses a shader: `test/broken`"), "{said}");
        assert!(said.contains("unknown") && !said.contains('\n'), "{said}");
    }
    let hills = ran(&evaluator, &graph, "hills", window(16), |_| ());
    assert_eq!((hills.backends[0].1, hills.warnings.len()), ("gpu", 0));
}

/// Two devices: values of one reach the other by way of the host.
#[test]
fn values_go_from_one_device_to_another() {
    let options = GpuOptions::default();
    let (Some(one), Some(other)) = (open("two devices", &options), open("two devices", &options)) else { return };
    let (graph, window) = (graph(CHAIN), window(48));
    let (one, other): (Arc<Gpu>, Arc<Gpu>) = (one, other);
    let store = store();
    let sum = ran(&evaluator(one, &store), &graph, "sum", window, |_| ()).value;
    // both have the same keys, as they are devices of one adapter; the second finds the results of the first
    let last = ran(&evaluator(other, &store), &graph, "last", window, |_| ());
    assert!(last.backends.iter().any(|(name, _)| name == "half"), "{:?}", last.backends);
    assert!(most_apart(&last.value, &by_cpu(&graph, "last", window)) < 0.01 && sum.as_field().is_some());
}

/// A cancelled evaluation ends, and the next one gives the result.
#[test]
fn a_cancelled_run_leaves_the_device_usable() {
    let Some(gpu) = open("cancel", &GpuOptions::default()) else { return };
    let (graph, window) = (graph(CHAIN), window(64));
    let evaluator = evaluator(gpu, &store());
    let requests = [Request { port: graph.port("last").expect("exists"), window }];
    let evaluation = Evaluation { graph: &graph, folder: Path::new(""), requests: &requests, byproducts: &[] };
    let cancel = Cancel::default();
    let stop = |event: Event| {
        if matches!(event, Event::NodeStarted { .. }) {
            cancel.cancel();
        }
    };
    let stopped = evaluator.evaluate(&evaluation, &cancel, &stop);
    assert!(matches!(stopped[0], Err(orograph_graph::EvalError::Cancelled)), "{stopped:?}");
    let found = ran(&evaluator, &graph, "last", window, |_| ());
    assert!(most_apart(&found.value, &by_cpu(&graph, "last", window)) < 0.01);
}
