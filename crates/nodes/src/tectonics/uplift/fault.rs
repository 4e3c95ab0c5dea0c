//! A normal fault: two blocks separate along a straight line; the footwall rises and the hanging wall sinks.

use orograph_graph::memory::zeroed;

use crate::{
    numerics::{
        math::{self, lane},
        par,
        simd::simd,
    },
    prelude::*,
};

/// Position of the fault and motion of its blocks.
pub(super) struct Fault {
    /// A point on its trace.
    pub centre: [f64; 2],
    /// Direction of the trace, clockwise from north; the hanging wall is to its right.
    pub azimuth_deg: f64,
    /// Half the width of the step, within which most of it happens.
    pub step_m: f64,
    /// Distance over which the motion of both blocks falls to 1/e.
    pub decay_m: f64,
    /// Fraction of the motion taken by the footwall.
    pub footwall: f64,
    /// Rate of the total throw.
    pub rate: f64,
}

impl Fault {
    /// Returns the rate at every cell of the job's window.
    pub(super) fn raster(&self, job: &Job<'_>) -> Result<Vec<f32>, NodeError> {
        let azimuth = self.azimuth_deg.to_radians();
        let [right_x, right_y] = [math::cos(azimuth), math::sin(azimuth)];
        let window = job.window();
        let columns: Vec<f64> =
            (0..window.nx()).map(|i| (window.centre_m(i, 0)[0] - self.centre[0]) * right_x).collect();
        let shape =
            [1.0 / self.step_m, -1.0 / self.decay_m, 1.0 - self.footwall, self.rate].map(|number| number as f32);
        let mut uplift = zeroed(window.len())?;
        par::rows(job, &mut uplift, |j, row| {
            throw(row, &columns, (window.centre_m(0, j)[1] - self.centre[1]) * right_y, shape);
        })?;
        Ok(uplift)
    }
}

simd! {
    /// Computes a row of rates; the distance to the right of the trace is the sum of a part per column and one per row.
    fn throw(row: &mut [f32], columns: &[f64], row_m: f64, shape: [f32; 4]) {
        let [per_step, per_decay, sunk, rate] = shape;
        for (value, column_m) in row.iter_mut().zip(columns) {
            let right_m = (column_m + row_m) as f32;
            let x = -right_m * per_step;
            let step = 0.5 + 0.5 * (x / (1.0 + x * x).sqrt());
            *value = rate * ((step - sunk) * lane::exp(right_m.abs() * per_decay));
        }
    }
}
