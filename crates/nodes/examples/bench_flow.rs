//! Times flow routing and river incision on a raw terrain, and writes what they found, for comparison with other
//! programs: see `tests/peers/README.md`.
//!
//! `bench_flow TERRAIN SIDE REPEATS OUT [KERNEL ...]`: TERRAIN is a square of SIDE x SIDE little-endian f32, cells of
//! 30 m. Prints one line per kernel, of all or of those named: its name, the shortest time and the median processor
//! time in seconds, and the most bytes that it held at once. Threads are those of `RAYON_NUM_THREADS`. Processor time
//! comes from `/proc`, so Linux is needed.

mod clock;

use std::{
    alloc::{GlobalAlloc, Layout, System},
    error::Error,
    path::Path,
    sync::atomic::{AtomicUsize, Ordering::Relaxed},
    time::Instant,
};

use orograph_graph::{
    Boundary, Cancel, Edge, Fallback, Field, InputValue, Job, Node, NodeError, ParamValue, ParamValues, Value,
    Warnings, Window, World,
};
use orograph_nodes::{
    erosion::stream_power,
    hydrology::flow,
    numerics::routing::{Depressions, Drainage, Grid, Spread, receivers, spread},
};

use clock::processor_s;

const CELL_M: f64 = 30.0;
/// Steps of a run of river incision, and the length of each.
const STEPS: u32 = 5;
const STEP_YR: f64 = 1e4;
/// Exponents n and m, and the erodibility.
const LAWS: [(f64, f64, f64); 3] = [(1.0, 0.45, 1e-5), (1.5, 0.6, 3e-6), (2.0, 0.9, 1e-6)];

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().collect();
    let [_, terrain, side, repeats, out, named @ ..] = &args[..] else {
        return Err("usage: bench_flow TERRAIN SIDE REPEATS OUT [KERNEL ...]".into());
    };
    let asked = |kernel: &str| named.is_empty() || named.iter().any(|name| name == kernel);
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

    if asked("fill") {
        let filled = time("fill", repeats, || fill(&job, &grid, height.samples()))?;
        write(&out.join("filled.f32"), &filled)?;
    }
    if asked("route") {
        let cells = time("route", repeats, || accumulate(&job, &grid, height.samples(), false))?;
        write(&out.join("cells.f32"), &cells)?;
    }
    if asked("route_sinks") {
        let cells = time("route_sinks", repeats, || accumulate(&job, &grid, height.samples(), true))?;
        write(&out.join("cells_sinks.f32"), &cells)?;
    }
    for (name, how) in [("d_infinity", Spread::DInfinity), ("mfd", Spread::Freeman { exponent: 1.1 })] {
        if asked(name) {
            let cells = time(name, repeats, || spread_out(&job, &grid, height.samples(), how))?;
            write(&out.join(format!("{name}.f32")), &cells)?;
        }
    }
    for (n, m, erodibility) in LAWS {
        for (name, steps) in [("steps", STEPS), ("first", 1)] {
            let name = format!("{name}_n{n}");
            if !asked(&name) {
                continue;
            }
            let params = incision(n, m, steps);
            let job = self::job(&stream_power::NODE, &params, &height, erodibility);
            let eroded = time(&name, repeats, || {
                let value = (stream_power::NODE.cpu)(&job)?.take("height");
                let height = value.and_then(|value| value.as_field().cloned());
                Ok(height.ok_or_else(|| NodeError::failed("no height"))?.into_samples())
            })?;
            write(&out.join(format!("{name}.f32")), &eroded)?;
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
        ("uplift", _) => InputValue::Constant(0.0),
        (_, Fallback::Constant { default, .. }) => InputValue::Constant(default),
        _ => InputValue::Absent,
    };
    Job {
        node,
        params,
        inputs: node.inputs.iter().map(input).collect(),
        window: *height.window(),
        wanted: orograph_graph::Wanted::ALL,
        folder: std::path::PathBuf::new(),
        cancel: Cancel::default(),
        progress: &|_| {},
        level: orograph_graph::LevelJob::default(),
        warnings: Warnings::default(),
        glimpses: None,
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
        ("headwater_area", 0.0),
        ("valley_width", 0.0),
        ("winding", 0.0),
        ("rounding", 0.0),
        ("variation", 0.0),
        ("repose_variation", 0.0),
        ("repose", 90.0),
    ] {
        params.set(name, ParamValue::Float(value));
    }
    params.set("receivers", ParamValue::Choice("d8"));
    params.set("schedule", ParamValue::Choice("full"));
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

/// Runs a kernel that many times after a first one that is not timed, and prints how long it took and the most bytes
/// that the first one held.
#[expect(clippy::disallowed_methods, reason = "it measures time")]
fn time<T>(name: &str, repeats: usize, kernel: impl Fn() -> Result<T, NodeError>) -> Result<T, Box<dyn Error>> {
    let before = Counting::restart();
    let mut result = kernel()?;
    let held = Counting::most() - before;
    let (mut shortest_s, mut processor) = (f64::INFINITY, Vec::new());
    for _ in 0..repeats.max(1) {
        let (start, before_s) = (Instant::now(), processor_s()?);
        result = kernel()?;
        shortest_s = shortest_s.min(start.elapsed().as_secs_f64());
        processor.push(processor_s()? - before_s);
    }
    processor.sort_by(f64::total_cmp);
    println!("{name} {shortest_s} {} {held}", processor[processor.len() / 2]);
    Ok(result)
}

/// The system's allocator, which counts the bytes in use and their peak.
struct Counting;

#[global_allocator]
static ALLOCATOR: Counting = Counting;
static HELD: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);

impl Counting {
    /// Resets the peak; returns the bytes in use.
    fn restart() -> usize {
        let held = HELD.load(Relaxed);
        MOST.store(held, Relaxed);
        held
    }

    /// The most that was held.
    fn most() -> usize {
        MOST.load(Relaxed)
    }

    fn add(bytes: usize) {
        MOST.fetch_max(HELD.fetch_add(bytes, Relaxed) + bytes, Relaxed);
    }
}

#[expect(unsafe_code, reason = "an allocator is unsafe to implement")]
// SAFETY: every call goes to the system's allocator as it came.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        Self::add(layout.size());
        // SAFETY: the caller's promises are those that are asked for.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        Self::add(layout.size());
        // SAFETY: as above.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        HELD.fetch_sub(layout.size(), Relaxed);
        // SAFETY: as above.
        unsafe { System.dealloc(at, layout) }
    }

    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        Self::add(size);
        HELD.fetch_sub(layout.size(), Relaxed);
        // SAFETY: as above.
        unsafe { System.realloc(at, layout, size) }
    }
}

fn write<T: Copy>(path: &Path, samples: &[T]) -> std::io::Result<()>
where
    f64: From<T>,
{
    let bytes: Vec<u8> = samples.iter().flat_map(|&sample| (f64::from(sample) as f32).to_le_bytes()).collect();
    std::fs::write(path, bytes)
}
