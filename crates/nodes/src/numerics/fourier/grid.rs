//! Convolution of a square grid with a kernel that is given in the frequency domain.

use orograph_graph::{Job, NodeError, memory::zeroed};

use super::{Batch, Complex, LANES, Plan};
use crate::numerics::par;

/// Rows and columns of a block for transposition.
const BLOCK: usize = 16;

/// A square grid of `side` rows, a power of two.
pub(crate) struct Grid {
    pub side: usize,
    pub values: Vec<Complex>,
}

impl Grid {
    /// Convolves with a kernel that is even and real in wavenumbers: `response(m, n)` for m and n waves across the
    /// grid. Real values remain real.
    pub(crate) fn convolve(
        mut self,
        job: &Job<'_>,
        response: impl Fn(f64, f64) -> f64 + Sync,
    ) -> Result<Self, NodeError> {
        let side = self.side;
        let plan = Plan::new(side);
        let waves = |k: usize| if k > side / 2 { k as f64 - side as f64 } else { k as f64 };
        let scale = 1.0 / (side as f64 * side as f64);
        self.rows(job, |_, rows| plan.transform(rows))?;
        self.transpose()?;
        job.advance(0.4)?;
        // a second forward transform reverses the grid, which is corrected below
        self.rows(job, |first, rows| {
            plan.transform(rows);
            for (m, value) in rows.iter_mut().enumerate() {
                for lane in 0..LANES {
                    let factor = scale * response(waves(m), waves(first + lane));
                    value.re[lane] *= factor;
                    value.im[lane] *= factor;
                }
            }
            plan.transform(rows);
            rows[1..].reverse();
        })?;
        self.transpose()?;
        job.advance(0.8)?;
        self.rows(job, |_, rows| {
            plan.transform(rows);
            rows[1..].reverse();
        })?;
        Ok(self)
    }

    /// Calls `each(first, rows)` for groups of adjacent rows.
    fn rows(&mut self, job: &Job<'_>, each: impl Fn(usize, &mut [Batch<f64>]) + Sync) -> Result<(), NodeError> {
        let side = self.side;
        par::each_with(
            self.values.chunks_mut(side * LANES),
            || vec![Batch::ZERO; side],
            |batch, chunk, rows| {
                job.check()?;
                for (lane, row) in rows.chunks_exact(side).enumerate() {
                    for (batch, [re, im]) in batch.iter_mut().zip(row) {
                        (batch.re[lane], batch.im[lane]) = (*re, *im);
                    }
                }
                each(chunk * LANES, batch);
                for (lane, row) in rows.chunks_exact_mut(side).enumerate() {
                    for (batch, value) in batch.iter().zip(row) {
                        *value = [batch.re[lane], batch.im[lane]];
                    }
                }
                Ok(())
            },
        )
    }

    fn transpose(&mut self) -> Result<(), NodeError> {
        let (side, from) = (self.side, &self.values);
        let mut to: Vec<[f64; 2]> = zeroed(from.len())?;
        par::all(to.chunks_mut(side * BLOCK.min(side)), |block, rows| {
            for first in (0..side).step_by(BLOCK) {
                for (j, row) in rows.chunks_exact_mut(side).enumerate() {
                    for (i, value) in row[first..].iter_mut().take(BLOCK).enumerate() {
                        *value = from[(first + i) * side + block * BLOCK + j];
                    }
                }
            }
        });
        self.values = to;
        Ok(())
    }
}
