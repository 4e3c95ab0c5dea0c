//! How far the land of one cell size is from that of cells half as wide.

use orograph_graph::Field;

use crate::{Case, evaluate, world};

/// Cells along a side of the squares that smoothed results are means of, of the coarser raster.
const SMOOTH: usize = 8;

/// Of one output: root mean squares of the difference, over the standard deviation of the finer result.
#[derive(Clone, Copy, Debug)]
pub struct Difference {
    /// Name of the output.
    pub output: &'static str,
    /// Of the coarser result and the means of the finer one over its cells.
    pub cells: f64,
    /// Of means of both over squares of eight of the coarser cells a side: what is left is no detail, but other land.
    pub smoothed: f64,
}

/// The rasters among a case's outputs with so many cells a side of the tests' world and with twice as many.
///
/// # Errors
/// What the evaluator says.
pub fn differences(case: &Case, cells: u32) -> Result<Vec<Difference>, String> {
    let run = |cells| evaluate(case, world(cells), 2).map_err(|error| format!("{}: {error}", case.name));
    let (coarse, fine) = (run(cells)?, run(2 * cells)?);
    let pairs = coarse.iter().zip(&fine).zip(case.kind().outputs);
    let fields = pairs.filter_map(|((coarse, fine), output)| Some((coarse.as_field()?, fine.as_field()?, output)));
    let difference = |(coarse, fine, output): (&Field, &Field, &orograph_graph::Output)| Difference {
        output: output.name,
        cells: relative(&means(coarse, 1), &means(fine, 2)),
        smoothed: relative(&means(coarse, SMOOTH), &means(fine, 2 * SMOOTH)),
    };
    Ok(fields.map(difference).collect())
}

/// The means of squares of so many cells a side, plane after plane.
fn means(field: &Field, side: usize) -> Vec<f64> {
    let (nx, ny) = (field.window().nx(), field.window().ny());
    let mut means = Vec::with_capacity(field.samples().len() / (side * side));
    for plane in (0..field.planes()).map(|plane| field.plane(plane)) {
        for j in (0..ny).step_by(side) {
            for i in (0..nx).step_by(side) {
                let rows = (j..j + side).map(|j| &plane[j * nx + i..][..side]);
                means.push(rows.flatten().map(|v| f64::from(*v)).sum::<f64>() / (side * side) as f64);
            }
        }
    }
    means
}

/// Root mean square of the difference over the standard deviation of `fine`.
fn relative(coarse: &[f64], fine: &[f64]) -> f64 {
    let count = fine.len() as f64;
    let mean = fine.iter().sum::<f64>() / count;
    let variance = fine.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / count;
    let error = coarse.iter().zip(fine).map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / count;
    // a field that is the same everywhere has no spread to compare with
    if variance > 0.0 { (error / variance).sqrt() } else { error.sqrt() }
}
