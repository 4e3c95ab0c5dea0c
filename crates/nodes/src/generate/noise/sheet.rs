//! An octave on a strip of columns and a band of rows.
//!
//! All that a lattice point contributes is a product of a function of the column and one of the row (see [`super::basis`]).
//! So points are drawn once for a whole sheet; the sums over lattice columns are worked out once per lattice row for
//! [`LANES`] columns of samples at a time; and what is left for a sample is four products and three sums, side by side
//! for as many columns, without a hash, a table or a branch.
//!
//! A sample's number depends on its own place alone, never on where a sheet begins, and is the same in every window.

use super::{
    Octave,
    basis::{Basis, Draw, Draws},
    lattice::{Axis, hash, hash_row},
    raster::{Combine, Layers, Noise},
};
use crate::simd::simd;

/// Columns of a sheet at most.
pub(super) const STRIP: usize = 128;
/// Rows of a sheet at most.
pub(super) const BAND: usize = 128;
/// Columns that are computed side by side.
pub(crate) const LANES: usize = 16;

/// A number for each of the columns that are computed side by side.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct Lanes(pub [f32; LANES]);

impl Lanes {
    /// The same number in every column.
    pub const fn splat(value: f32) -> Self {
        Self([value; LANES])
    }
}

/// What a lattice row adds in each of the columns, but for its weights in the sample's row: the factors of φ and of ψ.
type Line = [Lanes; 2];

/// See the module.
pub(crate) struct Sheet {
    octave: Octave,
    basis: Basis,
    draws: Draws,
    /// Lattice column and lattice row of the first sample.
    first: [i32; 2],
    /// Weights of each row of samples, see [`super::basis::Basis::weights`].
    weights: [[f32; 4]; BAND],
    /// Their derivatives along y, where slopes are asked for.
    rates: Option<Box<[[f32; 4]; BAND]>>,
    /// Where each lattice row's samples end.
    ends: Vec<usize>,
    /// Lattice points in a row of them.
    width: usize,
    /// What is drawn at the lattice points, row by row; there is one row more than there are `ends`.
    points: Vec<Draw>,
    lines: Vec<Line>,
    /// Derivatives of the lines along x, where slopes are asked for.
    slope_lines: Vec<Line>,
}

impl Sheet {
    /// An octave of a kind of noise, with a factor on it.
    pub fn new(octave: Octave, basis: Basis, scale: f32) -> Self {
        Self {
            draws: Draws::new(basis, scale),
            octave,
            basis,
            first: [0; 2],
            weights: [[0.0; 4]; BAND],
            rates: None,
            ends: Vec::new(),
            width: 0,
            points: Vec::new(),
            lines: Vec::new(),
            slope_lines: Vec::new(),
        }
    }

    /// The same with slopes, for recursions that make use of them.
    pub fn sloped(octave: Octave, basis: Basis, scale: f32) -> Self {
        Self { rates: Some(Box::new([[0.0; 4]; BAND])), ..Self::new(octave, basis, scale) }
    }
}

impl Layers for Sheet {
    fn lay(&mut self, origin: [u32; 2], cells: [usize; 2]) {
        let [along, down] = self.octave.axes;
        self.first = [Axis::cell(along.at(origin[0])), Axis::cell(down.at(origin[1]))];
        self.ends.clear();
        let mut cell = self.first[1];
        for row in 1..cells[1] {
            let next = Axis::cell(down.at(origin[1] + row as u32));
            if next != cell {
                self.ends.push(row);
                cell = next;
            }
        }
        self.ends.push(cells[1]);
        weigh(self, origin[1]);
        // lanes beyond the last column are computed too
        let last = Axis::cell(along.at(origin[0]) + along.step * cells[0].next_multiple_of(LANES) as i64);
        self.width = (last - self.first[0]) as usize + 2;
        self.points.resize((self.ends.len() + 1) * self.width, [0.0; 4]);
        draw(self);
    }

    fn add<C: Combine>(&mut self, combine: &C, octave: usize, x: u32, states: &mut [C::State]) {
        sum_columns(self, x, false);
        if C::SLOPES {
            sum_columns(self, x, true);
            sum_sloped_rows(self, combine, octave, states);
        } else {
            sum_rows(self, combine, octave, states);
        }
    }
}

simd! {
    /// The weights of rows.
    fn weigh(sheet: &mut Sheet, y0: u32) {
        let (axis, basis) = (sheet.octave.axes[1], sheet.basis);
        for (row, weights) in (0..).zip(&mut sheet.weights) {
            *weights = basis.weights(Axis::fraction(axis.at(y0.wrapping_add(row))));
        }
        for (row, rates) in (0..).zip(sheet.rates.iter_mut().flat_map(|rates| rates.iter_mut())) {
            *rates = basis.rates(Axis::fraction(axis.at(y0.wrapping_add(row))));
        }
    }
}

simd! {
    /// Draws the lattice points.
    fn draw(sheet: &mut Sheet) {
        let [along, down] = sheet.octave.axes;
        for (row, points) in (0..).zip(sheet.points.chunks_exact_mut(sheet.width)) {
            let row_hash = hash_row(down.wrap(sheet.first[1] + row), sheet.octave.seed);
            for (column, point) in (0..).zip(points) {
                *point = sheet.draws.at(hash(along.wrap(sheet.first[0] + column), row_hash));
            }
        }
    }
}

simd! {
    /// Sums over lattice columns, for each lattice row: of the noise or of its slope along x.
    fn sum_columns(sheet: &mut Sheet, x: u32, slope: bool) {
        let (axis, basis) = (sheet.octave.axes[0], sheet.basis);
        let (mut cells, mut weights) = ([0; LANES], [[0.0; LANES]; 4]);
        for lane in 0..LANES {
            let position = axis.at(x.wrapping_add(lane as u32));
            cells[lane] = Axis::cell(position);
            let fraction = Axis::fraction(position);
            let of_lane = if slope { basis.rates(fraction) } else { basis.weights(fraction) };
            for (weights, weight) in weights.iter_mut().zip(of_lane) {
                weights[lane] = weight;
            }
        }
        // the weights of each lattice column, 0 where it is out of a sample's reach
        let mut columns = [[Lanes::splat(0.0); 2]; LANES + 1];
        let columns = &mut columns[..(cells[LANES - 1] - cells[0]) as usize + 2];
        for (column, parts) in (0..).zip(&mut *columns) {
            for (part, lanes) in parts.iter_mut().enumerate() {
                for lane in 0..LANES {
                    let before = cells[lane] - cells[0];
                    let after = if before + 1 == column { weights[part + 2][lane] } else { 0.0 };
                    lanes.0[lane] = if before == column { weights[part][lane] } else { after };
                }
            }
        }
        let first = (cells[0] - sheet.first[0]) as usize;
        let lines = if slope { &mut sheet.slope_lines } else { &mut sheet.lines };
        lines.clear();
        for points in sheet.points.chunks_exact(sheet.width) {
            let (mut phi, mut psi) = ([0.0; LANES], [0.0; LANES]);
            for ([near, far], &[value, x, y, twist]) in columns.iter().zip(&points[first..]) {
                for lane in 0..LANES {
                    phi[lane] += value * near.0[lane] + x * far.0[lane];
                    psi[lane] += y * near.0[lane] + twist * far.0[lane];
                }
            }
            lines.push([Lanes(phi), Lanes(psi)]);
        }
    }
}

simd! {
    /// Sums over lattice rows, for each row of samples.
    #[expect(clippy::needless_range_loop, reason = "lanes of several arrays side by side")]
    fn sum_rows<C: Combine>(sheet: &Sheet, combine: &C, octave: usize, states: &mut [C::State]) {
        let layer = combine.layer(octave);
        let mut start = 0;
        for (pair, &end) in sheet.lines.windows(2).zip(&sheet.ends) {
            let [[a, b], [c, d]] = [pair[0], pair[1]];
            for (state, &[phi_s, psi_s, phi_r, psi_r]) in states[start..end].iter_mut().zip(&sheet.weights[start..end]) {
                // Keeps the compiler from computing several rows side by side instead of columns, which is far slower.
                let state = std::hint::black_box(state);
                let mut noise = [0.0; LANES];
                for lane in 0..LANES {
                    noise[lane] = (a.0[lane] * phi_s + b.0[lane] * psi_s) + (c.0[lane] * phi_r + d.0[lane] * psi_r);
                }
                C::octave(&layer, &Noise::level(noise), state);
            }
            start = end;
        }
    }
}

simd! {
    /// The same with slopes.
    fn sum_sloped_rows<C: Combine>(sheet: &Sheet, combine: &C, octave: usize, states: &mut [C::State]) {
        let layer = combine.layer(octave);
        let Some(rates) = &sheet.rates else { return };
        let mut start = 0;
        for ((pair, along), &end) in sheet.lines.windows(2).zip(sheet.slope_lines.windows(2)).zip(&sheet.ends) {
            let [[a, b], [c, d]] = [pair[0], pair[1]];
            let [[e, f], [g, h]] = [along[0], along[1]];
            let rows = states[start..end].iter_mut().zip(&sheet.weights[start..end]).zip(&rates[start..end]);
            for ((state, &[phi_s, psi_s, phi_r, psi_r]), rates) in rows {
                let state = std::hint::black_box(state);
                let mut noise = Noise::level([0.0; LANES]);
                for lane in 0..LANES {
                    let (a, b, c, d) = (a.0[lane], b.0[lane], c.0[lane], d.0[lane]);
                    noise.value[lane] = (a * phi_s + b * psi_s) + (c * phi_r + d * psi_r);
                    noise.slope[0][lane] =
                        (e.0[lane] * phi_s + f.0[lane] * psi_s) + (g.0[lane] * phi_r + h.0[lane] * psi_r);
                    noise.slope[1][lane] = (a * rates[0] + b * rates[1]) + (c * rates[2] + d * rates[3]);
                }
                C::octave(&layer, &noise, state);
            }
            start = end;
        }
    }
}
