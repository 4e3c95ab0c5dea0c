//! Prints the time of each kernel for the GPU at 4096 x 4096 cells, over the floor that its bytes set, and the ratio to
//! the CPU:
//!
//!     cargo run --release -p orograph-tests --example gpu [-- CELLS [NODE [WORKGROUP]]]
//!
//! The device is the first of `orograph devices`; `WGPU_ADAPTER_NAME` chooses another. Times of kernels are those of the
//! device's own clock, if it has one: from the first to the last command of each submit. Those of runs also have the
//! host's part, with inputs on the device. The bandwidth is that of `Combine`, the sum of two rasters, which does nothing
//! else. A raster has 64 MiB; on a software driver those on the device come besides. The last lines count the steps of
//! `HydraulicPipe` in a second, and time ten steps of erosion of `Glacial`, both at 1024 x 1024 cells.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use orograph_graph::{
    Backend, Field, InputValue, Job, Node, NodeError, ParamValue, Value, Wanted, Window, World,
    gpu::{Count, Work, record},
};
use orograph_nodes::gpu::{Adapters, Gpu, GpuOptions};
use orograph_tests::{Case, STEPPED, example, gpu::nodes};

type Failure = Box<dyn std::error::Error>;

/// How long a kernel runs before it is timed, and while it is.
const WARM_UP: Duration = Duration::from_millis(300);
/// No other run begins after so long.
const LONG: Duration = Duration::from_secs(2);
/// Calls of `HydraulicPipe` that are timed.
const CALLS: u32 = 400;

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let cells: u32 = arguments.first().map_or(Ok(4096), |text| text.parse())?;
    let adapters = Adapters::find();
    let adapter = adapters.best(false).ok_or("there is no graphics driver")?;
    let workgroup = arguments.get(2).map(|text| text.parse()).transpose()?;
    let gpu = Arc::new(Gpu::new(adapter, &GpuOptions { clock: true, workgroup, ..GpuOptions::default() })?);
    println!("{} ({}), {cells} x {cells} cells", adapter.name(), adapter.driver());
    let chosen = |node: &&'static Node| arguments.get(1).is_none_or(|id| id == node.id);
    let find = |id| orograph_nodes::registry().get(id).ok_or(id);
    let window = square(cells);
    let sum = measured(&gpu, find("Combine")?, window)?;
    let bandwidth = sum.work.bytes as f64 * window.len() as f64 / sum.kernel.as_secs_f64();
    println!("bandwidth of a sum of two rasters: {:.1} GB/s\n", bandwidth / 1e9);
    println!(
        "{:<14} {:>11} {:>9} {:>12} {:>9} {:>9} {:>10} {:>9}",
        "node", "kernel (ms)", "run (ms)", "bytes/cell", "/ least", "/ moved", "CPU (ms)", "CPU/run"
    );
    let on_device = |node: &&'static Node| !node.has_ports_on_host();
    for node in nodes().into_iter().filter(chosen).filter(on_device) {
        let Measured { kernel, run, work } = measured(&gpu, node, window)?;
        let floor = |bytes: u64| bytes as f64 * window.len() as f64 / bandwidth;
        let case = brief(node, window);
        let cpu = repeated(Duration::ZERO, || (node.cpu)(&job(&case, window)).map(drop))?;
        println!(
            "{:<14} {:>11.3} {:>9.2} {:>12} {:>9.2} {:>9.2} {:>10.1} {:>9.1}",
            node.id,
            kernel.as_secs_f64() * 1e3,
            run.as_secs_f64() * 1e3,
            work.least,
            kernel.as_secs_f64() / floor(work.least),
            kernel.as_secs_f64() / floor(work.bytes),
            cpu.as_secs_f64() * 1e3,
            cpu.as_secs_f64() / run.as_secs_f64()
        );
    }
    let pipe = find("HydraulicPipe")?;
    if chosen(&pipe) {
        // without the clock, which adds commands to each submit
        let plain = Arc::new(Gpu::new(adapter, &GpuOptions { workgroup, ..GpuOptions::default() })?);
        let per_second = steps_per_second(&plain, pipe, square(1024.min(cells)))?;
        println!("\nHydraulicPipe at {} cells: {per_second:.0} steps per second", 1024.min(cells));
    }
    let glacial = find("Glacial")?;
    if chosen(&glacial) {
        time_glaciers(&gpu, glacial, 1024.min(cells))?;
    }
    Ok(())
}

fn square(cells: u32) -> Window {
    Window::whole(World { size: [16_384.0; 2], cells: [cells; 2], seed: 7, ..World::default() })
}

/// The shortest times of a kernel on the device and of a run with its inputs there, and what it moves.
struct Measured {
    kernel: Duration,
    run: Duration,
    work: Work,
}

fn measured(gpu: &Gpu, node: &'static Node, window: Window) -> Result<Measured, Failure> {
    let case = brief(node, window);
    let job = job(&case, window);
    let mut count = Count::new(&job, 0);
    record(node.gpu.ok_or("no kernel for the GPU")?, &job, &mut count)?;
    let mut kernel = Duration::MAX;
    let mut once = || {
        let before = gpu.busy();
        let ran = gpu.run(node, &job)?;
        if let (Some(before), Some(after)) = (before, gpu.busy()) {
            kernel = kernel.min(after.saturating_sub(before));
        }
        ran.map(drop).ok_or_else(|| NodeError::failed(job.warnings.take().join("; ")))
    };
    // the first runs compile the kernel, bring its inputs to the device and measure its speed; a card that has had nothing
    // to do is slow for a while
    repeated(WARM_UP, &mut once)?;
    let run = repeated(WARM_UP, &mut once)?;
    Ok(Measured { kernel: kernel.min(run), run, work: count.work() })
}

/// Steps per second of an eroding storm. A call makes several, and then reads the greatest depth of water.
#[expect(clippy::disallowed_methods, reason = "a measurement")]
fn steps_per_second(gpu: &Arc<Gpu>, node: &'static Node, window: Window) -> Result<f64, Failure> {
    let mut case = example(node);
    case.graph.instance_mut(case.node).params.set("duration", ParamValue::Float(86_400.0));
    let mut job = job(&case, window);
    let output = node.output_index("report").ok_or("no report")?;
    job.wanted = Wanted::NONE;
    let mut process = Backend::begin(Arc::clone(gpu), node, &job)?.ok_or("the kernel cannot be stepped")?;
    let mut steps = |calls: u32| -> Result<f64, Failure> {
        job.wanted = Wanted::NONE;
        (0..calls).try_for_each(|_| process.step(&job))?;
        job.wanted = Wanted::NONE.with(output);
        let report = process.outputs(&job)?.take("report").ok_or("no report")?;
        let report = report.as_report().ok_or("no report")?;
        let steps = report.measures.iter().find(|measure| measure.name == "steps");
        Ok(steps.map_or(0.0, |measure| measure.value))
    };
    let before = steps(CALLS / 4)?;
    let start = Instant::now();
    let after = steps(CALLS)?;
    Ok((after - before) / start.elapsed().as_secs_f64())
}

/// Times glaciers on steep mountains with cells of 75 m, which cover two thirds of the ground.
fn time_glaciers(gpu: &Gpu, node: &'static Node, cells: u32) -> Result<(), Failure> {
    let window =
        Window::whole(World { size: [75.0 * f64::from(cells); 2], cells: [cells; 2], seed: 7, ..World::default() });
    let mut case = example(node);
    let instance = case.graph.instance_mut(case.node);
    for (name, value) in [("warming", 0.0), ("duration", 2e4), ("ice_cell", 75.0)] {
        instance.params.set(name, ParamValue::Float(value));
    }
    instance.params.set("steps", ParamValue::Int(10));
    let mut job = job(&case, window);
    let fold = |v: usize, length: usize| (v % (2 * length)).abs_diff(length) as f32 / length as f32;
    let height = |at: usize| {
        let (x, y) = (at % window.nx(), at / window.nx());
        300.0 + 700.0 * fold(x + y / 3, 61) + 500.0 * fold(y + x / 4, 43) + 200.0 * fold(2 * x + 3 * y, 37)
    };
    for (value, input) in job.inputs.iter_mut().zip(node.inputs) {
        if input.name == "height" {
            let land = Field::with_planes(window, 1, (0..window.len()).map(height).collect());
            *value = InputValue::Value(Value::Field(land));
        }
    }
    let steps = |outputs: Option<orograph_graph::Outputs>| {
        let report = outputs.and_then(|mut outputs| outputs.take("report"))?;
        report.as_report()?.get("ice_steps")
    };
    let mut found = None;
    let cpu = repeated(Duration::ZERO, || (node.cpu)(&job).map(|outputs| found = steps(Some(outputs))))?;
    println!(
        "\nGlacial at {cells} cells, CPU: {:.2} s for {:.0} steps of ice",
        cpu.as_secs_f64(),
        found.unwrap_or_default()
    );
    let before = gpu.busy().unwrap_or_default();
    let mut runs = 0;
    let device =
        repeated(Duration::ZERO, || gpu.run(node, &job).map(|outputs| (found, runs) = (steps(outputs), runs + 1)))?;
    let busy = gpu.busy().unwrap_or_default().saturating_sub(before) / runs;
    println!(
        "Glacial at {cells} cells, device: {:.2} s for {:.0} steps of ice, of which the device works {:.2} s",
        device.as_secs_f64(),
        found.unwrap_or_default(),
        busy.as_secs_f64()
    );
    Ok(())
}

/// The example of a node; of one whose steps are as short as its cells, a few steps.
fn brief(node: &'static Node, window: Window) -> Case {
    let mut case = example(node);
    if STEPPED.contains(&node.id) {
        let duration = ParamValue::Float(2.0 * window.cell_m());
        case.graph.instance_mut(case.node).params.set("duration", duration);
    }
    case
}

/// The shortest of at least three runs that take so long in all, or of fewer if they are long.
#[expect(clippy::disallowed_methods, reason = "a measurement")]
fn repeated<E>(least: Duration, mut run: impl FnMut() -> Result<(), E>) -> Result<Duration, E> {
    let (mut best, begin) = (Duration::MAX, Instant::now());
    for count in 1.. {
        let start = Instant::now();
        run()?;
        best = best.min(start.elapsed());
        let all = begin.elapsed();
        if all > LONG || (count >= 3 && all > least) {
            break;
        }
    }
    Ok(best)
}

/// A job with hills at every input that the example wires.
fn job(case: &Case, window: Window) -> Job<'_> {
    let instance = case.graph.instance(case.node);
    let declared = instance.node.inputs.iter().enumerate();
    let inputs = declared.map(|(at, input)| match (case.graph.source(case.node, at), input.fallback) {
        (Some(port), _) => {
            let planes = case.graph.output_type(port).planes().unwrap_or(1);
            InputValue::Value(Value::Field(hills(window, planes)))
        }
        (None, orograph_graph::Fallback::Constant { default, .. }) => {
            InputValue::Constant(instance.constants[at].unwrap_or(default))
        }
        (None, _) => InputValue::Absent,
    });
    case.job(inputs.collect(), window)
}

fn hills(window: Window, planes: usize) -> Field {
    let (nx, count) = (window.nx(), planes * window.len());
    let height = |at: usize| {
        let (x, y) = ((at % nx) as f32, (at / nx) as f32);
        700.0 + 0.25 * ((x * 0.37) % 913.0 - (y * 0.21) % 577.0)
    };
    Field::with_planes(window, planes, (0..count).map(height).collect())
}
