//! Evaluation of octaves on a raster: bands of rows in parallel, strips of columns, in them columns side by
//! side.

use orograph_graph::{Job, NodeError, Window};

use super::sheet::{BAND, STRIP};
pub(crate) use super::sheet::{LANES, Lanes};
use crate::simd::simd;

/// Noise of an octave at samples side by side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Noise {
    /// The noise.
    pub value: [f32; LANES],
    /// Its slopes along x and y, per wavelength; 0 where [`Combine::SLOPES`] is not asked for.
    pub slope: [[f32; LANES]; 2],
}

impl Noise {
    /// Noise without slopes.
    #[inline(always)]
    pub fn level(value: [f32; LANES]) -> Self {
        Self { value, slope: [[0.0; LANES]; 2] }
    }
}

/// An octave on a strip of columns and a band of rows, whatever its noise.
pub(crate) trait Layers {
    /// Lays it over `cells` cells of the world from `origin` on, at most [`STRIP`] columns and [`BAND`] rows.
    fn lay(&mut self, origin: [u32; 2], cells: [usize; 2]);

    /// Adds the octave to the states of all rows, for [`LANES`] columns of the strip from the column `x` of the world on.
    fn add<C: Combine>(&mut self, combine: &C, octave: usize, x: u32, states: &mut [C::State]);
}

/// How octaves become heights: a recursion from coarse to fine, for [`LANES`] samples at a time.
pub(crate) trait Combine: Sync {
    /// What is known of the samples between octaves.
    type State: Copy;
    /// Constants of an octave.
    type Layer: Copy;
    /// Whether it makes use of the slopes of the noise.
    const SLOPES: bool = false;

    /// The constants of an octave.
    fn layer(&self, octave: usize) -> Self::Layer;

    /// What there is before the first octave.
    fn start(&self) -> Self::State;

    /// Takes the noise of an octave into account. To be compiled for each instruction set it must be inlined always.
    fn octave(layer: &Self::Layer, noise: &Noise, state: &mut Self::State);

    /// How far from each sample along x and y, in wavelengths of the octave, its noise is taken; for
    /// [`super::scattered::Scattered`], the one kind of layers that can. To be inlined always.
    #[inline(always)]
    fn shift(_: &Self::Layer, _: &Self::State) -> [[f32; LANES]; 2] {
        [[0.0; LANES]; 2]
    }

    /// The heights. To be compiled for each instruction set it must be inlined always.
    fn finish(&self, state: &Self::State) -> Lanes;
}

/// Evaluates octaves, which `layers` makes for each band of rows, at the cells of the job's window and combines them.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub(crate) fn raster<L: Layers, C: Combine>(
    job: &Job<'_>,
    layers: impl Fn() -> Vec<L> + Sync,
    combine: &C,
) -> Result<Vec<f32>, NodeError> {
    let window = job.window();
    let mut out = vec![0.0; window.len()];
    crate::par::bands_within(job, [0.0, 1.0], BAND, &mut out, |first_row, rows| {
        let mut layers = layers();
        for column in (0..window.nx()).step_by(STRIP) {
            job.check()?;
            strip(&window, combine, &mut layers, [column, first_row], rows);
        }
        Ok(())
    })?;
    Ok(out)
}

/// Mean and standard deviation of what `combine` makes of layers on the first `side` x `side` cells of the world, a multiple
/// of both [`STRIP`] and [`BAND`].
pub(crate) fn moments<L: Layers, C: Combine>(layers: &mut [L], combine: &C, side: usize) -> (f64, f64) {
    let mut sums = [0.0; 2];
    let (mut states, mut heights) = (vec![combine.start(); BAND], vec![0.0; BAND * LANES]);
    for y in (0..side as u32).step_by(BAND) {
        for x in (0..side as u32).step_by(STRIP) {
            layers.iter_mut().for_each(|layer| layer.lay([x, y], [STRIP, BAND]));
            for x in (x..x + STRIP as u32).step_by(LANES) {
                states.fill(combine.start());
                for (k, layer) in layers.iter_mut().enumerate() {
                    layer.add(combine, k, x, &mut states);
                }
                store(combine, &states, &mut heights, [LANES, 0]);
                for height in heights.iter().map(|&height| f64::from(height)) {
                    sums = [sums[0] + height, sums[1] + height * height];
                }
            }
        }
    }
    let [mean, square] = sums.map(|sum| sum / (side * side) as f64);
    (mean, (square - mean * mean).max(0.0).sqrt())
}

/// Evaluates the strip that begins with a column of the window in the rows of a band.
fn strip<L: Layers, C: Combine>(
    window: &Window,
    combine: &C,
    layers: &mut [L],
    [column, first_row]: [usize; 2],
    band: &mut [f32],
) {
    let nx = window.nx();
    let end = nx.min(column + STRIP);
    let origin = [window.origin[0] + column as u32, window.origin[1] + first_row as u32];
    let rows = band.len() / nx;
    for layer in &mut *layers {
        layer.lay(origin, [end - column, rows]);
    }
    let mut states = [combine.start(); BAND];
    let states = &mut states[..rows];
    for (x, column) in (origin[0]..).step_by(LANES).zip((column..end).step_by(LANES)) {
        states.fill(combine.start());
        for (k, layer) in layers.iter_mut().enumerate() {
            layer.add(combine, k, x, states);
        }
        store(combine, states, band, [nx, column]);
    }
}

simd! {
    /// Writes the heights of rows that are `nx` long, from a column on.
    fn store<C: Combine>(combine: &C, states: &[C::State], band: &mut [f32], place: [usize; 2]) {
        let [nx, column] = place;
        for (row, state) in band.chunks_exact_mut(nx).zip(states) {
            let heights = combine.finish(state).0;
            let row = &mut row[column..];
            match row.first_chunk_mut::<LANES>() {
                Some(whole) => *whole = heights,
                None => row.copy_from_slice(&heights[..row.len()]),
            }
        }
    }
}
