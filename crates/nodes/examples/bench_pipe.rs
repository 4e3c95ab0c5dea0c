//! Times steps of shallow water on a raw terrain, and writes what they made of it, for comparison with other programs:
//! see `tests/peers/README.md`.
//!
//! `bench_pipe TERRAIN SIDE SECONDS REPEATS OUT [PARAMETER=VALUE ...]`: TERRAIN is a square of SIDE x SIDE
//! little-endian f32, cells of 30 m; or `-`, for waves. Prints the number of steps, the shortest time and the mean
//! processor time in seconds. Threads are those of `RAYON_NUM_THREADS`. Processor time comes from `/proc`, so Linux is
//! needed.

mod clock;

use std::{error::Error, path::Path, time::Instant};

use orograph_graph::{
    Boundary, Cancel, Edge, Fallback, Field, InputValue, Job, Kind, NodeError, Outputs, ParamValue, ParamValues, Value,
    Warnings, Window, World,
};
use orograph_nodes::{erosion::hydraulic_pipe::NODE, numerics::math};

use clock::processor_s;

const CELL_M: f64 = 30.0;

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().collect();
    let [_, terrain, side, seconds, repeats, out, changes @ ..] = &args[..] else {
        return Err("usage: bench_pipe TERRAIN SIDE SECONDS REPEATS OUT [PARAMETER=VALUE ...]".into());
    };
    let (side, repeats) = (side.parse::<u32>()?, repeats.parse::<usize>()?.max(1));
    let samples = if terrain == "-" { waves(side as usize) } else { read(Path::new(terrain))? };
    let world = World {
        size: [f64::from(side) * CELL_M; 2],
        cells: [side; 2],
        boundary: Boundary::all(Edge::Wall),
        ..World::default()
    };
    let window = Window::whole(world);
    if samples.len() != window.len() {
        return Err(format!("{terrain} has {} samples, not {side} x {side}", samples.len()).into());
    }
    let height = Field::new(window, samples);
    let specs = NODE.specs();
    let mut params = ParamValues::defaults(&specs);
    params.set("duration", ParamValue::Float(seconds.parse()?));
    for change in changes {
        let (name, text) = change.split_once('=').ok_or("a change is NAME=VALUE")?;
        let spec = specs.iter().find(|spec| spec.name == name).ok_or_else(|| format!("no parameter {name}"))?;
        let value = match &spec.kind {
            Kind::Choice { options, .. } => {
                let option = options.iter().find(|(option, _)| *option == text);
                ParamValue::Choice(option.ok_or_else(|| format!("no option {text}"))?.0)
            }
            _ => ParamValue::Float(text.parse()?),
        };
        params.set(spec.name, value);
    }
    let input = |input: &orograph_graph::Input| match (input.name, input.fallback) {
        ("height", _) => InputValue::Value(Value::Field(height.clone())),
        (_, Fallback::Constant { default, .. }) => InputValue::Constant(default),
        _ => InputValue::Absent,
    };
    let job = Job {
        node: &NODE,
        params: &params,
        inputs: NODE.inputs.iter().map(input).collect(),
        window,
        wanted: orograph_graph::Wanted::ALL,
        folder: std::path::PathBuf::new(),
        cancel: Cancel::default(),
        progress: &|_| {},
        level: orograph_graph::LevelJob::default(),
        warnings: Warnings::default(),
        glimpses: None,
    };
    let mut outputs = time(repeats, &job)?;
    for name in ["height", "water", "sediment"] {
        let value = outputs.take(name).ok_or("an output")?;
        let samples = value.as_field().ok_or("a field")?.samples();
        let bytes: Vec<u8> = samples.iter().flat_map(|sample| sample.to_le_bytes()).collect();
        std::fs::write(Path::new(out).join(format!("pipe_{name}.f32")), bytes)?;
    }
    Ok(())
}

/// Hills and valleys a kilometre apart, with smaller ones on them.
fn waves(side: usize) -> Vec<f32> {
    let at = |i: usize, j: usize| {
        let (x, y) = (i as f64 * CELL_M, j as f64 * CELL_M);
        let large = math::sin(x / 470.0) * math::cos(y / 390.0);
        (900.0 + 80.0 * large + 12.0 * math::sin(x / 97.0 + y / 71.0) + 0.01 * x) as f32
    };
    (0..side * side).map(|k| at(k % side, k / side)).collect()
}

fn read(path: &Path) -> Result<Vec<f32>, std::io::Error> {
    let bytes = std::fs::read(path)?;
    Ok(bytes.chunks_exact(4).map(|bytes| f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])).collect())
}

/// Runs the node that many times after a first run that is not counted, and prints how long it took.
#[expect(clippy::disallowed_methods, reason = "it measures time")]
fn time(repeats: usize, job: &Job<'_>) -> Result<Outputs, Box<dyn Error>> {
    let run = || (NODE.cpu)(job);
    let mut outputs: Result<Outputs, NodeError> = run();
    let mut elapsed_s = f64::INFINITY;
    let mut processor = Vec::new();
    for _ in 0..repeats {
        let (start, before_s) = (Instant::now(), processor_s()?);
        outputs = run();
        elapsed_s = elapsed_s.min(start.elapsed().as_secs_f64());
        processor.push(processor_s()? - before_s);
    }
    processor.sort_by(f64::total_cmp);
    let mut outputs = outputs?;
    let report = outputs.take("report").ok_or("a report")?;
    let steps = report.as_report().and_then(|report| report.get("steps")).ok_or("the number of steps")?;
    println!("{steps} {elapsed_s} {}", processor[processor.len() / 2]);
    Ok(outputs)
}
