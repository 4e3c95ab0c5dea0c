//! Row-coherent evaluation of octaves on a raster.
//!
//! With (s, t) the place in a lattice cell, q the fade and g the corners' gradients, gradient noise is
//! `(1 − v)(P₀ + t Q₀) + v (P₁ + (t − 1) Q₁)`, v = q(t), where for the lattice row above (0) and below (1)
//! `P = lerp(gx(X) s, gx(X+1) (s − 1), q(s))` and `Q = lerp(gy(X), gy(X+1), q(s))`. P and Q depend on the column alone,
//! so they are computed once per lattice row, and a sample of a raster row is
//! `P₀ + t Q₀ + v (E + t F)` with `E = P₁ − Q₁ − P₀` and `F = Q₁ − Q₀`: three products and three sums on contiguous
//! memory, with no hash, no table and no gather.
//!
//! The raster is cut into bands of rows (in parallel) and strips of columns, whose lattice rows stay in the first-level
//! cache. Neither changes a bit of the result.

use orograph_graph::{Job, NodeError, Window};

use super::{
    Gradients, Octave,
    lattice::{Axis, fade, gradient, hash, hash_row},
};
use crate::simd::simd;

/// Columns of a strip.
const STRIP: usize = 256;
/// Rows of a band.
const BAND: usize = 64;
/// Lanes that are written at once; lattice rows are padded by as many.
const LANES: usize = 16;

/// A row of a strip, aligned with the cache's lines.
#[derive(Clone)]
#[repr(align(64))]
pub(crate) struct Line(pub [f32; STRIP]);

/// A row of a strip that may be written beyond its end.
#[derive(Clone)]
#[repr(align(64))]
struct Padded([f32; STRIP + LANES]);

impl Line {
    /// The same value everywhere.
    pub const fn filled(value: f32) -> Self {
        Self([value; STRIP])
    }
}

impl Padded {
    const ZERO: Self = Self([0.0; STRIP + LANES]);

    /// The row without what is beyond its end.
    #[inline(always)]
    fn line(&self) -> &[f32; STRIP] {
        self.0.first_chunk().expect("a padded line is longer than a strip")
    }
}

/// What one octave contributes to one row of a strip: sample i is `p[i] + t * q[i] + v * (e[i] + t * f[i])`.
#[derive(Clone, Copy)]
pub(crate) struct OctaveRow<'a> {
    p: &'a [f32; STRIP],
    q: &'a [f32; STRIP],
    e: &'a [f32; STRIP],
    f: &'a [f32; STRIP],
    t: f32,
    v: f32,
}

impl OctaveRow<'_> {
    /// The noise at a column of the strip.
    #[inline(always)]
    pub fn at(&self, i: usize) -> f32 {
        self.p[i] + self.t * self.q[i] + self.v * (self.e[i] + self.t * self.f[i])
    }
}

/// How octaves become heights.
pub(crate) trait Combine: Sync {
    /// Factor on the noise of an octave, applied to its gradients.
    fn scale(&self, octave: usize) -> f32;

    /// Computes a row of heights from its octaves, from coarse to fine. Columns beyond the raster's have any values.
    fn row(&self, octaves: &[LatticeRows], heights: &mut Line);
}

/// Evaluates octaves at the cells of the job's window and combines them.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub(crate) fn raster<C: Combine>(
    job: &Job<'_>,
    gradients: Gradients,
    octaves: &[Octave],
    combine: &C,
) -> Result<Vec<f32>, NodeError> {
    let window = job.window();
    let mut out = vec![0.0; window.len()];
    crate::par::bands_within(job, [0.0, 1.0], BAND, &mut out, |first_row, rows| {
        for first_column in (0..window.nx()).step_by(STRIP) {
            job.check()?;
            strip(&window, [first_column, first_row], gradients, octaves, combine, rows);
        }
        Ok(())
    })?;
    Ok(out)
}

/// Evaluates the columns of one strip in the rows of a band.
fn strip<C: Combine>(
    window: &Window,
    [first_column, first_row]: [usize; 2],
    gradients: Gradients,
    octaves: &[Octave],
    combine: &C,
    rows: &mut [f32],
) {
    let nx = window.nx();
    let columns = STRIP.min(nx - first_column);
    let x0 = window.origin[0] + first_column as u32;
    let y0 = window.origin[1] + first_row as u32;
    let mut lattices: Vec<LatticeRows> = octaves
        .iter()
        .enumerate()
        .map(|(k, octave)| LatticeRows::new(octave, gradients, combine.scale(k), x0, columns))
        .collect();
    let mut line = Line::filled(0.0);
    for (y, heights) in (y0..).zip(rows.chunks_exact_mut(nx)) {
        for lattice in &mut lattices {
            lattice.go_to(y);
        }
        combine.row(&lattices, &mut line);
        heights[first_column..first_column + columns].copy_from_slice(&line.0[..columns]);
    }
}

/// A run of columns within one lattice cell: the first column; the run ends where the next begins.
type Run = u16;

/// The two lattice rows of an octave about a raster row, on the columns of a strip.
pub(crate) struct LatticeRows {
    octave: Octave,
    table: &'static [[f32; 2]; 32],
    scale: f32,
    /// Lattice cell of the first column.
    first_cell: i32,
    /// Where the runs of columns of each lattice cell begin, and their end.
    runs: Vec<Run>,
    /// Place of each column in its lattice cell, and its fade.
    s: Padded,
    fade_s: Padded,
    /// Gradients of a lattice row, scaled.
    corners: Vec<[f32; 2]>,
    /// The lattice row above the raster row.
    cell_row: Option<i32>,
    /// Place of the raster row between the lattice rows, and its fade.
    t: f32,
    v: f32,
    p: [Padded; 2],
    q: [Padded; 2],
    e: Padded,
    f: Padded,
}

impl LatticeRows {
    fn new(octave: &Octave, gradients: Gradients, scale: f32, x0: u32, columns: usize) -> Self {
        let (mut s, mut fade_s) = (Padded::ZERO, Padded::ZERO);
        let axis = octave.axes[0];
        places(&mut s, &mut fade_s, axis, x0);
        let (first_cell, _) = axis.at(x0);
        let mut runs = Vec::with_capacity(columns / 2 + 2);
        let mut last = None;
        for (i, x) in (0..columns).zip(x0..) {
            let (cell, _) = axis.at(x);
            if last != Some(cell) {
                runs.push(i as Run);
                last = Some(cell);
            }
        }
        runs.push(columns as Run);
        Self {
            octave: *octave,
            table: gradients.table(),
            scale,
            first_cell,
            runs,
            s,
            fade_s,
            corners: Vec::new(),
            cell_row: None,
            t: 0.0,
            v: 0.0,
            p: [Padded::ZERO; 2],
            q: [Padded::ZERO; 2],
            e: Padded::ZERO,
            f: Padded::ZERO,
        }
    }

    /// Moves to the world's row `y`; cheapest where rows come in order.
    fn go_to(&mut self, y: u32) {
        let (cell_row, t) = self.octave.axes[1].at(y);
        (self.t, self.v) = (t, fade(t));
        if self.cell_row != Some(cell_row) {
            if self.cell_row.is_some_and(|above| above + 1 == cell_row) {
                self.p.swap(0, 1);
                self.q.swap(0, 1);
            } else {
                self.lattice_row(cell_row, 0);
            }
            self.lattice_row(cell_row + 1, 1);
            difference(&mut self.e, &mut self.f, &self.p, &self.q);
            self.cell_row = Some(cell_row);
        }
    }

    /// What the octave contributes to the row.
    #[inline(always)]
    pub fn noise(&self) -> OctaveRow<'_> {
        OctaveRow { p: self.p[0].line(), q: self.q[0].line(), e: self.e.line(), f: self.f.line(), t: self.t, v: self.v }
    }

    /// Computes P and Q of a lattice row.
    fn lattice_row(&mut self, cell_row: i32, which: usize) {
        let row_hash = hash_row(cell_row, self.octave.seed);
        let cells = self.runs.len() as i32; // one more than runs: each has a corner to its right
        self.corners.clear();
        self.corners.extend((self.first_cell..self.first_cell + cells).map(|column| {
            let [x, y] = gradient(self.table, hash(column, row_hash));
            [x * self.scale, y * self.scale]
        }));
        line(&mut self.p[which], &mut self.q[which], &self.s, &self.fade_s, &self.runs, &self.corners);
    }
}

simd! {
    /// Places of a strip's columns in their lattice cells, and their fades.
    fn places(s: &mut Padded, fade_s: &mut Padded, axis: Axis, x0: u32) {
        for (i, (s, u)) in s.0.iter_mut().zip(&mut fade_s.0).enumerate() {
            *s = axis.fraction(x0.wrapping_add(i as u32));
            *u = fade(*s);
        }
    }
}

simd! {
    /// P and Q along a lattice row. Runs are written in whole lanes, from left to right: what a run writes beyond its
    /// end, the next overwrites.
    fn line(p: &mut Padded, q: &mut Padded, s: &Padded, fade_s: &Padded, runs: &[Run], corners: &[[f32; 2]]) {
        for (run, corner) in runs.windows(2).zip(corners.windows(2)) {
            let ([x0, y0], [x1, y1]) = (corner[0], corner[1]);
            let mut at = usize::from(run[0]);
            while at < usize::from(run[1]) {
                let end = at + LANES;
                for (((p, q), s), u) in
                    p.0[at..end].iter_mut().zip(&mut q.0[at..end]).zip(&s.0[at..end]).zip(&fade_s.0[at..end])
                {
                    let (left, right) = (x0 * s, x1 * (s - 1.0));
                    *p = left + u * (right - left);
                    *q = y0 + u * (y1 - y0);
                }
                at = end;
            }
        }
    }
}

simd! {
    /// E and F of a pair of lattice rows.
    fn difference(e: &mut Padded, f: &mut Padded, p: &[Padded; 2], q: &[Padded; 2]) {
        for i in 0..STRIP {
            e.0[i] = (p[1].0[i] - q[1].0[i]) - p[0].0[i];
            f.0[i] = q[1].0[i] - q[0].0[i];
        }
    }
}
