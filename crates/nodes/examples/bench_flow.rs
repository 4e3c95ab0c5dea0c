//! Times flow routing and river incision on a raw terrain, and writes what they found, for comparison with other
//! programs: see `tests/peers/README.md`.
//!
//! `bench_flow TERRAIN SIDE REPEATS OUT`: TERRAIN is a square of SIDE x SIDE little-endian f32, cells of 30 m. Prints
//! one line per kernel: its name, the shortest time and the mean processor time in seconds. Threads are those of
//! `RAYON_NUM_THREADS`. Processor time comes from `/proc`, so Linux is needed.

use std::{error::Error, path::Path, time::Instant};

use orograph_graph::{
    Boundary, Cancel, Edge, Fallback, Field, InputValue, Job, Node, NodeError, ParamValue, ParamValues, Value,
    Warnings, Window, World,
};
use orograph_nodes::{
    erosion::stream_power,
    hydrology::{
        engine::{Depressions, Drainage, Grid, Spread, receivers, spread},
        flow,
    },
};

const CELL_M: f64 = 30.0;
/// Steps of a run of river incision, and the length of each.
const STEPS: u32 = 5;
const STEP_YR: f64 = 1e4;
/// Exponents n and m, and the erodibility.
const LAWS: [(f64, f64, f64); 3] = [(1.0, 0.45, 1e-5), (1.5, 0.6, 3e-6), (2.0, 0.9, 1e-6)];

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().collect();
    let [_, terrain, side, repeats, out] = &args[..] else {
        return Err("usage: bench_flow TERRAIN SIDE REPEATS OUT".into());
    };
    let (side, repeats, out) = (side.parse::<u32>()?, repeats.parse::<usize>()?, Path::new(out));
    let bytes = std::fs::read(terrain)?;
    let samples: Vec<f32> =
        bytes.chunks_exact(4).map(|bytes| f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])).collect();
    let size_m = f64::from(side) * CELL_M;
    let world = World { size: [size_m; 2], cells: [side; 2], boundary: Boundary::all(Edge::Base), ..World::default() };
    let window = Window::whole(world);
    if samples.len() != window.len() {
        return Err(format!("{terrain} has {} samples, not {side} x {side}", samples.len()).into());
    }
    let height = Field::new(window, samples);
    let defaults = ParamValues::defaults(&flow::NODE.specs());
    let job = job(&flow::NODE, &defaults, &height, 0.0);
    let grid = Grid::new(&window)?;

    let filled = time("fill", repeats, || fill(&job, &grid, height.samples()))?;
    write(&out.join("filled.f32"), &filled)?;
    let cells = time("route", repeats, || accumulate(&job, &grid, height.samples(), false))?;
    write(&out.join("cells.f32"), &cells)?;
    let cells = time("route_sinks", repeats, || accumulate(&job, &grid, height.samples(), true))?;
    write(&out.join("cells_sinks.f32"), &cells)?;
    for (name, how) in [("d_infinity", Spread::DInfinity), ("mfd", Spread::Freeman { exponent: 1.1 })] {
        let cells = time(name, repeats, || spread_out(&job, &grid, height.samples(), how))?;
        write(&out.join(format!("{name}.f32")), &cells)?;
    }
    for (n, m, erodibility) in LAWS {
        for (name, steps) in [("steps", STEPS), ("first", 1)] {
            let params = incision(n, m, steps);
            let job = self::job(&stream_power::NODE, &params, &height, erodibility);
            let eroded = time(&format!("{name}_n{n}"), repeats, || {
                let value = (stream_power::NODE.cpu)(&job)?.take("height");
                let height = value.and_then(|value| value.as_field().cloned());
                Ok(height.ok_or_else(|| NodeError::failed("no height"))?.into_samples())
            })?;
            write(&out.join(format!("{name}_n{n}.f32")), &eroded)?;
        }
    }
    Ok(())
}

/// A job of a node on that height, without uplift and without a limit of slopes.
fn job<'a>(node: &'static Node, params: &'a ParamValues, height: &Field, erodibility: f64) -> Job<'a> {
    let input = |input: &orograph_graph::Input| match (input.name, input.fallback) {
        ("height", _) => InputValue::Value(Value::Field(height.clone())),
        ("erodibility", _) => InputValue::Constant(erodibility),
        ("repose", _) => InputValue::Constant(90.0),
        (_, Fallback::Constant { default, .. }) => InputValue::Constant(default),
        _ => InputValue::Absent,
    };
    Job {
        node,
        params,
        inputs: node.inputs.iter().map(input).collect(),
        window: *height.window(),
        folder: std::path::PathBuf::new(),
        cancel: Cancel::default(),
        progress: &|_| {},
        warnings: Warnings::default(),
    }
}

/// The plain law.
fn incision(n: f64, m: f64, steps: u32) -> ParamValues {
    let mut params = ParamValues::defaults(&stream_power::NODE.specs());
    for (name, value) in [
        ("duration", STEP_YR * f64::from(steps)),
        ("time_step", STEP_YR),
        ("m", m),
        ("n", n),
        ("critical_area", 0.0),
        ("variation", 0.0),
    ] {
        params.set(name, ParamValue::Float(value));
    }
    params.set("receivers", ParamValue::Choice("d8"));
    params
}

fn fill(job: &Job<'_>, grid: &Grid, heights: &[f32]) -> Result<Vec<f32>, NodeError> {
    let mut codes = vec![0; grid.cells()];
    receivers::d8(job, grid, heights, &mut codes)?;
    let mut depressions = Depressions::default();
    depressions.find(job, grid, heights, &codes)?;
    let mut filled = heights.to_vec();
    depressions.fill(&mut filled);
    Ok(filled)
}

/// Number of cells that drain through each cell; with `sinks` also across depressions.
fn accumulate(job: &Job<'_>, grid: &Grid, heights: &[f32], sinks: bool) -> Result<Vec<u32>, NodeError> {
    let mut codes = vec![0; grid.cells()];
    receivers::d8(job, grid, heights, &mut codes)?;
    if sinks {
        let mut depressions = Depressions::default();
        depressions.find(job, grid, heights, &codes)?;
        depressions.carve(job, grid, &mut codes)?;
    }
    let mut cells = vec![1_u32; grid.cells()];
    Drainage::default().accumulate(job, grid, &codes, &mut cells)?;
    Ok(cells)
}

/// The same where water spreads; depressions keep theirs.
fn spread_out(job: &Job<'_>, grid: &Grid, heights: &[f32], how: Spread) -> Result<Vec<f64>, NodeError> {
    let mut codes = vec![0; grid.cells()];
    receivers::d8(job, grid, heights, &mut codes)?;
    let mut cells = vec![1.0; grid.cells()];
    spread::accumulate(job, grid, heights, &codes, how, &mut cells)?;
    Ok(cells)
}

/// Runs a kernel that many times after a first one that is not counted, and prints how long it took.
#[expect(clippy::disallowed_methods, reason = "it measures time")]
fn time<T>(name: &str, repeats: usize, kernel: impl Fn() -> Result<T, NodeError>) -> Result<T, Box<dyn Error>> {
    let mut result = kernel()?;
    let before_s = processor_s()?;
    let mut shortest_s = f64::INFINITY;
    for _ in 0..repeats.max(1) {
        let start = Instant::now();
        result = kernel()?;
        shortest_s = shortest_s.min(start.elapsed().as_secs_f64());
    }
    println!("{name} {shortest_s} {}", (processor_s()? - before_s) / repeats.max(1) as f64);
    Ok(result)
}

/// Processor time of all threads so far.
fn processor_s() -> Result<f64, Box<dyn Error>> {
    let mut nanoseconds = 0.0;
    for thread in std::fs::read_dir("/proc/self/task")? {
        let text = std::fs::read_to_string(thread?.path().join("schedstat"))?;
        nanoseconds += text.split(' ').next().unwrap_or_default().parse::<f64>()?;
    }
    Ok(nanoseconds * 1e-9)
}

fn write<T: Copy>(path: &Path, samples: &[T]) -> std::io::Result<()>
where
    f64: From<T>,
{
    let bytes: Vec<u8> = samples.iter().flat_map(|&sample| (f64::from(sample) as f32).to_le_bytes()).collect();
    std::fs::write(path, bytes)
}
