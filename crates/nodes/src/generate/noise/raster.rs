//! Evaluation of octaves on a raster: bands of rows in parallel, strips of columns, groups of rows.
//!
//! The runs of a group of rows are prepared together (see [`super::runs`]), then each row's noise is evaluated octave by
//! octave and combined while it is in the first-level cache.

use orograph_graph::{Job, NodeError, Window};

pub(crate) use super::runs::Line;
use super::{
    Octave,
    runs::{ROWS, Runs, STRIP},
};

/// Rows of a band.
const BAND: usize = 64;

/// How octaves become heights.
pub(crate) trait Combine: Sync {
    /// Factor on the noise of an octave, applied to its gradients.
    fn scale(&self, octave: usize) -> f32;

    /// Computes a row of heights from the noise of its octaves, from coarse to fine. Columns beyond the raster's have any
    /// values.
    fn row(&self, octaves: &[Line], heights: &mut Line);
}

/// Evaluates octaves at the cells of the job's window and combines them.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub(crate) fn raster<C: Combine>(job: &Job<'_>, octaves: &[Octave], combine: &C) -> Result<Vec<f32>, NodeError> {
    let window = job.window();
    let mut out = vec![0.0; window.len()];
    crate::par::bands_within(job, [0.0, 1.0], BAND, &mut out, |first_row, rows| {
        let mut strips = Strips::new(&window, octaves, combine);
        let mut column = 0;
        while column < window.nx() {
            job.check()?;
            column = strips.strip([column, first_row], rows);
        }
        Ok(())
    })?;
    Ok(out)
}

/// What a band needs for its strips.
struct Strips<'a, C> {
    window: &'a Window,
    combine: &'a C,
    /// Runs and noise of each octave.
    runs: Vec<Runs>,
    noise: Vec<Line>,
    heights: Line,
}

impl<'a, C: Combine> Strips<'a, C> {
    fn new(window: &'a Window, octaves: &[Octave], combine: &'a C) -> Self {
        Self {
            window,
            combine,
            runs: octaves.iter().enumerate().map(|(k, octave)| Runs::new(octave, combine.scale(k))).collect(),
            noise: vec![Line::filled(0.0); octaves.len()],
            heights: Line::filled(0.0),
        }
    }

    /// Evaluates the strip that holds a column of the window, from there on, in the rows of a band; gives the first
    /// column beyond it.
    fn strip(&mut self, [column, first_row]: [usize; 2], band: &mut [f32]) -> usize {
        let nx = self.window.nx();
        let x = self.window.origin[0] + column as u32;
        let x0 = x - x % STRIP as u32; // strips are those of the world
        let first = (x - x0) as usize;
        let end = nx.min(column + STRIP - first);
        let last = first + end - column;
        let y0 = self.window.origin[1] + first_row as u32;
        for (y, group) in (y0..).step_by(ROWS).zip(band.chunks_mut(nx * ROWS)) {
            for runs in &mut self.runs {
                runs.prepare([x0, y], last, group.len() / nx);
            }
            for (row, heights) in group.chunks_exact_mut(nx).enumerate() {
                for (runs, noise) in self.runs.iter().zip(&mut self.noise) {
                    runs.row(row, first, noise);
                }
                self.combine.row(&self.noise, &mut self.heights);
                heights[column..end].copy_from_slice(&self.heights.row()[first..last]);
            }
        }
        end
    }
}
