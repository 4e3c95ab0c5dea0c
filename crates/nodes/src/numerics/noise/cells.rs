//! Cellular noise on a raster: distances to the nearest of random points.
//!
//! S. Worley (1996), "A cellular texture basis function". Differences: one point in each cell of the lattice instead of
//! a random number, displaced from the cell's centre by up to half a cell; and distances are limited to two cells, so
//! that the 5 x 5 cells around a sample contain the two nearest, whatever the metric.

use super::{
    Octave,
    lattice::{Axis, hash, hash_row},
    raster::{Combine, LANES, Layer, Noise, moments},
    sum::Sum,
};
use crate::numerics::simd::simd;

/// Lattice cells that are searched on each side.
const REACH: i32 = 2;
/// Limit on distances in lattice cells: points outside the searched cells are not nearer.
const FARTHEST: f32 = 2.0;

/// A metric for row kernels.
pub(crate) trait Measure: Sync {
    /// Returns a monotone function of the distance at an offset.
    fn rank(x: f32, y: f32) -> f32;

    /// Returns the distance of a rank.
    fn distance(rank: f32) -> f32;
}

/// Euclidean distance.
pub(crate) struct Euclidean;
/// Sum of the distances along x and y.
pub(crate) struct Manhattan;
/// The larger of the distances along x and y.
pub(crate) struct Chebyshev;

impl Measure for Euclidean {
    #[inline(always)]
    fn rank(x: f32, y: f32) -> f32 {
        x * x + y * y
    }

    #[inline(always)]
    fn distance(rank: f32) -> f32 {
        rank.sqrt()
    }
}

impl Measure for Manhattan {
    #[inline(always)]
    fn rank(x: f32, y: f32) -> f32 {
        x.abs() + y.abs()
    }

    #[inline(always)]
    fn distance(rank: f32) -> f32 {
        rank
    }
}

impl Measure for Chebyshev {
    #[inline(always)]
    fn rank(x: f32, y: f32) -> f32 {
        x.abs().max(y.abs())
    }

    #[inline(always)]
    fn distance(rank: f32) -> f32 {
        rank
    }
}

/// Factors of the distances to the nearest and to the second nearest point.
pub(crate) type Parts = [f32; 2];

/// An octave of cellular noise on a strip of columns and a band of rows.
pub(crate) struct Cells<M> {
    octave: Octave,
    /// Factors of the distances.
    parts: Parts,
    /// Smallest coordinate of a point in its cell, and the width of their range.
    places: [f32; 2],
    /// Lattice column and row of the first point.
    first: [i32; 2],
    /// Number of points per lattice row.
    width: usize,
    /// Positions of points in their cells, row by row.
    points: Vec<[f32; 2]>,
    /// First row of samples in the world.
    top: u32,
    measure: std::marker::PhantomData<M>,
}

impl<M: Measure> Cells<M> {
    /// Creates an octave with points that are displaced by up to `jitter` half cells from the centres of their cells,
    /// and factors of the distances to the two nearest.
    pub fn new(octave: Octave, jitter: f32, parts: Parts) -> Self {
        Self {
            octave,
            parts,
            places: [0.5 - 0.5 * jitter, jitter],
            first: [0; 2],
            width: 0,
            points: Vec::new(),
            top: 0,
            measure: std::marker::PhantomData,
        }
    }

    /// Draws the points of lattice rows and columns, starting at `first`.
    fn draw(&mut self, rows: usize) {
        let [along, down] = self.octave.axes;
        self.points.resize(rows * self.width, [0.0; 2]);
        let [least, width] = self.places;
        for (row, points) in (0..).zip(self.points.chunks_exact_mut(self.width)) {
            let row_hash = hash_row(down.wrap(self.first[1] + row), self.octave.seed);
            for (column, point) in (0..).zip(points) {
                let hash = hash(along.wrap(self.first[0] + column), row_hash);
                let unit = |bits: u32| (bits & 0xffff) as f32 * (1.0 / 65_536.0);
                *point = [least + width * unit(hash >> 16), least + width * unit(hash)];
            }
        }
    }
}

impl<M: Measure> Layer for Cells<M> {
    fn lay(&mut self, origin: [u32; 2], cells: [usize; 2]) {
        let [along, down] = self.octave.axes;
        self.first = [Axis::cell(along.at(origin[0])) - REACH, Axis::cell(down.at(origin[1])) - REACH];
        self.top = origin[1];
        // lanes beyond the last column are computed too
        let right = Axis::cell(along.at(origin[0]) + along.step * cells[0].next_multiple_of(LANES) as i64);
        let bottom = Axis::cell(down.at(origin[1]) + down.step * cells[1] as i64);
        self.width = (right - self.first[0] + REACH + 1) as usize;
        self.draw((bottom - self.first[1] + REACH + 1) as usize);
    }

    fn add<C: Combine>(&mut self, combine: &C, octave: usize, x: u32, states: &mut [C::State]) {
        nearest::<M, C>(self, combine, octave, x, states);
    }
}

simd! {
    /// Computes the distances to the two nearest points, for each row of samples.
    fn nearest<M: Measure, C: Combine>(cells: &Cells<M>, combine: &C, octave: usize, x: u32, states: &mut [C::State]) {
        let layer = combine.layer(octave);
        let [along, down] = cells.octave.axes;
        // the lattice cell of each sample, relative to that of the first, and its position in it
        let (mut own, mut places) = ([0.0; LANES], [0.0; LANES]);
        let (first, mut last) = (Axis::cell(along.at(x)), 0);
        for lane in 0..LANES {
            let position = along.at(x.wrapping_add(lane as u32));
            last = Axis::cell(position) - first;
            own[lane] = last as f32;
            places[lane] = Axis::fraction(position);
        }
        let from = (first - REACH - cells.first[0]) as usize;
        let columns = from..from + (last + 2 * REACH + 1) as usize;
        for (y, state) in (cells.top..).zip(states) {
            let position = down.at(y);
            let first_row = Axis::cell(position) - REACH - cells.first[1];
            let fraction = Axis::fraction(position);
            let (mut nearest, mut second) = ([f32::MAX; LANES], [f32::MAX; LANES]);
            // from the sample's own row outwards; rows farther away than all second distances are skipped
            for (row, away) in [(0, 0.0), (-1, fraction), (1, 1.0 - fraction), (-2, 1.0 + fraction), (2, 2.0 - fraction)] {
                let away = M::rank(0.0, away);
                if !second.iter().fold(false, |any, &rank| any | (rank > away)) {
                    continue;
                }
                let points = &cells.points[(first_row + row + REACH) as usize * cells.width..];
                for (column, &[across, down]) in (-REACH..).zip(&points[columns.clone()]) {
                    let (column, down) = (column as f32, (down + row as f32) - fraction);
                    for lane in 0..LANES {
                        // this order of operations makes the result independent of the first sample
                        let across = (across + (column - own[lane])) - places[lane];
                        let rank = M::rank(across, down);
                        // unlike `min` and `max`, which handle NaN, one instruction each
                        let farther = if nearest[lane] > rank { nearest[lane] } else { rank };
                        second[lane] = if farther < second[lane] { farther } else { second[lane] };
                        nearest[lane] = if rank < nearest[lane] { rank } else { nearest[lane] };
                    }
                }
            }
            let mut noise = [0.0; LANES];
            for lane in 0..LANES {
                let near = M::distance(nearest[lane]).min(FARTHEST);
                let next = M::distance(second[lane]).min(FARTHEST);
                noise[lane] = cells.parts[0] * near + cells.parts[1] * next;
            }
            C::octave(&layer, &Noise::level(noise), state);
        }
    }
}

/// Returns the mean over all places of the distances weighted by these factors, in lattice cells: measured on a fixed
/// sample of 16 384 places in about 2400 cells, to about half a percent of a cell.
pub(crate) fn mean<M: Measure>(jitter: f32, parts: Parts) -> f64 {
    const SIDE: usize = 128;
    let axes = [Axis::new(0.381, 0, 0), Axis::new(0.381, 0, 0)];
    let octave = Octave { axes, seed: 1, wavelength_cells: 1.0, share: 1.0, fade: 1.0 };
    let cells = Cells::<M>::new(octave, jitter, parts);
    moments(&mut vec![cells], &Sum { start: 0.0 }, SIDE).0
}
