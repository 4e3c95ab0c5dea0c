//! Every kernel for the GPU is within its tolerance of the CPU.

use orograph_graph::{
    Boundary, Edge, Fallback, Field, InputValue, Outputs, ParamValue, Reach, Value, Wanted, Window, World, gpu::Passes,
};
use orograph_nodes::gpu::GpuOptions;
use orograph_tests::{
    Case, STEPPED, cases, example,
    gpu::{compare, distance, field, nodes, nudge, open, run},
    inputs, one_step_of_ice,
};

use crate::chains::Draw;

/// Random parameters of each node besides the cases of all nodes.
const RANDOM: u32 = 4;
/// Longest simulated time of nodes whose steps are as short as their cells, in seconds per metre of a cell.
const BRIEF: f64 = 2.0;
/// A world with an odd number of cells along both sides.
fn odd() -> World {
    World { size: [61.0 * 268.0, 47.0 * 268.0], cells: [61, 47], seed: 7, ..World::default() }
}

fn one_cell() -> World {
    World { size: [16.0; 2], cells: [1; 2], seed: 7, ..World::default() }
}

/// The whole of a world of odd size, one with other sides, a part of it for nodes that can compute one, and a
/// world of one cell.
fn windows(case: &Case) -> Vec<Window> {
    let mut windows = vec![Window::whole(odd()), Window::whole(one_cell())];
    // all kinds of sides
    let boundary = Boundary { west: Edge::Periodic, east: Edge::Periodic, north: Edge::Wall, south: Edge::Base };
    windows.push(Window::whole(World { size: [33.0 * 40.0, 29.0 * 40.0], cells: [33, 29], boundary, ..odd() }));
    let boundary = Boundary { west: Edge::Base, east: Edge::Open, north: Edge::Periodic, south: Edge::Periodic };
    windows.push(Window::whole(World { size: [23.0 * 40.0, 31.0 * 40.0], cells: [23, 31], boundary, ..odd() }));
    if !matches!(case.kind().reach, Reach::World) {
        windows.push(Window { world: odd(), origin: [13, 5], cells: [37, 29] });
    }
    windows
}

/// The cases of all nodes, and some with random parameters and constants.
fn all_cases(node: &'static orograph_graph::Node) -> Vec<Case> {
    let mut all = cases(node);
    for seed in 0..RANDOM {
        let (mut case, mut draw) = (example(node), Draw(seed * 977 + 3));
        for spec in node.specs() {
            if let Some(value) = draw.value(&spec.kind) {
                case.graph.instance_mut(case.node).params.set(spec.name, value);
            }
        }
        for (position, input) in node.inputs.iter().enumerate() {
            if let Fallback::Constant { soft: [low, high], .. } = input.fallback {
                let value = low + draw.share() * (high - low);
                case.graph.instance_mut(case.node).constants[position] = Some(value);
            }
        }
        case.name = format!("random {seed}");
        all.push(case);
    }
    let kernel = node.gpu.expect("a kernel for the GPU");
    all.retain(|case| (kernel.covers)(&case.graph.instance(case.node).params));
    all
}

/// The case, with a few steps of a node whose steps are as short as its cells, and one step of a node that has a number
/// of them: later ones depend on the last bit of it.
fn brief(mut case: Case, window: Window) -> Case {
    one_step_of_ice(case.graph.instance_mut(case.node));
    if STEPPED.contains(&case.kind().id) {
        let params = &mut case.graph.instance_mut(case.node).params;
        let duration = params.read::<f64>("duration").min(BRIEF * window.cell_m());
        params.set("duration", ParamValue::Float(duration));
    }
    case
}

/// Whether a kernel makes steps, each of which starts from what the one before has rounded.
fn is_stepped(node: &orograph_graph::Node) -> bool {
    node.gpu.is_some_and(|kernel| matches!(kernel.passes, Passes::Stepped(_)))
}

/// How far the CPU's output moves when half of the samples of its inputs are one bit larger: a storm with random
/// parameters may hang on the last bit within a few steps, and cards round products and sums at once.
fn by_last_bit(case: &Case, given: &[InputValue], window: Window, output: &orograph_graph::Output) -> f64 {
    let odd = |cell: usize| orograph_graph::mix(cell as u32) & 1 == 1;
    let by_cpu = |inputs: Vec<InputValue>| {
        let mut outputs = (case.kind().cpu)(&case.job(inputs, window)).expect("the kernel runs");
        field(&mut outputs, output.name)
    };
    let at = case.kind().output_index(output.name).expect("an output");
    let tolerance = &case.kind().gpu.expect("a kernel for the GPU").tolerance[at];
    let (plain, nudged) = (by_cpu(given.to_vec()), by_cpu(given.iter().map(|input| nudge(input, odd)).collect()));
    distance(nudged.samples(), plain.samples(), 0.0, tolerance).most
}

/// Results are poisoned with NaN first, so that a sample that a kernel does not write is found.
fn check(options: &GpuOptions, test: &str) {
    let Some(gpu) = open(test, options) else { return };
    let mut wrong = Vec::new();
    for node in nodes() {
        let (mut compared, mut nudged) = (0, 0);
        for case in all_cases(node) {
            // the largest magnitudes of the outputs in any world so far: that of a single cell may be small by chance
            let mut ranges = vec![0.0_f64; node.outputs.len()];
            for window in windows(&case) {
                let case = brief(case.clone(), window);
                let given = inputs(&case, window);
                let Some(distances) = compare(&gpu, &case, &given, window) else { continue };
                compared += distances.len();
                let tolerances = node.gpu.expect("a kernel for the GPU").tolerance;
                for (((output, distance), range), tolerance) in
                    node.outputs.iter().zip(distances).zip(&mut ranges).zip(tolerances)
                {
                    *range = range.max(distance.range);
                    let allowed = distance.allowed.max(tolerance.absolute + tolerance.relative * *range);
                    if distance.most <= allowed {
                        continue;
                    }
                    if is_stepped(node) && distance.most <= 2.0 * by_last_bit(&case, &given, window, output) {
                        nudged += 1;
                    } else {
                        let (id, output, name, cells) = (node.id, output.name, &case.name, window.cells);
                        wrong.push(format!("{id}.{output}, {name}, {cells:?}: {distance:?}"));
                    }
                }
            }
        }
        assert!(compared > 0, "{} was never compared", node.id);
        assert!(20 * nudged <= compared, "{}: {nudged} of {compared} outputs hang on the last bit", node.id);
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_kernel_is_within_its_tolerance_and_writes_all_samples() {
    check(&GpuOptions { poison: true, ..GpuOptions::default() }, "parity");
}

/// The workgroups of graphics cards give the same bytes as those of a driver in software, on the same device.
#[test]
fn workgroups_of_any_size_give_the_same_bytes() {
    let plain = GpuOptions { workgroup: Some(64), ..GpuOptions::default() };
    let wide = GpuOptions { workgroup: Some(256), poison: true, ..GpuOptions::default() };
    let (Some(wide), Some(plain)) = (open("workgroups", &wide), open("workgroups", &plain)) else {
        return;
    };
    let window = Window::whole(World { cells: [301, 29], size: [301.0 * 20.0, 29.0 * 20.0], ..odd() });
    for node in nodes() {
        let case = brief(example(node), window);
        if !(node.gpu.expect("a kernel").covers)(&case.graph.instance(case.node).params) {
            continue;
        }
        let given = inputs(&case, window);
        let [mut wide, mut plain] =
            [&wide, &plain].map(|gpu| run(gpu, &case, &given, window, Wanted::ALL).expect("the kernel runs"));
        for output in node.outputs {
            assert!(take(&mut wide, output.name) == take(&mut plain, output.name), "{}.{}", node.id, output.name);
        }
    }
}

/// A binding of 64 KiB holds a fraction of the raster: passes run in bands, or the kernel is left to the CPU.
#[test]
fn bands_give_the_same_bytes() {
    let options = GpuOptions { poison: true, largest_binding: Some(64 << 10), ..GpuOptions::default() };
    let (Some(narrow), Some(wide)) = (open("bands", &options), open("bands", &GpuOptions::default())) else { return };
    let world = World { size: [67.0 * 20.0, 901.0 * 20.0], cells: [67, 901], seed: 7, ..World::default() };
    let window = Window::whole(world);
    let mut in_bands = 0;
    for node in nodes() {
        let case = brief(example(node), window);
        if !(node.gpu.expect("a kernel").covers)(&case.graph.instance(case.node).params) {
            continue;
        }
        let given = inputs(&case, window);
        let job = case.job(given.clone(), window);
        let ran = orograph_graph::Backend::run(&*narrow, node, &job).expect("no failure");
        let Some(mut banded) = ran else {
            let said = job.warnings.take().join("; ");
            assert!(said.contains("larger than the graphics device can bind"), "{}: {said}", node.id);
            continue;
        };
        in_bands += 1;
        let mut whole = run(&wide, &case, &given, window, Wanted::ALL).expect("the kernel runs");
        for output in node.outputs {
            assert!(take(&mut banded, output.name) == take(&mut whole, output.name), "{}.{}", node.id, output.name);
        }
    }
    assert!(in_bands > 0);
}

fn take(outputs: &mut Outputs, name: &str) -> Value {
    let value = outputs.take(name).expect("an output");
    value.fetch().expect("the device gives it back");
    value
}

/// With the limits that every WebGPU device has, each kernel runs, or is left to the CPU with the reason.
#[test]
fn the_least_limits_are_enough_or_the_reason_is_said() {
    let options = GpuOptions { plain_limits: true, ..GpuOptions::default() };
    let Some(gpu) = open("least limits", &options) else { return };
    let window = Window::whole(odd());
    for node in nodes() {
        let case = brief(example(node), window);
        if !(node.gpu.expect("a kernel").covers)(&case.graph.instance(case.node).params) {
            continue;
        }
        let job = case.job(inputs(&case, window), window);
        let ran = orograph_graph::Backend::run(&*gpu, node, &job).expect("no failure");
        let said = job.warnings.take().join("; ");
        assert_eq!(ran.is_none(), said.contains("buffers, and the device has 8"), "{}: {said}", node.id);
    }
}

/// Only the requested output is given, with the same bytes.
#[test]
fn outputs_alone_have_the_same_bytes() {
    let Some(gpu) = open("outputs alone", &GpuOptions { poison: true, ..GpuOptions::default() }) else { return };
    let window = Window::whole(odd());
    for node in nodes().into_iter().filter(|node| node.outputs.len() > 1) {
        let case = brief(example(node), window);
        if !(node.gpu.expect("a kernel").covers)(&case.graph.instance(case.node).params) {
            continue;
        }
        let given = inputs(&case, window);
        let mut all = run(&gpu, &case, &given, window, Wanted::ALL).expect("the kernel runs");
        for (at, output) in node.outputs.iter().enumerate() {
            let mut one = run(&gpu, &case, &given, window, Wanted::NONE.with(at)).expect("the kernel runs");
            assert!(take(&mut one, output.name) == take(&mut all, output.name), "{}.{}", node.id, output.name);
            assert_eq!(one.into_iter_named().count(), 0, "{} gives what nobody wants", node.id);
        }
    }
}

/// Samples that are not numbers, which the evaluator never passes on, end a kernel as they do on the CPU: with results.
#[test]
fn samples_that_are_not_numbers_break_nothing() {
    let Some(gpu) = open("not numbers", &GpuOptions::default()) else { return };
    let window = Window::whole(odd());
    for node in nodes().into_iter().filter(|node| !node.inputs.is_empty()) {
        let case = brief(example(node), window);
        if !(node.gpu.expect("a kernel").covers)(&case.graph.instance(case.node).params) {
            continue;
        }
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let given: Vec<InputValue> = inputs(&case, window)
                .into_iter()
                .map(|input| match input {
                    InputValue::Value(Value::Field(field)) => {
                        let mut samples = field.samples().to_vec();
                        samples.iter_mut().step_by(7).for_each(|v| *v = bad);
                        InputValue::Value(Field::with_planes(window, field.planes(), samples).into())
                    }
                    other => other,
                })
                .collect();
            let outputs = run(&gpu, &case, &given, window, Wanted::ALL).expect("the kernel ends");
            for (name, value) in outputs.into_iter_named() {
                let Some(field) = value.as_field() else { continue };
                let is_finite = field.samples().iter().all(|v| v.is_finite());
                // faults come to the host, where the evaluator finds them
                assert!(is_finite || field.host().is_some(), "{}.{name} hides {bad}", node.id);
            }
        }
    }
}
