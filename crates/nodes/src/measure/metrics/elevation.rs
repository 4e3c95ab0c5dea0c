//! Elevations and hypsometry.

use super::{Land, histogram, put};
use crate::{numerics::par, prelude::*};
use orograph_graph::{Axis, Series};

/// Elevations of a field in metres; NaN if it has none.
#[derive(Clone, Copy, Debug)]
pub(in crate::measure) struct Elevations {
    pub count: f64,
    pub min: f64,
    pub max: f64,
    pub mean: f64,
    pub std: f64,
}

/// Steps of the hypsometric curve.
const STEPS: usize = 100;

impl Elevations {
    pub fn of(field: &Field) -> Self {
        let count = sum(field, |_| 1.0);
        let (min, max) = field.range(0).map_or((f64::NAN, f64::NAN), |(a, b)| (f64::from(a), f64::from(b)));
        let mean = sum(field, |z| z) / count;
        let std = (sum(field, |z| (z - mean) * (z - mean)) / count).sqrt();
        Self { count, min, max, mean, std }
    }

    /// Returns the fraction of the area at or above each of the relative heights 0, 1/100, ... 1.
    pub fn curve(&self, field: &Field) -> Vec<f64> {
        let level = |step: usize| self.min + step as f64 / STEPS as f64 * (self.max - self.min);
        let step_of = |z: f64| {
            let guess = (z - self.min) / (self.max - self.min) * STEPS as f64;
            let mut step = (guess.max(0.0) as usize).min(STEPS);
            while step > 0 && level(step) > z {
                step -= 1;
            }
            while step < STEPS && level(step + 1) <= z {
                step += 1;
            }
            step
        };
        let at_step = histogram(field.plane(0), STEPS + 1, |z| z.is_finite().then(|| step_of(f64::from(z))));
        let mut above = 0;
        let mut curve: Vec<f64> = at_step
            .iter()
            .rev()
            .map(|count| {
                above += count;
                above as f64 / self.count
            })
            .collect();
        curve.reverse();
        curve
    }
}

/// Returns the sum over the finite samples, row by row, so that it is the same for any number of threads.
fn sum(field: &Field, value: impl Fn(f64) -> f64 + Sync) -> f64 {
    let row = |_, row: &[f32]| row.iter().filter(|z| z.is_finite()).map(|&z| value(f64::from(z))).sum::<f64>();
    par::collect_all(field.plane(0).chunks(field.window().nx()), row).iter().sum()
}

/// Elevations, relief, the hypsometric integral and curve.
pub(super) fn measure(land: &Land<'_>, report: &mut Report) {
    let found = Elevations::of(&land.field);
    let relief = found.max - found.min;
    put(report, "elevation.min", found.min);
    put(report, "elevation.max", found.max);
    put(report, "elevation.mean", found.mean);
    put(report, "elevation.std", found.std);
    put(report, "relief", relief);
    let sides = land.nx().max(land.ny()) as f64 * land.cell_m();
    put(report, "relief_ratio", relief / sides);
    put(report, "hypsometric_integral", (found.mean - found.min) / relief);
    let holes = land.height.window().len() as f64 - land.sea_cells as f64 - land.masked as f64 - found.count;
    if holes > 0.0 {
        report.notes.push(format!("{holes} cells without a height are left out"));
    }
    report.series.push(Series::new(
        "hypsometric_curve",
        Axis::new("share of the area at or above", "", found.curve(&land.field)),
        Axis::new("relative height", "", (0..=STEPS).map(|step| step as f64 / STEPS as f64).collect()),
    ));
}
