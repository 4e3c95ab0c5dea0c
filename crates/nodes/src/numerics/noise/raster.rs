//! Evaluates octaves on a raster: bands of rows in parallel, divided into strips of columns, whose columns are SIMD
//! lanes.

use std::ops::Range;

use orograph_graph::{Job, NodeError, memory::zeroed};

use super::sheet::{BAND, STRIP, put};
pub(crate) use super::sheet::{LANES, Lanes};
use crate::numerics::{par, simd::simd};

/// Noise of an octave at several samples.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Noise {
    /// Values.
    pub value: [f32; LANES],
    /// Slopes along x and y, per wavelength; 0 unless [`Combine::SLOPES`] requests them.
    pub slope: [[f32; LANES]; 2],
}

impl Noise {
    /// Creates noise without slopes.
    #[inline(always)]
    pub fn level(value: [f32; LANES]) -> Self {
        Self { value, slope: [[0.0; LANES]; 2] }
    }
}

/// A strip of columns within longer rows.
pub(crate) struct Patch<'a> {
    rows: &'a mut [f32],
    /// Samples per row.
    nx: usize,
    columns: Range<usize>,
}

impl<'a> Patch<'a> {
    /// Creates a strip of rows of `nx` samples, with at most [`STRIP`] columns and [`BAND`] rows.
    pub fn new(rows: &'a mut [f32], nx: usize, columns: Range<usize>) -> Self {
        Self { rows, nx, columns }
    }

    /// Returns the number of columns.
    pub fn width(&self) -> usize {
        self.columns.len()
    }

    /// Returns the number of rows.
    pub fn height(&self) -> usize {
        self.rows.len() / self.nx
    }

    /// Returns a range of its rows.
    pub fn part(&mut self, rows: Range<usize>) -> Patch<'_> {
        let rows = &mut self.rows[rows.start * self.nx..rows.end * self.nx];
        Patch { rows, nx: self.nx, columns: self.columns.clone() }
    }

    /// Returns the samples, row by row.
    #[inline(always)]
    pub fn rows(&mut self) -> impl Iterator<Item = &mut [f32]> {
        self.rows.chunks_exact_mut(self.nx).map(|row| &mut row[self.columns.clone()])
    }
}

/// The octaves of a fractal, evaluated together.
pub(crate) trait Stack {
    /// Combines the octaves into the heights of a patch whose first cell is `origin` in the world.
    fn strip<C: Combine>(&mut self, combine: &C, origin: [u32; 2], patch: &mut Patch<'_>);
}

/// An octave of any noise on a strip of columns and a band of rows, evaluated sample by sample.
pub(crate) trait Layer {
    /// Prepares `cells` cells of the world from `origin` on, at most [`STRIP`] columns and [`BAND`] rows.
    fn lay(&mut self, origin: [u32; 2], cells: [usize; 2]);

    /// Adds the octave to the states of all rows, for [`LANES`] columns of the strip from column `x` of the world on.
    fn add<C: Combine>(&mut self, combine: &C, octave: usize, x: u32, states: &mut [C::State]);
}

impl<L: Layer> Stack for Vec<L> {
    fn strip<C: Combine>(&mut self, combine: &C, origin: [u32; 2], patch: &mut Patch<'_>) {
        for layer in &mut *self {
            layer.lay(origin, [patch.width(), patch.height()]);
        }
        let mut states = [combine.start(); BAND];
        let states = &mut states[..patch.height()];
        for (block, x) in (0..patch.width().div_ceil(LANES)).zip((origin[0]..).step_by(LANES)) {
            states.fill(combine.start());
            for (octave, layer) in self.iter_mut().enumerate() {
                layer.add(combine, octave, x, states);
            }
            store(combine, states, block, patch);
        }
    }
}

/// Combines octaves into heights: a recursion from coarse to fine, for [`LANES`] samples at a time.
pub(crate) trait Combine: Sync {
    /// State of the samples between octaves.
    type State: Copy;
    /// Constants of an octave.
    type Layer: Copy;
    /// True if it uses the slopes of the noise.
    const SLOPES: bool = false;

    /// Returns the constants of an octave.
    fn layer(&self, octave: usize) -> Self::Layer;

    /// Returns the state before the first octave.
    fn start(&self) -> Self::State;

    /// Adds the noise of an octave. Must always be inlined, so that it is compiled for each instruction set.
    fn octave(layer: &Self::Layer, noise: &Noise, state: &mut Self::State);

    /// Returns the displacement from each sample along x and y, in wavelengths of the octave, at which its noise is
    /// sampled; for [`super::scattered::Scattered`], the only kind of layers that supports it. Must always be
    /// inlined.
    #[inline(always)]
    fn shift(_: &Self::Layer, _: &Self::State) -> [[f32; LANES]; 2] {
        [[0.0; LANES]; 2]
    }

    /// Returns the heights. Must always be inlined, so that it is compiled for each instruction set.
    fn finish(&self, state: &Self::State) -> Lanes;
}

/// Evaluates octaves, which `stack` creates for each band of rows, at the cells of the job's window and combines them.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub(crate) fn raster<S: Stack, C: Combine>(
    job: &Job<'_>,
    stack: impl Fn() -> S + Sync,
    combine: &C,
) -> Result<Vec<f32>, NodeError> {
    let window = job.window();
    let (nx, [left, top]) = (window.nx(), window.origin);
    let mut out = zeroed(window.len())?;
    crate::numerics::par::bands_within(job, [0.0, 1.0], BAND, &mut out, |row, rows| {
        let mut stack = stack();
        for column in (0..nx).step_by(STRIP) {
            job.check()?;
            let patch = &mut Patch::new(rows, nx, column..nx.min(column + STRIP));
            stack.strip(combine, [left + column as u32, top + row as u32], patch);
        }
        Ok(())
    })?;
    Ok(out)
}

/// As [`raster`], at the first `nx` by `ny` places of the octaves' own axes.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub(crate) fn places<S: Stack, C: Combine>(
    job: &Job<'_>,
    [nx, ny]: [usize; 2],
    stack: impl Fn() -> S + Sync,
    combine: &C,
) -> Result<Vec<f32>, NodeError> {
    let mut out = vec![0.0; nx * ny];
    par::each(out.chunks_mut(nx * BAND), |band, rows| {
        job.check()?;
        let mut stack = stack();
        for column in (0..nx).step_by(STRIP) {
            let patch = &mut Patch::new(rows, nx, column..nx.min(column + STRIP));
            stack.strip(combine, [column as u32, (band * BAND) as u32], patch);
        }
        Ok::<(), NodeError>(())
    })?;
    Ok(out)
}

/// Returns the mean and standard deviation of `combine` over octaves on the first `side` x `side` cells of the world;
/// at most [`STRIP`], and a multiple of [`BAND`].
pub(crate) fn moments<S: Stack, C: Combine>(stack: &mut S, combine: &C, side: usize) -> (f64, f64) {
    let mut sums = [0.0; 2];
    let mut heights = vec![0.0; BAND * side];
    for y in (0..side as u32).step_by(BAND) {
        stack.strip(combine, [0, y], &mut Patch::new(&mut heights, side, 0..side));
        for height in heights.iter().map(|&height| f64::from(height)) {
            sums = [sums[0] + height, sums[1] + height * height];
        }
    }
    let [mean, square] = sums.map(|sum| sum / (side * side) as f64);
    (mean, (square - mean * mean).max(0.0).sqrt())
}

simd! {
    /// Writes the heights of rows into a block of [`LANES`] columns.
    fn store<C: Combine>(combine: &C, states: &[C::State], block: usize, patch: &mut Patch<'_>) {
        for (row, state) in patch.rows().zip(states) {
            let end = row.len().min((block + 1) * LANES);
            put(combine, &[*state], &mut row[block * LANES..end]);
        }
    }
}
