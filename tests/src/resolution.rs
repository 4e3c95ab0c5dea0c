//! The difference between results at one cell size and at half that cell size.

use orograph_graph::Field;

use crate::{Case, evaluate, world};

/// Side, in cells of the coarser raster, of the squares over which smoothed results are averaged.
const SMOOTH: usize = 8;

/// The differences of one output: root mean squares, relative to the standard deviation of the finer result.
#[derive(Clone, Copy, Debug)]
pub struct Difference {
    /// Name of the output.
    pub output: &'static str,
    /// Between the coarser result and the means of the finer one over its cells.
    pub cells: f64,
    /// Between the means of both over squares of eight coarser cells per side: differences of the terrain itself,
    /// without detail.
    pub smoothed: f64,
}

/// Compares the rasters among a case's outputs on a grid of `cells` per side of the test world and on one of twice as
/// many.
///
/// # Errors
/// The evaluator's error.
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

/// The means over squares of `side` cells, plane after plane.
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
    // a constant field has no standard deviation to compare with
    if variance > 0.0 { (error / variance).sqrt() } else { error.sqrt() }
}
