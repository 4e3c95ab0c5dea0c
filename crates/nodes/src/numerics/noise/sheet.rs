//! Octaves of lattice noise on strips of columns and bands of rows.
//!
//! Every contribution of a lattice point is a product of a function of the column and a function of the row (see
//! [`super::basis`]). Points are therefore drawn once for a whole strip, lattice row by lattice row, and their sums
//! over lattice columns are computed once per lattice row for [`LANES`] columns of samples at a time. The remaining
//! work per sample and octave is four products and three sums, vectorised over columns, without a hash, a table or a
//! branch. Between two rows where an octave reaches its next lattice row, all octaves are summed sample by sample, so
//! that the state of a sample between octaves stays in registers and heights are written once, along rows.
//!
//! A sample's value depends only on its position, not on where a strip begins, and is the same in every window.

use super::{
    Octave,
    basis::{Basis, Draw, Draws},
    lattice::{Axis, hash, hash_row},
    raster::{Combine, Noise, Patch, Stack},
};
use crate::numerics::simd::simd;

/// Maximum columns of a strip: the lines of a dozen octaves then stay in the second-level cache.
pub(super) const STRIP: usize = 1024;
/// Maximum rows of a band.
pub(super) const BAND: usize = 128;
/// Columns per SIMD block.
pub(crate) const LANES: usize = 16;
/// Blocks of columns that are computed in alternation, so that the data of their row is read once for all of them.
const TURNS: usize = 2;
/// Columns of a strip that are completed before the next ones: their lines stay in the first-level cache.
const TILE: usize = 128;
/// Maximum rows that are computed tile by tile: memory is then written at few addresses at a time, each along a row.
const RUN: usize = 8;

/// A number for each column of a SIMD block.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct Lanes(pub [f32; LANES]);

impl Lanes {
    /// Returns the same number in every column.
    pub const fn splat(value: f32) -> Self {
        Self([value; LANES])
    }
}

/// Contributions of the lattice rows before and after a row of samples in each column, without the weights of the row:
/// the factors of φ and of ψ of the row before, then of the row after.
type Lines = [Lanes; 4];
/// Lines of the blocks that are computed in alternation.
type Sides = [Lines; TURNS];

const NONE: Sides = [[Lanes::splat(0.0); 4]; TURNS];

/// Octaves of lattice noise; see the module.
pub(crate) struct Sheets {
    sheets: Vec<Sheet>,
    /// True if slopes are computed.
    sloped: bool,
    /// First row in the world and number of rows of the current band.
    band: [u32; 2],
    /// Weights of each row of samples and of each octave in it, see [`super::basis::Basis::weights`].
    weights: Vec<[f32; 4]>,
    /// Derivatives of the weights along y, if slopes are computed.
    rates: Vec<[f32; 4]>,
    /// Lines of each group of blocks, and of each octave in it.
    lines: Vec<Sides>,
    /// Derivatives of the lines along x, if slopes are computed.
    slope_lines: Vec<Sides>,
}

/// An octave.
struct Sheet {
    octave: Octave,
    basis: Basis,
    draws: Draws,
    /// Rows of the band at which a lattice row begins, and finally the number of rows.
    turns: Vec<usize>,
    /// The lattice row after the next rows of samples, and the number of turns so far.
    row: i32,
    turn: usize,
    /// Lattice column of the strip's first point.
    first: i32,
    /// Random draws at the points of a lattice row.
    points: Vec<Draw>,
    /// The first point and the number of points for each block of [`LANES`] columns.
    reaches: Vec<[usize; 2]>,
    /// Weights of these points in each column, one after the other; 0 where they are out of a sample's reach.
    columns: Vec<[Lanes; 2]>,
    /// Derivatives of these weights, if slopes are computed.
    column_rates: Vec<[Lanes; 2]>,
}

impl Sheets {
    /// Creates octaves of a kind of noise, each with its scale.
    pub fn new(octaves: &[Octave], basis: Basis, scale: impl Fn(&Octave) -> f32) -> Self {
        let sheets = octaves.iter().map(|octave| Sheet {
            draws: Draws::new(basis, scale(octave)),
            octave: *octave,
            basis,
            turns: Vec::new(),
            row: 0,
            turn: 0,
            first: 0,
            points: Vec::new(),
            reaches: Vec::new(),
            columns: Vec::new(),
            column_rates: Vec::new(),
        });
        Self {
            sheets: sheets.collect(),
            sloped: false,
            band: [0; 2],
            weights: Vec::new(),
            rates: Vec::new(),
            lines: Vec::new(),
            slope_lines: Vec::new(),
        }
    }

    /// Creates octaves with slopes, for recursions that use them.
    pub fn sloped(octaves: &[Octave], basis: Basis, scale: impl Fn(&Octave) -> f32) -> Self {
        Self { sloped: true, ..Self::new(octaves, basis, scale) }
    }

    /// Computes the parts that depend only on rows.
    fn begin(&mut self, band: [u32; 2]) {
        if self.band == band {
            return;
        }
        self.band = band;
        let [top, rows] = band;
        let all = rows as usize * self.sheets.len();
        self.weights.resize(all, [0.0; 4]);
        self.rates.resize(if self.sloped { all } else { 0 }, [0.0; 4]);
        for sheet in &mut self.sheets {
            let down = sheet.octave.axes[1];
            sheet.turns.clear();
            let mut cell = Axis::cell(down.at(top));
            for row in 1..rows {
                let next = Axis::cell(down.at(top + row));
                if next != cell {
                    sheet.turns.push(row as usize);
                    cell = next;
                }
            }
            sheet.turns.push(rows as usize);
        }
        weigh(self);
    }

    /// Advances an octave to its next lattice row.
    fn turn(&mut self, octave: usize) {
        let octaves = self.sheets.len();
        turn(&mut self.sheets[octave], &mut self.lines, &mut self.slope_lines, [octave, octaves]);
    }
}

impl Stack for Sheets {
    fn strip<C: Combine>(&mut self, combine: &C, [x, y]: [u32; 2], patch: &mut Patch<'_>) {
        let rows = patch.height();
        self.begin([y, rows as u32]);
        let (octaves, blocks) = (self.sheets.len(), patch.width().div_ceil(LANES * TURNS));
        self.lines.resize(blocks * octaves, NONE);
        self.slope_lines.resize(if self.sloped { self.lines.len() } else { 0 }, NONE);
        for octave in 0..octaves {
            let sheet = &mut self.sheets[octave];
            sheet.row = Axis::cell(sheet.octave.axes[1].at(y)).wrapping_sub(1);
            sheet.turn = 0;
            lay(sheet, x, blocks * TURNS, self.sloped);
            self.turn(octave);
            self.turn(octave);
        }
        let layers: Vec<C::Layer> = (0..octaves).map(|octave| combine.layer(octave)).collect();
        let mut start = 0;
        while start < rows {
            let mut end = rows.min(start + RUN);
            for octave in 0..octaves {
                let sheet = &mut self.sheets[octave];
                if sheet.turns[sheet.turn] == start {
                    sheet.turn += 1;
                    self.turn(octave);
                }
                let sheet = &self.sheets[octave];
                end = end.min(sheet.turns[sheet.turn]);
            }
            let patch = &mut patch.part(start..end);
            let of_rows = start * octaves..end * octaves;
            if C::SLOPES {
                let weights = [&self.weights[of_rows.clone()], &self.rates[of_rows]];
                sum_sloped(combine, &layers, [&self.lines, &self.slope_lines], weights, patch);
            } else {
                sum(combine, &layers, &self.lines, &self.weights[of_rows], patch);
            }
            start = end;
        }
    }
}

simd! {
    /// Computes the weights of rows.
    fn weigh(sheets: &mut Sheets) {
        let octaves = sheets.sheets.len();
        for (octave, sheet) in sheets.sheets.iter().enumerate() {
            let (axis, basis) = (sheet.octave.axes[1], sheet.basis);
            let fraction = |row: u32| Axis::fraction(axis.at(sheets.band[0].wrapping_add(row)));
            for (row, weights) in (0..).zip(sheets.weights.iter_mut().skip(octave).step_by(octaves)) {
                *weights = basis.weights(fraction(row));
            }
            for (row, rates) in (0..).zip(sheets.rates.iter_mut().skip(octave).step_by(octaves)) {
                *rates = basis.rates(fraction(row));
            }
        }
    }
}

simd! {
    /// Prepares a strip: the lattice columns within reach of each column of samples, and their weights.
    fn lay(sheet: &mut Sheet, x: u32, blocks: usize, sloped: bool) {
        let (axis, basis) = (sheet.octave.axes[0], sheet.basis);
        sheet.first = Axis::cell(axis.at(x));
        sheet.reaches.clear();
        sheet.columns.clear();
        sheet.column_rates.clear();
        let mut width = 0;
        for block in 0..blocks as u32 {
            let (mut cells, mut fractions) = ([0; LANES], [0.0; LANES]);
            for lane in 0..LANES {
                let position = axis.at(x.wrapping_add(LANES as u32 * block + lane as u32));
                cells[lane] = Axis::cell(position);
                fractions[lane] = Axis::fraction(position);
            }
            let count = (cells[LANES - 1] - cells[0]) as usize + 2;
            let first = (cells[0] - sheet.first) as usize;
            sheet.reaches.push([first, count]);
            width = first + count;
            spread(&mut sheet.columns, &cells, &fractions, count, |fraction| basis.weights(fraction));
            if sloped {
                spread(&mut sheet.column_rates, &cells, &fractions, count, |fraction| basis.rates(fraction));
            }
        }
        sheet.points.resize(width, [0.0; 4]);
    }
}

/// Appends the weights of `count` lattice columns in each column of samples at these positions.
#[inline(always)]
fn spread(
    columns: &mut Vec<[Lanes; 2]>,
    cells: &[i32; LANES],
    fractions: &[f32; LANES],
    count: usize,
    of: impl Fn(f32) -> [f32; 4],
) {
    let mut weights = [[0.0; LANES]; 4];
    for lane in 0..LANES {
        let of_lane = of(fractions[lane]);
        for (weights, weight) in weights.iter_mut().zip(of_lane) {
            weights[lane] = weight;
        }
    }
    let start = columns.len();
    columns.resize(start + count, [Lanes::splat(0.0); 2]);
    let own = cells.map(|cell| cell - cells[0]);
    for (column, parts) in (0..).zip(&mut columns[start..]) {
        // keeps the compiler from vectorising over columns or weights instead of lanes, which is far slower
        let (own, weights) = std::hint::black_box((&own, &weights));
        let (own, mut here) = (*own, [[0; LANES]; 2]);
        for lane in 0..LANES {
            here[0][lane] = if own[lane] == column { u32::MAX } else { 0 };
            here[1][lane] = if own[lane] + 1 == column { u32::MAX } else { 0 };
        }
        for (part, lanes) in parts.iter_mut().enumerate() {
            let (near, far) = (weights[part], weights[part + 2]);
            let mut sum = [0.0; LANES];
            for lane in 0..LANES {
                sum[lane] = f32::from_bits(near[lane].to_bits() & here[0][lane] | far[lane].to_bits() & here[1][lane]);
            }
            *lanes = Lanes(sum);
        }
    }
}

simd! {
    /// Advances one of several octaves to its next lattice row: the row after the samples becomes the row before them.
    fn turn(sheet: &mut Sheet, lines: &mut [Sides], slope_lines: &mut [Sides], place: [usize; 2]) {
        let [octave, octaves] = place;
        let [along, down] = sheet.octave.axes;
        sheet.row = sheet.row.wrapping_add(1);
        let row_hash = hash_row(down.wrap(sheet.row), sheet.octave.seed);
        for (column, point) in (0..).zip(&mut sheet.points) {
            *point = sheet.draws.at(hash(along.wrap(sheet.first + column), row_hash));
        }
        let lines = lines.iter_mut().skip(octave).step_by(octaves).flatten();
        sum_columns(&sheet.reaches, &sheet.columns, &sheet.points, lines);
        let slope_lines = slope_lines.iter_mut().skip(octave).step_by(octaves).flatten();
        sum_columns(&sheet.reaches, &sheet.column_rates, &sheet.points, slope_lines);
    }
}

/// Sums over the points of a lattice row, for each block of columns.
#[inline(always)]
fn sum_columns<'a>(
    reaches: &[[usize; 2]],
    mut columns: &[[Lanes; 2]],
    points: &[Draw],
    lines: impl Iterator<Item = &'a mut Lines>,
) {
    for (&[first, count], lines) in reaches.iter().zip(lines) {
        let (own, rest) = columns.split_at(count);
        columns = rest;
        let (mut phi, mut psi) = ([0.0; LANES], [0.0; LANES]);
        for ([near, far], &[value, x, y, twist]) in own.iter().zip(&points[first..]) {
            for lane in 0..LANES {
                phi[lane] += value * near.0[lane] + x * far.0[lane];
                psi[lane] += y * near.0[lane] + twist * far.0[lane];
            }
        }
        *lines = [lines[2], lines[3], Lanes(phi), Lanes(psi)];
    }
}

simd! {
    /// Sums over lattice rows, octave after octave, and combines octaves: for rows between two turns.
    #[expect(clippy::needless_range_loop, reason = "lanes of several arrays side by side")]
    fn sum<C: Combine>(
        combine: &C,
        layers: &[C::Layer],
        lines: &[Sides],
        weights: &[[f32; 4]],
        patch: &mut Patch<'_>,
    ) {
        let octaves = layers.len();
        for tile in (0..patch.width()).step_by(TILE) {
            for (at, row) in patch.rows().enumerate() {
                let weights = &weights[at * octaves..][..octaves];
                for (block, heights) in (tile / (LANES * TURNS)..).zip(tiled(row, tile)) {
                    let lines = &lines[block * octaves..][..octaves];
                    let mut states = [combine.start(); TURNS];
                    for ((layer, sides), &[phi_s, psi_s, phi_r, psi_r]) in layers.iter().zip(lines).zip(weights) {
                        for (state, [a, b, c, d]) in states.iter_mut().zip(sides) {
                            let mut noise = [0.0; LANES];
                            for lane in 0..LANES {
                                noise[lane] =
                                    (a.0[lane] * phi_s + b.0[lane] * psi_s) + (c.0[lane] * phi_r + d.0[lane] * psi_r);
                            }
                            C::octave(layer, &Noise::level(noise), state);
                        }
                    }
                    put(combine, &states, heights);
                }
            }
        }
    }
}

simd! {
    /// As [`sum`], with slopes; lines and weights are pairs of those of the noise and their derivatives.
    fn sum_sloped<C: Combine>(
        combine: &C,
        layers: &[C::Layer],
        lines: [&[Sides]; 2],
        weights: [&[[f32; 4]]; 2],
        patch: &mut Patch<'_>,
    ) {
        let octaves = layers.len();
        for tile in (0..patch.width()).step_by(TILE) {
            for (at, row) in patch.rows().enumerate() {
                let [weights, rates] = weights.map(|weights| &weights[at * octaves..][..octaves]);
                for (block, heights) in (tile / (LANES * TURNS)..).zip(tiled(row, tile)) {
                    let [lines, along] = lines.map(|lines| &lines[block * octaves..][..octaves]);
                    let mut states = [combine.start(); TURNS];
                    let of_rows = weights.iter().zip(rates);
                    for (((layer, lines), along), (weights, rates)) in layers.iter().zip(lines).zip(along).zip(of_rows) {
                        for ((state, lines), along) in states.iter_mut().zip(lines).zip(along) {
                            C::octave(layer, &sloped(lines, along, weights, rates), state);
                        }
                    }
                    put(combine, &states, heights);
                }
            }
        }
    }
}

/// Returns the noise with its slopes, from lines, weights and their derivatives.
#[inline(always)]
fn sloped(lines: &Lines, along: &Lines, weights: &[f32; 4], rates: &[f32; 4]) -> Noise {
    let ([a, b, c, d], [e, f, g, h]) = (lines, along);
    let mut noise = Noise::level([0.0; LANES]);
    for lane in 0..LANES {
        let (a, b, c, d) = (a.0[lane], b.0[lane], c.0[lane], d.0[lane]);
        let (e, f, g, h) = (e.0[lane], f.0[lane], g.0[lane], h.0[lane]);
        noise.value[lane] = (a * weights[0] + b * weights[1]) + (c * weights[2] + d * weights[3]);
        noise.slope[0][lane] = (e * weights[0] + f * weights[1]) + (g * weights[2] + h * weights[3]);
        noise.slope[1][lane] = (a * rates[0] + b * rates[1]) + (c * rates[2] + d * rates[3]);
    }
    noise
}

/// Returns the heights of a tile that begins at a column of the strip, in the blocks that are computed in alternation.
#[inline(always)]
fn tiled(row: &mut [f32], column: usize) -> impl Iterator<Item = &mut [f32]> {
    let end = row.len().min(column + TILE);
    row[column..end].chunks_mut(LANES * TURNS)
}

/// Writes as many heights as there is room for.
#[inline(always)]
pub(super) fn put<C: Combine, const N: usize>(combine: &C, states: &[C::State; N], heights: &mut [f32]) {
    let (whole, rest) = heights.as_chunks_mut::<LANES>();
    if let Some(whole) = whole.first_chunk_mut::<N>() {
        for (state, heights) in states.iter().zip(whole) {
            *heights = combine.finish(state).0;
        }
        return;
    }
    let mut states = states.iter().map(|state| combine.finish(state).0);
    for (heights, from) in whole.iter_mut().zip(&mut states) {
        *heights = from;
    }
    if let Some(from) = states.next() {
        rest.copy_from_slice(&from[..rest.len()]);
    }
}
