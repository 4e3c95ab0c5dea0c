//! Local relief: highest minus lowest point of adjacent square windows.

use super::{Land, put};
use crate::{numerics::par, prelude::*};
use orograph_graph::{Axis, Series};

/// Sides of the windows of the curve, in sides of `local_window`.
const LENGTHS: [f64; 5] = [0.2, 0.4, 1.0, 2.0, 4.0];

/// The relief of adjacent windows of `side` cells, from the north-west. Windows without a measured cell are left out.
fn reliefs(land: &Land<'_>, side: usize) -> Vec<f64> {
    let (columns, rows) = (land.nx() / side, land.ny() / side);
    let relief = |at: usize| {
        let (i, j) = (at % columns * side, at / columns * side);
        let (mut min, mut max) = (f32::INFINITY, f32::NEG_INFINITY);
        for row in j..j + side {
            for &z in &land.samples()[row * land.nx() + i..][..side] {
                // false for NaN
                min = if z < min { z } else { min };
                max = if z > max { z } else { max };
            }
        }
        if min <= max { f64::from(max) - f64::from(min) } else { f64::NAN }
    };
    let mut reliefs = par::map(columns * rows, relief);
    reliefs.retain(|relief| !relief.is_nan());
    reliefs
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

pub(super) fn measure(land: &Land<'_>, window_m: f64, report: &mut Report) {
    let side = |length_m: f64| (length_m / land.cell_m()).round().max(1.0) as usize;
    let own = reliefs(land, side(window_m));
    if own.is_empty() {
        report.notes.push(format!("the terrain is smaller than a window of {window_m} m: no local relief"));
    }
    let length = side(window_m) as f64 * land.cell_m();
    put(report, "local_window", length);
    put(report, "local_relief.mean", mean(&own));
    put(report, "local_relief.max", own.iter().copied().fold(f64::NAN, f64::max));
    put(report, "local_relief.ratio", mean(&own) / length);
    let mut lengths: Vec<usize> = LENGTHS.map(|factor| side(factor * window_m)).to_vec();
    lengths.dedup();
    let curve: Vec<[f64; 2]> = lengths
        .into_iter()
        .map(|side| [side as f64 * land.cell_m(), mean(&reliefs(land, side))])
        .filter(|[_, relief]| relief.is_finite())
        .collect();
    report.series.push(Series::new(
        "local_relief",
        Axis::new("side of the window", "m", curve.iter().map(|point| point[0]).collect()),
        Axis::new("mean relief", "m", curve.iter().map(|point| point[1]).collect()),
    ));
}
