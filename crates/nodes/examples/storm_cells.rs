//! How similar the work of a storm is at several cell sizes: `cargo run --release -p orograph-nodes --example
//! storm_cells`.
//!
//! Without a name, `HydraulicPipe` runs on a dome with open sides, 1024 m wide unless after `--size`, on cells of 4, 2
//! and 1 m unless after `--cells 8,4,2`; `NAME=VALUE` sets a parameter or an input, and `--smooth` leaves out the
//! bumps of the dome. With the name of a graph, that graph runs with 128, 256 and 512 cells. `--keep FOLDER` writes
//! heights and changes as raw little-endian f32.
//!
//! A row has the deepest cut, as the mean over the largest of the cells and of any one cell; the means over the world
//! of what was eroded and deposited; the root mean square difference of the change from that in the next row over its
//! standard deviation, both as means over the largest cells; the share of gradients of the change within 10° of an
//! axis, weighted by their steepness, 22 % if isotropic; and the processor time.

mod clock;

use std::{error::Error, path::Path};

use orograph_graph::{
    Boundary, Cancel, Document, Edge, Evaluator, EvaluatorOptions, Fallback, Field, InputValue, Job, Kind, ParamValue,
    ParamValues, Port, Report, Value, Warnings, Window, World,
};
use orograph_nodes::{erosion::hydraulic_pipe::NODE, numerics::math, registry};

use clock::processor_s;

/// The work of a storm on some cells.
struct Storm {
    cells: usize,
    cell_m: f64,
    heights: Vec<f32>,
    changes: Vec<f32>,
    report: Report,
    spent_s: f64,
}

fn main() -> Result<(), Box<dyn Error>> {
    let (mut graphs, mut changes, mut sizes) = (Vec::new(), Vec::new(), vec![4.0, 2.0, 1.0]);
    let (mut size_m, mut smooth, mut keep) = (1024.0, false, None);
    let mut args = std::env::args().skip(1);
    while let Some(arg) = args.next() {
        let mut next = || args.next().ok_or_else(|| format!("{arg} needs a value"));
        match arg.as_str() {
            "--size" => size_m = next()?.parse()?,
            "--cells" => sizes = next()?.split(',').map(str::parse).collect::<Result<_, _>>()?,
            "--smooth" => smooth = true,
            "--keep" => keep = Some(next()?),
            _ => match arg.split_once('=') {
                Some((name, value)) => changes.push((name.to_owned(), value.to_owned())),
                None => graphs.push(arg),
            },
        }
    }
    println!("| terrain | cell | steps | deepest, mean | deepest | eroded | deposited | change | axes | time |");
    println!("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |");
    let print = |name: &str, storms: &[Storm]| -> Result<(), Box<dyn Error>> {
        storms.iter().enumerate().for_each(|(at, storm)| row(name, storm, storms.get(at + 1), storms[0].cells));
        for storm in storms {
            let Some(folder) = &keep else { break };
            for (kind, samples) in [("height", &storm.heights), ("change", &storm.changes)] {
                let bytes: Vec<u8> = samples.iter().flat_map(|sample| sample.to_le_bytes()).collect();
                std::fs::write(Path::new(folder).join(format!("{name}_{}_{kind}.f32", storm.cells)), bytes)?;
            }
        }
        Ok(())
    };
    if graphs.is_empty() {
        let storms = sizes.iter().map(|cell_m| on_dome(size_m, *cell_m, smooth, &changes));
        print("dome", &storms.collect::<Result<Vec<_>, _>>()?)?;
    }
    for name in &graphs {
        let storms = [128, 256, 512].map(|cells| of_graph(name, cells));
        print(name, &storms.into_iter().collect::<Result<Vec<_>, _>>()?)?;
    }
    Ok(())
}

/// Prints a row of the table.
fn row(name: &str, storm: &Storm, next: Option<&Storm>, coarsest: usize) {
    let coarse = means(&storm.changes, storm.cells, coarsest);
    let deepest = |changes: &[f64]| -changes.iter().copied().fold(0.0, f64::min);
    let fine: Vec<f64> = storm.changes.iter().map(|change| f64::from(*change)).collect();
    let area_m2 = (storm.cells as f64 * storm.cell_m) * (storm.cells as f64 * storm.cell_m);
    let sediment = storm.report.balance_of("sediment");
    let mean = |volume: &str| sediment.and_then(|balance| balance.get(volume)).unwrap_or(f64::NAN) / area_m2;
    let apart = next.map_or_else(String::new, |next| {
        let next = means(&next.changes, next.cells, coarsest);
        let square = |values: &mut dyn Iterator<Item = f64>| values.map(|value| value * value).sum::<f64>();
        let middle = next.iter().sum::<f64>() / next.len() as f64;
        let (difference, deviation) = (
            square(&mut next.iter().zip(&coarse).map(|(a, b)| a - b)),
            square(&mut next.iter().map(|value| value - middle)),
        );
        format!("{:.0} %", 100.0 * (difference / deviation).sqrt())
    });
    println!(
        "| {name} | {} m | {} | {:.2} m | {:.2} m | {:.4} m | {:.4} m | {apart} | {:.0} % | {:.1} s |",
        storm.cell_m,
        storm.report.get("steps").unwrap_or(f64::NAN),
        deepest(&coarse),
        deepest(&fine),
        mean("eroded"),
        mean("deposited"),
        100.0 * along_axes(&fine, storm.cells),
        storm.spent_s,
    );
}

/// Means over squares of cells.
fn means(values: &[f32], side: usize, cells: usize) -> Vec<f64> {
    let by = side / cells;
    let mean = |cell: usize| {
        let (x, y) = (cell % cells * by, cell / cells * by);
        let rows = (y..y + by).flat_map(|y| &values[y * side + x..][..by]);
        rows.map(|value| f64::from(*value)).sum::<f64>() / (by * by) as f64
    };
    (0..cells * cells).map(mean).collect()
}

/// The share of gradients within 10° of an axis, weighted by their steepness, away from the sides.
fn along_axes(changes: &[f64], side: usize) -> f64 {
    let (mut near, mut all) = (0.0, 0.0);
    let inner = (side / 40).max(1)..side - (side / 40).max(1);
    for at in inner.clone().flat_map(|j| inner.clone().map(move |i| j * side + i)) {
        let (x, y) = (changes[at + 1] - changes[at - 1], changes[at + side] - changes[at - side]);
        let steepness = (x * x + y * y).sqrt();
        all += steepness;
        if x.abs().min(y.abs()) < math::tan(10_f64.to_radians()) * x.abs().max(y.abs()) {
            near += steepness;
        }
    }
    near / all
}

/// The height of a dome without preferred directions, with bumps or without.
fn dome(x: f64, y: f64, size_m: f64, smooth: bool) -> f64 {
    let wave = |k: f64| {
        let (turn, number) = (2.399_963 * k, std::f64::consts::TAU / (60.0 + 5.0 * k));
        math::sin(number * (x * math::cos(turn) + y * math::sin(turn)) + 3.7 * k)
    };
    let (east, south) = (x / size_m - 0.5, y / size_m - 0.5);
    let from_middle = (east * east + south * south).sqrt() / 0.75;
    let bumps: f64 = if smooth { 0.0 } else { (0..30).map(|k| wave(f64::from(k))).sum() };
    400.0 + 0.15 * size_m * math::cos(0.5 * std::f64::consts::PI * from_middle) + 0.3 * bumps
}

fn on_dome(size_m: f64, cell_m: f64, smooth: bool, changes: &[(String, String)]) -> Result<Storm, Box<dyn Error>> {
    let cells = (size_m / cell_m) as u32;
    let boundary = Boundary::all(Edge::Open);
    let window = Window::whole(World { size: [size_m; 2], cells: [cells; 2], boundary, ..World::default() });
    let centres = (0..window.ny()).flat_map(|j| (0..window.nx()).map(move |i| (i, j)));
    let heights = centres.map(|(i, j)| window.centre_m(i, j)).map(|[x, y]| dome(x, y, size_m, smooth) as f32);
    let height = Field::new(window, heights.collect());
    let specs = NODE.specs();
    let mut params = ParamValues::defaults(&specs);
    for (name, text) in changes {
        let Some(spec) = specs.iter().find(|spec| spec.name == name) else { continue };
        let value = match &spec.kind {
            Kind::Choice { options, .. } => {
                let option = options.iter().find(|(option, _)| option == text);
                ParamValue::Choice(option.ok_or_else(|| format!("no option {text}"))?.0)
            }
            _ => ParamValue::Float(text.parse()?),
        };
        params.set(spec.name, value);
    }
    let input = |input: &orograph_graph::Input| match (input.name, input.fallback) {
        ("height", _) => Ok(InputValue::Value(Value::Field(height.clone()))),
        (name, Fallback::Constant { default, .. }) => {
            let change = changes.iter().find(|change| change.0 == name);
            change.map_or(Ok(InputValue::Constant(default)), |(_, text)| text.parse().map(InputValue::Constant))
        }
        _ => Ok(InputValue::Absent),
    };
    let job = Job {
        node: &NODE,
        params: &params,
        inputs: NODE.inputs.iter().map(input).collect::<Result<_, _>>()?,
        window,
        wanted: orograph_graph::Wanted::ALL,
        folder: std::path::PathBuf::new(),
        cancel: Cancel::default(),
        progress: &|_| {},
        level: orograph_graph::LevelJob::default(),
        warnings: Warnings::default(),
        glimpses: None,
    };
    let before_s = processor_s()?;
    let mut outputs = (NODE.cpu)(&job)?;
    let spent_s = processor_s()? - before_s;
    job.warnings.take().iter().for_each(|warning| eprintln!("{cell_m} m: {warning}"));
    let mut take = |name: &str| outputs.take(name).ok_or_else(|| format!("no {name}"));
    let [heights, changes] = [take("height")?, take("deposition")?].map(|value| samples(&value));
    let report = take("report")?.as_report().cloned().unwrap_or_default();
    Ok(Storm { cells: cells as usize, cell_m, heights, changes, report, spent_s })
}

fn of_graph(name: &str, cells: u32) -> Result<Storm, Box<dyn Error>> {
    let graphs = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().find(|folder| folder.join("graphs").is_dir());
    let file = graphs.ok_or("no graphs")?.join("graphs").join(format!("{name}.ron"));
    let document = Document::load(file, &registry())?;
    let (expanded, world) = (document.expand(), document.world().with_cells_along_x(cells));
    let graph = &expanded.graph;
    let storm = graph.topological().into_iter().find(|node| graph.instance(*node).node.id == NODE.id);
    let node = storm.ok_or("no storm")?;
    let output = |name: &str| NODE.outputs.iter().position(|output| output.name == name).ok_or("no such output");
    let ports = [output("height")?, output("deposition")?, output("report")?].map(|output| Port { node, output });
    let evaluator = Evaluator::new(EvaluatorOptions::default())?;
    let before_s = processor_s()?;
    let values = evaluator.values(graph, document.folder(), &ports, Window::whole(world))?;
    let spent_s = processor_s()? - before_s;
    let [heights, changes] = [0, 1].map(|at| samples(&values[at]));
    let report = values[2].as_report().cloned().unwrap_or_default();
    Ok(Storm { cells: cells as usize, cell_m: world.size[0] / f64::from(cells), heights, changes, report, spent_s })
}

fn samples(value: &Value) -> Vec<f32> {
    value.as_field().map_or_else(Vec::new, |field| field.samples().to_vec())
}
