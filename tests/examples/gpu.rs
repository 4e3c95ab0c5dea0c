//! Prints the time of each kernel for the GPU at 4096 x 4096 cells, over the floor that its bytes set, and the ratio to
//! the CPU:
//!
//!     cargo run --release -p orograph-tests --example gpu [-- CELLS [NODE]]
//!
//! The device is the first of `orograph devices`; `WGPU_ADAPTER_NAME` chooses another. The bandwidth is that of
//! `Combine`, the sum of two rasters, which does nothing else. A raster has 64 MiB; on a software driver those on the
//! device come besides.

use std::time::{Duration, Instant};

use orograph_graph::{
    Backend as _, Field, InputValue, Job, Node, ParamValue, Value, Window, World,
    gpu::{Count, record},
};
use orograph_nodes::gpu::{Adapters, Gpu, GpuOptions};
use orograph_tests::{Case, STEPPED, example, gpu::nodes};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let cells: u32 = arguments.first().map_or(Ok(4096), |text| text.parse())?;
    let adapters = Adapters::find();
    let adapter = adapters.best(false).ok_or("there is no graphics driver")?;
    let gpu = Gpu::new(adapter, &GpuOptions::default())?;
    let window = Window::whole(World { size: [16_384.0; 2], cells: [cells; 2], seed: 7, ..World::default() });
    println!("{} ({}), {cells} x {cells} cells", adapter.name(), adapter.driver());
    let chosen = |node: &&'static Node| arguments.get(1).is_none_or(|id| id == node.id);
    let sum = orograph_nodes::registry().get("Combine").ok_or("there is no `Combine`")?;
    let (best, bytes, _) = measured(&gpu, sum, window)?;
    let bandwidth = bytes / best.as_secs_f64();
    println!("bandwidth of a sum of two rasters: {:.1} GB/s\n", bandwidth / 1e9);
    println!(
        "{:<14} {:>10} {:>12} {:>10} {:>10} {:>8}",
        "node", "GPU (ms)", "bytes/cell", "/ floor", "CPU (ms)", "CPU/GPU"
    );
    for node in nodes().into_iter().filter(chosen) {
        let (best, _, least) = measured(&gpu, node, window)?;
        let floor = least * window.len() as f64 / bandwidth;
        let case = brief(node, window);
        let cpu = timed(|| (node.cpu)(&job(&case, window)).map(drop))?;
        println!(
            "{:<14} {:>10.1} {:>12} {:>10.2} {:>10.1} {:>8.2}",
            node.id,
            best.as_secs_f64() * 1e3,
            least,
            best.as_secs_f64() / floor,
            cpu.as_secs_f64() * 1e3,
            cpu.as_secs_f64() / best.as_secs_f64()
        );
    }
    Ok(())
}

/// The time of a kernel with its inputs on the device, the bytes that it moves, and the least bytes per cell.
fn measured(
    gpu: &Gpu,
    node: &'static Node,
    window: Window,
) -> Result<(Duration, f64, f64), Box<dyn std::error::Error>> {
    let case = brief(node, window);
    let job = job(&case, window);
    let mut count = Count::new(&job, 0);
    record(node.gpu.ok_or("no kernel for the GPU")?, &job, &mut count)?;
    let run = || match gpu.run(node, &job)? {
        Some(_) => Ok(()),
        None => Err(orograph_graph::NodeError::failed(job.warnings.take().join("; "))),
    };
    // the first runs compile the kernel, bring its inputs to the device and measure its speed
    (0..2).try_for_each(|_| run())?;
    let best = timed(run)?;
    Ok((best, count.work().bytes as f64 * window.len() as f64, count.work().least as f64))
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

/// The shortest of three runs.
#[expect(clippy::disallowed_methods, reason = "a measurement")]
fn timed<E>(mut run: impl FnMut() -> Result<(), E>) -> Result<Duration, E> {
    let mut best = Duration::MAX;
    for _ in 0..3 {
        let start = Instant::now();
        run()?;
        best = best.min(start.elapsed());
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
