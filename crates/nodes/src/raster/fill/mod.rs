//! Fills voids smoothly from surrounding cells.
//!
//! Push-pull (S. J. Gortler, R. Grzeszczuk, R. Szeliski, M. F. Cohen, 1996, "The Lumigraph", SIGGRAPH 96, section 3.4):
//! values are averaged up a pyramid, weighted by the known part of each coarse cell, until no cell is void; then each
//! level is completed by bilinear interpolation of the coarser one. A void of n cells across is filled from about n
//! cells around it, so narrow gaps keep detail and wide ones become smooth. Difference: known cells are never changed,
//! so the weights of the finest level are 0 or 1.

mod streamed;

use std::ops::Range;

use orograph_graph::{NodeError, memory::zeroed};

use crate::numerics::par;

pub use streamed::{Coarse, filling_bytes, filling_rows};

/// Called once per row; its error cancels the work.
type Check<'a> = &'a (dyn Fn() -> Result<(), NodeError> + Sync);

/// Rows of one level of the pyramid: values, and the known fraction of each cell.
struct Level {
    columns: usize,
    /// All rows of the level.
    rows: usize,
    /// The first row that is here.
    first: usize,
    values: Vec<f32>,
    weights: Vec<f32>,
}

/// Fills the NaN of a row-major raster in place; all other cells keep their bits. A raster without any number is
/// unchanged. `check` is called once per row, and its error cancels the work.
///
/// # Errors
/// The error of `check`.
///
/// # Panics
/// When there are not exactly `columns * rows` samples.
pub fn fill_voids(columns: usize, rows: usize, samples: &mut [f32], check: Check<'_>) -> Result<(), NodeError> {
    assert_eq!(samples.len(), columns * rows, "samples do not fill the raster");
    let voids = par::count(samples, |v| v.is_nan());
    if voids == 0 || voids == samples.len() {
        return Ok(());
    }
    let mut coarse = Level::over(columns, rows, 0, samples, check)?;
    coarse.complete(check)?;
    coarse.fill(0, samples, columns, check)
}

impl Level {
    /// Returns the first level above samples, the first of which are those of row `first`, an even number.
    fn over(columns: usize, rows: usize, first: usize, samples: &[f32], check: Check<'_>) -> Result<Self, NodeError> {
        let given = first..first + samples.len() / columns;
        coarser(columns, rows, given, |at| (samples[at], f32::from(u8::from(!samples[at].is_nan()))), check)
    }

    /// Returns the next level above the rows that are here.
    fn next(&self, check: Check<'_>) -> Result<Self, NodeError> {
        let given = self.first..self.first + self.values.len() / self.columns;
        coarser(self.columns, self.rows, given, |at| (self.values[at], self.weights[at]), check)
    }

    /// Gives every cell of a whole level a value, from the levels above it.
    fn complete(&mut self, check: Check<'_>) -> Result<(), NodeError> {
        let mut above = Vec::new();
        while above.last().unwrap_or(&*self).values.len() > 1 {
            above.push(above.last().unwrap_or(&*self).next(check)?);
        }
        while let Some(coarse) = above.pop() {
            let fine = above.last_mut().unwrap_or(&mut *self);
            fine.blend(0..fine.rows, &coarse, check)?;
        }
        Ok(())
    }

    /// Completes some of the rows that are here by those of the next level, which are complete.
    fn blend(&mut self, rows: Range<usize>, coarse: &Self, check: Check<'_>) -> Result<(), NodeError> {
        let within = self.columns * (rows.start - self.first)..self.columns * (rows.end - self.first);
        let parts = self.values[within.clone()].chunks_mut(self.columns).zip(self.weights[within].chunks(self.columns));
        par::each(parts, |j, (values, weights)| {
            for (i, (v, w)) in values.iter_mut().zip(weights).enumerate() {
                if *w < 1.0 {
                    *v = *w * *v + (1.0 - *w) * coarse.between(i, rows.start + j);
                }
            }
            check()
        })
    }

    /// Fills the voids of samples from row `first` on by this level, which is complete.
    fn fill(&self, first: usize, samples: &mut [f32], columns: usize, check: Check<'_>) -> Result<(), NodeError> {
        par::each(samples.chunks_mut(columns), |j, row| {
            for (i, v) in row.iter_mut().enumerate().filter(|(_, v)| v.is_nan()) {
                *v = self.between(i, first + j);
            }
            check()
        })
    }

    /// Interpolates bilinearly at the centre of cell (i, j) of the next finer level, a quarter of a cell from the
    /// coarse centre.
    fn between(&self, i: usize, j: usize) -> f32 {
        let (x, y) = (i / 2, j / 2);
        let aside = |at: usize, fine: usize, len: usize| {
            if fine.is_multiple_of(2) { at.saturating_sub(1) } else { (at + 1).min(len - 1) }
        };
        let (x1, y1) = (aside(x, i, self.columns), aside(y, j, self.rows));
        let at = |x: usize, y: usize| self.values[(y - self.first) * self.columns + x];
        let near = 0.75 * at(x, y) + 0.25 * at(x1, y);
        let far = 0.75 * at(x, y1) + 0.25 * at(x1, y1);
        0.75 * near + 0.25 * far
    }
}

/// Returns the next level above the given rows of one with that many columns and rows: means of 2 x 2 cells, weighted
/// by their known fraction; value and weight are 0 if nothing is known.
fn coarser(
    columns: usize,
    rows: usize,
    given: Range<usize>,
    cell: impl Fn(usize) -> (f32, f32) + Sync,
    check: Check<'_>,
) -> Result<Level, NodeError> {
    let (nx, first) = (columns.div_ceil(2), given.start / 2);
    let ny = given.end.div_ceil(2) - first;
    let (mut values, mut weights) = (zeroed(nx * ny)?, zeroed(nx * ny)?);
    par::each(values.chunks_mut(nx).zip(weights.chunks_mut(nx)), |j, (values, weights)| {
        for i in 0..nx {
            let (mut sum, mut weight) = (0.0, 0.0);
            for y in 2 * j..(2 * j + 2).min(given.len()) {
                for x in 2 * i..(2 * i + 2).min(columns) {
                    let (v, w) = cell(y * columns + x);
                    if w > 0.0 {
                        sum += w * v;
                        weight += w;
                    }
                }
            }
            if weight > 0.0 {
                values[i] = sum / weight;
                weights[i] = weight.min(1.0);
            }
        }
        check()
    })?;
    Ok(Level { columns: nx, rows: rows.div_ceil(2), first, values, weights })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filled(columns: usize, rows: usize, mut samples: Vec<f32>) -> Vec<f32> {
        fill_voids(columns, rows, &mut samples, &|| Ok(())).unwrap();
        samples
    }

    #[test]
    fn known_cells_keep_their_bits_and_voids_stay_between_them() {
        let (nx, ny) = (37, 23);
        let source: Vec<f32> = (0..nx * ny)
            .map(|at| {
                let (i, j) = (at % nx, at / nx);
                if (8..29).contains(&i) && (3..20).contains(&j) { f32::NAN } else { 100.0 + i as f32 }
            })
            .collect();
        let out = filled(nx, ny, source.clone());
        for (before, after) in source.iter().zip(&out) {
            assert!(before.is_nan() || before.to_bits() == after.to_bits());
            // convex combinations of 100..=136, with a margin for rounding
            assert!((99.99..=136.01).contains(after), "{after}");
        }
        // the slope continues across the void: its west is lower than its east
        assert!(out[11 * nx + 10] < out[11 * nx + 18] && out[11 * nx + 18] < out[11 * nx + 26]);
    }

    #[test]
    fn a_single_number_fills_everything_and_none_nothing() {
        let mut one = vec![f32::NAN; 5 * 7];
        one[17] = 42.0;
        assert_eq!(filled(5, 7, one), [42.0; 35]);
        assert!(filled(3, 1, vec![f32::NAN; 3]).iter().all(|v| v.is_nan()));
        assert_eq!(filled(1, 1, vec![3.0]), [3.0]);
    }

    #[test]
    fn it_stops_when_told() {
        let mut samples = vec![f32::NAN; 64];
        samples[0] = 1.0;
        assert_eq!(fill_voids(8, 8, &mut samples, &|| Err(NodeError::Cancelled)), Err(NodeError::Cancelled));
    }
}
