//! The runs of raster rows through the cells of a turned lattice.
//!
//! A raster row crosses a turned lattice in runs of samples that share a lattice cell. Within a run everything about the
//! corners is a linear function of the sample's number. With σ and τ the place in the cell from its centre, a, b, c and d
//! the values plus the dot products at the corners (0, 0), (1, 0), (0, 1) and (1, 1), and U = q(σ + ½) − ½ the odd part of the fade,
//! gradient noise is `M + U(σ) B + U(τ) (C + U(σ) D)` with the mean `M = (a + b + c + d) / 4` and the differences
//! `B = (b + d − a − c) / 2`, `C = (c + d − a − b) / 2`, `D = a + d − b − c`. σ, τ, M, B, C and D are linear, so a run
//! needs ten numbers, which are computed once, many runs at a time in vector lanes, and a sample then some thirty sums
//! and products without a hash, a table or a branch.
//!
//! Runs begin where the world's cells say, and at the world's columns that are multiples of [`STRIP`]: never where a
//! window happens to begin. So the numbers of a sample are the same in every window.

use super::{
    Octave,
    lattice::{fraction, gradient, hash, hash_row, value},
};
use crate::simd::simd;

/// Columns of a strip; strips begin at multiples of it in the world.
pub(super) const STRIP: usize = 256;
/// Rows whose runs are prepared together.
pub(super) const ROWS: usize = 8;
/// Lanes that are written at once; lines are longer than a strip by as many.
const LANES: usize = 16;
/// The most runs of a group of rows. With 2.4 cells a wavelength a strip crosses at most √2 · 255 / 2.4 = 151 lattice
/// lines and one more of each family.
const RUNS: usize = ROWS * 160;

/// A row of a strip, aligned with the cache's lines. It has room to be written in whole lanes beyond its end.
#[derive(Clone)]
#[repr(align(64))]
pub(crate) struct Line([f32; STRIP + LANES]);

impl Line {
    /// The same value everywhere.
    pub const fn filled(value: f32) -> Self {
        Self([value; STRIP + LANES])
    }

    /// The columns of the strip.
    #[inline(always)]
    pub fn row(&self) -> &[f32; STRIP] {
        self.0.first_chunk().expect("a line is longer than a strip")
    }

    /// The columns of the strip.
    #[inline(always)]
    pub fn row_mut(&mut self) -> &mut [f32; STRIP] {
        self.0.first_chunk_mut().expect("a line is longer than a strip")
    }
}

/// A linear function of the number of a sample in its run: the value at the run's first sample and the step.
type Linear = [f32; 2];

/// What the samples of a run have in common. The constants of the fade, U = 6 x (x⁴ − 5/6 x² + 5/16), are factored into
/// the differences.
#[derive(Clone, Copy, Debug)]
pub(super) struct Terms {
    /// Place of the first sample in its lattice cell, from the centre.
    place: [f32; 2],
    mean: Linear,
    /// Differences along the lattice's x and y, and of the two.
    along: Linear,
    across: Linear,
    cross: Linear,
}

impl Terms {
    /// From the gradients and values at the corners (0, 0), (1, 0), (0, 1) and (1, 1), the fractions of the first sample and the
    /// steps from sample to sample, both in lattice cells.
    #[inline(always)]
    pub fn new(corners: [[f32; 3]; 4], [s, t]: [f32; 2], [ds, dt]: [f32; 2]) -> Self {
        let [g00, g10, g01, g11] = corners;
        let dot = |[x, y, _]: [f32; 3], s: f32, t: f32| x * s + y * t;
        let near = |corner: [f32; 3], s: f32, t: f32| corner[2] + dot(corner, s, t);
        let (s1, t1) = (s - 1.0, t - 1.0);
        let at = Self::differences(near(g00, s, t), near(g10, s1, t), near(g01, s, t1), near(g11, s1, t1));
        let step = Self::differences(dot(g00, ds, dt), dot(g10, ds, dt), dot(g01, ds, dt), dot(g11, ds, dt));
        Self {
            place: [s - 0.5, t - 0.5],
            mean: [at[0], step[0]],
            along: [at[1], step[1]],
            across: [at[2], step[2]],
            cross: [at[3], step[3]],
        }
    }

    #[inline(always)]
    fn differences(a: f32, b: f32, c: f32, d: f32) -> [f32; 4] {
        let (above, below, rise, fall) = (a + b, c + d, b - a, d - c);
        [0.25 * (above + below), 3.0 * (rise + fall), 3.0 * (below - above), 36.0 * (fall - rise)]
    }

    /// The noise at sample `i` of the run.
    #[inline(always)]
    pub fn at(&self, i: f32, [ds, dt]: [f32; 2]) -> f32 {
        let [u, v] = [odd_fade(self.place[0] + i * ds), odd_fade(self.place[1] + i * dt)];
        let linear = |[value, step]: Linear| value + i * step;
        (linear(self.mean) + u * linear(self.along)) + v * (linear(self.across) + u * linear(self.cross))
    }
}

/// A sixth of the quintic fade 6t⁵ − 15t⁴ + 10t³ less ½, at t = x + ½.
#[inline(always)]
fn odd_fade(x: f32) -> f32 {
    let square = x * x;
    x * (square * (square - 5.0 / 6.0) + 5.0 / 16.0)
}

/// Where samples cross the lattice lines of one family: those of a whole x or of a whole y.
#[derive(Clone, Copy, Debug)]
struct Crossings {
    /// The first sample beyond the next line.
    next: u64,
    /// How far beyond it is, in 2⁻³² lattice cells.
    beyond: u64,
    /// Step from sample to sample, in 2⁻³² lattice cells.
    step: u64,
    /// Whole steps in a lattice cell, and what is left.
    whole: u64,
    rest: u64,
}

impl Crossings {
    /// From the fraction of sample 0 in its lattice cell.
    #[inline(always)]
    fn new(fraction: u32, step: u64) -> Self {
        const ONE: u64 = 1 << 32;
        if step == 0 {
            return Self { next: u64::MAX, beyond: 0, step, whole: 0, rest: 0 };
        }
        let left = ONE - u64::from(fraction);
        let next = left.div_ceil(step);
        Self { next, beyond: next * step - left, step, whole: ONE / step, rest: ONE % step }
    }

    /// Whether the sample `at` is the first beyond the next line; if so, the line after it is next.
    #[inline(always)]
    fn pass(&mut self, at: u64) -> bool {
        let passed = self.next == at;
        if passed {
            let more = u64::from(self.rest > self.beyond);
            self.next += self.whole + more;
            self.beyond = self.beyond + more * self.step - self.rest;
        }
        passed
    }
}

/// Runs side by side in vector lanes.
#[derive(Clone)]
#[repr(align(64))]
struct Batch {
    /// First column of each run and the first beyond it.
    starts: [u32; LANES],
    ends: [u32; LANES],
    /// Lattice cell of each run.
    cells: [[i32; LANES]; 2],
    /// Fraction of each run's first sample in its lattice cell, in 2⁻³².
    fractions: [[u32; LANES]; 2],
    /// The terms of each run in the order of [`Terms`].
    terms: [[f32; LANES]; 10],
}

impl Batch {
    const EMPTY: Self = Self {
        starts: [0; LANES],
        ends: [0; LANES],
        cells: [[0; LANES]; 2],
        fractions: [[0; LANES]; 2],
        terms: [[0.0; LANES]; 10],
    };

    #[inline(always)]
    fn terms(&self, lane: usize) -> Terms {
        let at = |k: usize| self.terms[k][lane];
        Terms {
            place: [at(0), at(1)],
            mean: [at(2), at(3)],
            along: [at(4), at(5)],
            across: [at(6), at(7)],
            cross: [at(8), at(9)],
        }
    }
}

/// The runs of one octave in a group of rows of a strip.
pub(super) struct Runs {
    octave: Octave,
    scale: f32,
    /// The runs of row j are those from `rows[j]` to `rows[j + 1]`.
    rows: [usize; ROWS + 1],
    batches: Box<[Batch]>,
}

impl Runs {
    /// For noise of an octave times `scale`.
    pub fn new(octave: &Octave, scale: f32) -> Self {
        let batches = vec![Batch::EMPTY; RUNS.div_ceil(LANES)].into_boxed_slice();
        Self { octave: *octave, scale, rows: [0; ROWS + 1], batches }
    }

    /// Prepares the rows `y0` to `y0 + rows` of the world in the columns `x0` to `x0 + columns`, at most [`ROWS`] and
    /// [`STRIP`].
    pub fn prepare(&mut self, [x0, y0]: [u32; 2], columns: usize, rows: usize) {
        for row in 0..rows {
            self.walk(row, [x0, y0 + row as u32], columns as u64);
        }
        let batches = self.rows[rows].div_ceil(LANES);
        terms(&mut self.batches[..batches], &self.octave, self.scale);
    }

    /// Finds the runs of a row.
    fn walk(&mut self, row: usize, [x0, y]: [u32; 2], columns: u64) {
        let lattice = self.octave.lattice;
        let position = lattice.at([x0, y]);
        let (low, steps) = (position.map(|p| p as u32), lattice.along.map(i64::unsigned_abs)); // no step is negative
        let mut cell = position.map(|p| (p >> 32) as i32);
        let (mut lines_x, mut lines_y) = (Crossings::new(low[0], steps[0]), Crossings::new(low[1], steps[1]));
        let (mut run, mut start) = (self.rows[row], 0);
        loop {
            let end = lines_x.next.min(lines_y.next).min(columns);
            let (batch, lane) = (&mut self.batches[run / LANES], run % LANES);
            batch.starts[lane] = start as u32;
            batch.ends[lane] = end as u32;
            for axis in 0..2 {
                batch.cells[axis][lane] = cell[axis];
                batch.fractions[axis][lane] = low[axis].wrapping_add((start * steps[axis]) as u32);
            }
            run += 1;
            if end == columns {
                break;
            }
            cell[0] = cell[0].wrapping_add(i32::from(lines_x.pass(end)));
            cell[1] = cell[1].wrapping_add(i32::from(lines_y.pass(end)));
            start = end;
        }
        self.rows[row + 1] = run;
    }

    /// Evaluates a row of the group, from the column `first` of the strip on.
    pub fn row(&self, row: usize, first: usize, noise: &mut Line) {
        evaluate(self, [self.rows[row], self.rows[row + 1]], first, noise);
    }
}

simd! {
    /// The terms of runs.
    fn terms(batches: &mut [Batch], octave: &Octave, scale: f32) {
        let table = octave.gradients.table();
        let steps = octave.lattice.steps();
        for batch in batches {
            let mut hashes = [[0; LANES]; 4];
            let [columns, rows] = &batch.cells;
            for (lane, (&column, &row)) in columns.iter().zip(rows).enumerate() {
                let (right, below) = (column.wrapping_add(1), hash_row(row.wrapping_add(1), octave.seed));
                let above = hash_row(row, octave.seed);
                hashes[0][lane] = hash(column, above);
                hashes[1][lane] = hash(right, above);
                hashes[2][lane] = hash(column, below);
                hashes[3][lane] = hash(right, below);
            }
            let (mut x, mut y) = ([[0.0; LANES]; 4], [[0.0; LANES]; 4]);
            for corner in 0..4 {
                for lane in 0..LANES {
                    [x[corner][lane], y[corner][lane]] = gradient(table, hashes[corner][lane]);
                }
            }
            for lane in 0..LANES {
                let corner = |k: usize| [x[k][lane] * scale, y[k][lane] * scale, value(hashes[k][lane]) * scale];
                let place = [fraction(batch.fractions[0][lane]), fraction(batch.fractions[1][lane])];
                let terms = Terms::new([corner(0), corner(1), corner(2), corner(3)], place, steps);
                [batch.terms[0][lane], batch.terms[1][lane]] = terms.place;
                [batch.terms[2][lane], batch.terms[3][lane]] = terms.mean;
                [batch.terms[4][lane], batch.terms[5][lane]] = terms.along;
                [batch.terms[6][lane], batch.terms[7][lane]] = terms.across;
                [batch.terms[8][lane], batch.terms[9][lane]] = terms.cross;
            }
        }
    }
}

simd! {
    /// Noise along a row. Runs are written in whole lanes, from left to right: what a run writes beyond its end, the next
    /// overwrites.
    fn evaluate(runs: &Runs, range: [usize; 2], first: usize, noise: &mut Line) {
        let steps = runs.octave.lattice.steps();
        for run in range[0]..range[1] {
            let (batch, lane) = (&runs.batches[run / LANES], run % LANES);
            let terms = batch.terms(lane);
            let (start, end) = (batch.starts[lane] as usize, batch.ends[lane] as usize);
            let mut at = start.max(first);
            while at < end {
                let number = (at - start) as f32;
                for (lane, noise) in noise.0[at..at + LANES].iter_mut().enumerate() {
                    *noise = terms.at(number + lane as f32, steps);
                }
                at += LANES;
            }
        }
    }
}
