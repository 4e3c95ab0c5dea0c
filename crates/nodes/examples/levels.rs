//! How similar a terrain is at several cell sizes, and what it costs: `cargo run --release -p orograph-nodes --example
//! levels`, with names of graphs after `--` for some, `--full` to pass all time on the cells asked for, and
//! `--keep FOLDER` to write the heights as raw little-endian f32.
//!
//! For each pair of cell counts, with the finer raster as means over the coarser cells: the root mean square difference
//! of heights over their standard deviation, the difference of means, of mean slopes, and the smaller of the two shares
//! of trunk cells (above the sea, which drain ten times `headwater_area` and ten coarse cells) of one within one cell of
//! a trunk of the other. The processor time is that of the whole graph on one thread, with an empty store and then with
//! one that has the results on fewer cells; both must give the same bytes.

use std::{error::Error, num::NonZero, path::Path};

use orograph_graph::{Document, Evaluator, EvaluatorOptions, ParamValue, Port, Window};
use orograph_nodes::registry;

const GRAPHS: [&str; 11] =
    ["alps", "hello", "ridge", "two_ranges", "ridges", "belts", "carve_dem", "fault", "ridged", "perlin", "analytical"];
const COUNTS: [u32; 4] = [128, 256, 512, 1024];
const PAIRS: [(u32, u32); 4] = [(128, 1024), (256, 512), (256, 1024), (512, 1024)];

/// A terrain on some cells.
struct Terrain {
    cells: usize,
    heights: Vec<f64>,
    areas: Vec<f64>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let (mut names, mut full, mut keep) = (Vec::new(), false, None);
    let mut args = std::env::args().skip(1);
    while let Some(arg) = args.next() {
        match arg.as_str() {
            "--full" => full = true,
            "--keep" => keep = args.next(),
            name => names.push(name.to_owned()),
        }
    }
    if names.is_empty() {
        names = GRAPHS.map(str::to_owned).to_vec();
    }
    println!("| graph | cells | heights | mean | slope | trunks | µs per cell | after fewer |");
    println!("| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: |");
    for name in &names {
        let document = document(name)?;
        let expanded = document.expand();
        let (mut graph, world) = ((*expanded.graph).clone(), document.world());
        let all = graph.topological().into_iter();
        let rivers: Vec<_> = all.filter(|node| graph.instance(*node).node.id == "StreamPower").collect();
        let last = *rivers.last().ok_or("no rivers")?;
        let headwaters_m2 = match graph.instance(last).params.get("headwater_area") {
            Some(&ParamValue::Float(area)) => area,
            _ => return Err("no headwater area".into()),
        };
        if full {
            rivers.iter().for_each(|node| graph.instance_mut(*node).params.set("schedule", ParamValue::Choice("full")));
        }
        let height = expanded.outputs.iter().find(|output| output.name == "height").ok_or("no `height`")?.port;
        let ports = [height, Port { node: last, output: 1 }];
        let mut found: Vec<(Terrain, [f64; 2])> = Vec::new();
        let evaluator = || Evaluator::new(EvaluatorOptions { threads: NonZero::new(1), ..EvaluatorOptions::default() });
        let keeping = evaluator()?;
        for cells in COUNTS {
            let window = Window::whole(world.with_cells_along_x(cells));
            let timed = |evaluator: &Evaluator| -> Result<_, Box<dyn Error>> {
                let before = processor_s();
                let values = evaluator.values(&graph, document.folder(), &ports, window)?;
                Ok((values, 1e6 * (processor_s() - before) / f64::from(cells) / f64::from(cells)))
            };
            let ((values, alone_us), (again, after_us)) = (timed(&evaluator()?)?, timed(&keeping)?);
            if values != again {
                return Err(format!("{name}: {cells} cells differ after fewer").into());
            }
            let spent_us = [alone_us, after_us];
            let [heights, areas] = [0, 1].map(|at| -> Vec<f64> {
                values[at]
                    .as_field()
                    .map_or_else(Vec::new, |field| field.samples().iter().map(|v| f64::from(*v)).collect())
            });
            if let Some(folder) = &keep {
                let bytes: Vec<u8> = heights.iter().flat_map(|height| (*height as f32).to_le_bytes()).collect();
                std::fs::write(Path::new(folder).join(format!("{name}_{cells}.f32")), bytes)?;
            }
            found.push((Terrain { cells: cells as usize, heights, areas }, spent_us));
        }
        let of = |cells: u32| found.iter().find(|(terrain, _)| terrain.cells == cells as usize).ok_or("no such cells");
        for (coarse, fine) in PAIRS {
            let ((a, _), (b, [alone_us, after_us])) = (of(coarse)?, of(fine)?);
            let [heights, mean, slope] = compare(a, b, world.size[0]);
            let cell_m = world.size[0] / f64::from(coarse);
            let least_m2 = (10.0 * headwaters_m2).max(10.0 * cell_m * cell_m);
            let trunks = near(a, b, least_m2, world.sea_level.unwrap_or(f64::NEG_INFINITY));
            println!(
                "| {name} | {coarse}, {fine} | {heights:.1} % | {mean:+.2} % | {slope:+.1} % | {trunks:.1} % | {alone_us:.2} | {after_us:.2} |"
            );
        }
    }
    Ok(())
}

fn document(name: &str) -> Result<Document, Box<dyn Error>> {
    let graphs = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().find(|folder| folder.join("graphs").is_dir());
    let graphs = graphs.ok_or("no graphs")?.join("graphs");
    let (kind, method) = match name {
        "ridged" => ("Ridged()", "implicit"),
        "analytical" => ("Ridged()", "analytical"),
        "perlin" => ("Perlin()", "implicit"),
        _ => return Ok(Document::load(graphs.join(format!("{name}.ron")), &registry())?),
    };
    let registry = registry();
    let version = registry.get("StreamPower").ok_or("no rivers")?.version;
    let text = format!(
        "(format: 1, nodes: {{ \"base\": {kind}, \"rivers\": StreamPower(version: {version}, height: \"base\", \
         uplift: 0.001, method: {method}) }}, outputs: {{ \"height\": \"rivers\" }})"
    );
    Ok(Document::parse_in(text, graphs, &registry))
}

/// Means over squares of cells.
fn means(values: &[f64], side: usize, cells: usize) -> Vec<f64> {
    let by = side / cells;
    let mean = |cell: usize| {
        let (x, y) = (cell % cells * by, cell / cells * by);
        let rows = (y..y + by).flat_map(|y| &values[y * side + x..][..by]);
        rows.sum::<f64>() / (by * by) as f64
    };
    (0..cells * cells).map(mean).collect()
}

/// The difference of heights over their deviation, of means and of mean slopes, in percent.
fn compare(coarse: &Terrain, fine: &Terrain, size_m: f64) -> [f64; 3] {
    let cells = coarse.cells;
    let fine = means(&fine.heights, fine.cells, cells);
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let squares = |values: &mut dyn Iterator<Item = f64>| values.map(|v| v * v).sum::<f64>() / fine.len() as f64;
    let middle = mean(&fine);
    let deviation = squares(&mut fine.iter().map(|v| v - middle)).sqrt();
    let apart = squares(&mut fine.iter().zip(&coarse.heights).map(|(a, b)| a - b)).sqrt();
    let slope = |values: &[f64]| {
        let across_m = 2.0 * size_m / cells as f64;
        let inner = (cells + 1..cells * (cells - 1)).filter(|at| (1..cells - 1).contains(&(at % cells)));
        let steep = |at: usize| {
            let (east, south) = (values[at + 1] - values[at - 1], values[at + cells] - values[at - cells]);
            (east * east + south * south).sqrt() / across_m
        };
        inner.map(steep).sum::<f64>()
    };
    let lowest = fine.iter().copied().fold(f64::INFINITY, f64::min).min(0.0);
    [
        100.0 * apart / deviation,
        100.0 * (mean(&coarse.heights) - middle) / (middle - lowest),
        100.0 * (slope(&coarse.heights) / slope(&fine) - 1.0),
    ]
}

/// The share of trunk cells of either terrain that have one of the other in the same place or beside it, in percent.
fn near(coarse: &Terrain, fine: &Terrain, least_m2: f64, sea_level_m: f64) -> f64 {
    let cells = coarse.cells;
    let trunks = [coarse, fine].map(|terrain| {
        let (by, mut found) = (terrain.cells / cells, vec![false; cells * cells]);
        for (at, (area_m2, height_m)) in terrain.areas.iter().zip(&terrain.heights).enumerate() {
            let cell = at / terrain.cells / by * cells + at % terrain.cells / by;
            found[cell] |= *area_m2 >= least_m2 && *height_m >= sea_level_m;
        }
        found
    });
    let share = |of: &[bool], among: &[bool]| {
        let is_near = |at: usize| {
            let (x, y) = (at % cells, at / cells);
            let columns = x.saturating_sub(1)..(x + 2).min(cells);
            (y.saturating_sub(1)..(y + 2).min(cells)).any(|y| among[y * cells..][columns.clone()].contains(&true))
        };
        let all: Vec<usize> = (0..of.len()).filter(|at| of[*at]).collect();
        100.0 * all.iter().filter(|at| is_near(**at)).count() as f64 / all.len().max(1) as f64
    };
    share(&trunks[0], &trunks[1]).min(share(&trunks[1], &trunks[0]))
}

/// Processor time of this process in seconds, to a hundredth. Returns 0 where the system does not tell.
fn processor_s() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after_name = text.rsplit(')').next().unwrap_or_default();
    let ticks = |at: usize| after_name.split_whitespace().nth(at).and_then(|v| v.parse::<f64>().ok()).unwrap_or(0.0);
    (ticks(11) + ticks(12)) / 100.0
}
