//! A range along a path: a Gaussian of the distance to the path, with a different width on each side.
//!
//! Each segment of the path forms its own range, and the highest counts. Beyond the ends of a segment the width blends
//! from that of one side to that of the other, by a cubic of the sine of the angle from the segment's direction. There
//! are therefore no seams, however the path winds; along a straight path each segment is the highest next to itself.

use super::{math::lane, par, simd::simd};
use crate::prelude::*;

/// Path and widths of the range.
pub(crate) struct Range<'a> {
    /// Points of the crest, in order.
    pub path: &'a [[f64; 2]],
    /// Standard deviations in metres to the right of the path and to its left.
    pub widths_m: [f64; 2],
}

/// A straight segment of the path.
#[derive(Clone, Copy)]
pub(crate) struct Stretch {
    start: [f64; 2],
    /// Unit vector along it; the right side is (-y, x).
    along: [f64; 2],
    length_m: f64,
    /// Reciprocal squares of the widths to the right and to the left.
    sides: [f64; 2],
}

impl Range<'_> {
    /// Returns the squared distance to the path, in widths of its side, at every cell of the job's window.
    pub(crate) fn squares(&self, job: &Job<'_>) -> Result<Vec<f32>, NodeError> {
        let (stretches, window) = (self.stretches(), job.window());
        let xs: Vec<f64> = (0..window.nx()).map(|i| window.centre_m(i, 0)[0]).collect();
        let mut squares = vec![0.0; window.len()];
        par::rows(job, &mut squares, |j, row| {
            let ys = vec![window.centre_m(0, j)[1]; xs.len()];
            squares_at(&stretches, &xs, &ys, row);
        })?;
        Ok(squares)
    }

    /// Returns a Gaussian of the distance that is `peak` on the path, at every cell of the job's window.
    pub(crate) fn gaussian(&self, job: &Job<'_>, peak: f64) -> Result<Vec<f32>, NodeError> {
        let mut heights = self.squares(job)?;
        par::rows(job, &mut heights, |_, row| fall_off(row, peak as f32))?;
        Ok(heights)
    }

    /// Returns the segments of the path.
    pub(crate) fn stretches(&self) -> Vec<Stretch> {
        self.path.windows(2).map(|pair| self.stretch(pair[0], pair[1])).collect()
    }

    fn stretch(&self, start: [f64; 2], end: [f64; 2]) -> Stretch {
        let [dx, dy] = [end[0] - start[0], end[1] - start[1]];
        let length_m = (dx * dx + dy * dy).sqrt();
        let sides = self.widths_m.map(|width_m| 1.0 / (width_m * width_m));
        Stretch { start, along: [dx / length_m, dy / length_m], length_m, sides }
    }
}

/// Computes the squared distances of places to the nearest segment, in widths of its side.
pub(crate) fn squares_at(stretches: &[Stretch], xs: &[f64], ys: &[f64], squares: &mut [f32]) {
    squares.fill(f32::INFINITY);
    for stretch in stretches {
        approach(squares, xs, ys, *stretch);
    }
}

simd! {
    /// Lowers each sample to the squared distance to a segment, in widths.
    fn approach(row: &mut [f32], xs: &[f64], ys: &[f64], stretch: Stretch) {
        let Stretch { start, along: [ux, uy], length_m, sides } = stretch;
        for ((nearest, x), y) in row.iter_mut().zip(xs).zip(ys) {
            let (dx, dy) = (x - start[0], y - start[1]);
            let ahead = dx * ux + dy * uy;
            let right = dy * ux - dx * uy;
            let beyond = (-ahead).max(ahead - length_m).max(0.0);
            let square = beyond * beyond + right * right;
            // exactly 1 and -1 next to the segment
            let sine = right / square.sqrt().max(f64::MIN_POSITIVE);
            let share = 0.5 + sine * (0.75 - 0.25 * (sine * sine));
            let widths = (square * (share * sides[0] + (1.0 - share) * sides[1])) as f32;
            *nearest = nearest.min(widths);
        }
    }
}

simd! {
    /// Converts squared distances in widths to a Gaussian.
    pub(crate) fn fall_off(row: &mut [f32], peak: f32) {
        for value in row {
            *value = peak * lane::exp(-0.5 * *value);
        }
    }
}
