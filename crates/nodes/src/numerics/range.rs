//! A range along a path: a Gaussian of the distance to the path, with a different width on each side.
//!
//! Each segment of the path forms its own range, and the highest counts. Beyond the ends of a segment the width blends
//! from that of one side to that of the other, by a cubic of the sine of the angle from the segment's direction. There
//! are therefore no seams, however the path winds; along a straight path each segment is the highest next to itself.

use std::borrow::Cow;

use orograph_graph::{Lines, memory::zeroed};

use super::{math::lane, par, simd::simd};
use crate::prelude::*;

/// Paths and widths of the range.
pub(crate) struct Range<'a> {
    /// Points of each crest, in order.
    pub paths: Vec<Cow<'a, [[f64; 2]]>>,
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
        let mut squares = zeroed(window.len())?;
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

    /// Returns the segments of the paths.
    pub(crate) fn stretches(&self) -> Vec<Stretch> {
        let pairs = self.paths.iter().flat_map(|path| path.windows(2)).filter(|pair| pair[0] != pair[1]);
        pairs.map(|pair| self.stretch(pair[0], pair[1])).collect()
    }

    fn stretch(&self, start: [f64; 2], end: [f64; 2]) -> Stretch {
        let [dx, dy] = [end[0] - start[0], end[1] - start[1]];
        let length_m = (dx * dx + dy * dy).sqrt();
        let sides = self.widths_m.map(|width_m| 1.0 / (width_m * width_m));
        Stretch { start, along: [dx / length_m, dy / length_m], length_m, sides }
    }
}

/// Returns the paths of lines, or else one path.
pub(crate) fn paths<'a>(lines: Option<&Lines>, path: &'a [[f64; 2]]) -> Vec<Cow<'a, [[f64; 2]]>> {
    let positions = |line: &orograph_graph::Line| line.vertices.iter().map(|vertex| vertex.position_m).collect();
    match lines {
        Some(lines) => lines.lines.iter().map(|line| Cow::Owned(positions(line))).collect(),
        None => vec![Cow::Borrowed(path)],
    }
}

/// Number of segments up to which all are computed at every place.
const FEW: usize = 24;
/// Places that are computed together.
const CHUNK: usize = 64;

/// Computes the squared distances of places to the nearest segment, in widths of its side.
pub(crate) fn squares_at(stretches: &[Stretch], xs: &[f64], ys: &[f64], squares: &mut [f32]) {
    squares.fill(f32::INFINITY);
    if stretches.len() <= FEW {
        stretches.iter().for_each(|stretch| approach(squares, xs, ys, *stretch));
        return;
    }
    for ((squares, xs), ys) in squares.chunks_mut(CHUNK).zip(xs.chunks(CHUNK)).zip(ys.chunks(CHUNK)) {
        let ends = |values: &[f64]| {
            values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(*v), high.max(*v)])
        };
        let ([left, right], [top, bottom]) = (ends(xs), ends(ys));
        let centre = [0.5 * (left + right), 0.5 * (top + bottom)];
        let radius_m = 0.5 * ((right - left) * (right - left) + (bottom - top) * (bottom - top)).sqrt();
        // what is farther than the nearest at its farthest is the nearest nowhere; widened for rounding
        let bound = stretches.iter().map(|stretch| stretch.within(centre, radius_m)[1]).fold(f64::INFINITY, f64::min);
        for stretch in stretches.iter().filter(|stretch| stretch.within(centre, radius_m)[0] <= 1.000_01 * bound) {
            approach(squares, xs, ys, *stretch);
        }
    }
}

impl Stretch {
    /// Returns the least and the largest squared distance, in widths, that a place within a circle can have.
    fn within(&self, centre: [f64; 2], radius_m: f64) -> [f64; 2] {
        let off = [0, 1].map(|axis| centre[axis] - self.start[axis]);
        let ahead = (off[0] * self.along[0] + off[1] * self.along[1]).clamp(0.0, self.length_m);
        let [x, y] = [0, 1].map(|axis| off[axis] - ahead * self.along[axis]);
        let distance_m = (x * x + y * y).sqrt();
        let [least, most] = [(distance_m - radius_m).max(0.0), distance_m + radius_m];
        let [low, high] = [self.sides[0].min(self.sides[1]), self.sides[0].max(self.sides[1])];
        [least * least * low, most * most * high]
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
