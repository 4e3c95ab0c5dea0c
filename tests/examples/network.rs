//! Compares the rivers of a graph at two cell sizes: `cargo run --release -p orograph-tests --example network --
//! GRAPH.ron OUTPUT CELLS`, where OUTPUT is a drainage area in m² and CELLS the coarser number of cells per side.
//!
//! The trunks of the coarse world are its cells that drain more than a threshold. The example prints the percentage of
//! them that have a trunk of the fine world, at half the cell size, in the same place, within one coarse cell, and
//! within two; and the percentage expected at random, with the fine trunks moved east by a quarter of the world.

use std::{error::Error, path::Path};

use orograph_graph::{Document, Evaluator, EvaluatorOptions, Window};
use orograph_nodes::registry;

/// Thresholds as fractions of the world's area.
const SHARES: [f64; 3] = [3e-4, 1e-3, 1e-2];

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let (Some(graph), Some(output), Some(cells)) = (args.next(), args.next(), args.next()) else {
        return Err("usage: network GRAPH.ron OUTPUT CELLS".into());
    };
    let cells: u32 = cells.parse()?;
    let document = Document::load(Path::new(&graph), &registry())?;
    let port = document.outputs().iter().find(|declared| declared.name == output).ok_or("no such output")?.port;
    let folder = Path::new(&graph).parent().ok_or("no folder")?;
    let evaluator = Evaluator::new(EvaluatorOptions::default())?;
    let area = |cells: u32| -> Result<(Vec<f32>, usize, f64), Box<dyn Error>> {
        let world = document.world().with_cells_along_x(cells);
        world.check()?;
        let window = Window::whole(world);
        let values = evaluator.values(document.graph(), folder, &[port], window)?;
        let field = values[0].as_field().ok_or("the output is no raster")?;
        Ok((field.plane(0).to_vec(), window.nx(), world.size[0] * world.size[1]))
    };
    let (coarse, nx, world_m2) = area(cells)?;
    let (fine, fine_nx, _) = area(2 * cells)?;

    println!("{graph}, {cells} and {} cells a side: share of coarse trunk cells near a fine trunk", 2 * cells);
    println!("{:>12} {:>8} {:>8} {:>8} {:>8} {:>10}", "drains", "cells", "same", "1 cell", "2 cells", "random, 1");
    for share in SHARES {
        let threshold = (share * world_m2) as f32;
        let near = |at: usize, shift: usize, reach: usize| {
            let (i, j) = ((at % nx + shift) % nx, at / nx);
            let rows = 2 * j.saturating_sub(reach)..(2 * (j + reach) + 2).min(fine.len() / fine_nx);
            let columns = 2 * i.saturating_sub(reach)..(2 * (i + reach) + 2).min(fine_nx);
            rows.into_iter().any(|j| fine[j * fine_nx..][columns.clone()].iter().any(|&area| area > threshold))
        };
        let trunks: Vec<usize> = (0..coarse.len()).filter(|at| coarse[*at] > threshold).collect();
        let found = |shift: usize, reach: usize| {
            let count = trunks.iter().filter(|at| near(**at, shift, reach)).count();
            format!("{:.1} %", 100.0 * count as f64 / trunks.len().max(1) as f64)
        };
        println!(
            "{:>8.2} km² {:>8} {:>8} {:>8} {:>8} {:>10}",
            f64::from(threshold) / 1e6,
            trunks.len(),
            found(0, 0),
            found(0, 1),
            found(0, 2),
            found(nx / 4, 1)
        );
    }
    Ok(())
}
