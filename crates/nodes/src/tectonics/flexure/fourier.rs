//! The two-dimensional Fourier transform of a square grid, with the same bits on every machine.
//!
//! Rows are transformed by the radix-2 algorithm of J. W. Cooley and J. W. Tukey (1965), "An algorithm for the machine
//! calculation of complex Fourier series", with twiddle factors from the library of equal bits.

use orograph_graph::{Job, NodeError};
use rayon::prelude::*;

use crate::math;

/// A complex number: real and imaginary part.
pub(super) type Complex = [f64; 2];

/// Rows and columns of the squares that a transposition moves at a time.
const BLOCK: usize = 16;

/// A square grid of `side` rows, a power of two.
pub(super) struct Grid {
    pub side: usize,
    pub values: Vec<Complex>,
}

impl Grid {
    /// The convolution with a kernel that is even and real in wave numbers: `response(m, n)` for m and n waves across
    /// the grid. Real values in, real values out.
    pub(super) fn convolve(
        mut self,
        job: &Job<'_>,
        response: impl Fn(f64, f64) -> f64 + Sync,
    ) -> Result<Self, NodeError> {
        let side = self.side;
        let turns = twiddles(side);
        let waves = |k: usize| if k > side / 2 { k as f64 - side as f64 } else { k as f64 };
        let scale = 1.0 / (side as f64 * side as f64);
        self.rows(job, |_, row| transform(row, &turns))?;
        self.transpose();
        job.advance(0.4)?;
        // transforming twice gives back the grid in reverse, which is put right below
        self.rows(job, |n, row| {
            transform(row, &turns);
            for (m, value) in row.iter_mut().enumerate() {
                let factor = scale * response(waves(m), waves(n));
                *value = value.map(|part| part * factor);
            }
            transform(row, &turns);
            row[1..].reverse();
        })?;
        self.transpose();
        job.advance(0.8)?;
        self.rows(job, |_, row| {
            transform(row, &turns);
            row[1..].reverse();
        })?;
        Ok(self)
    }

    fn rows(&mut self, job: &Job<'_>, each: impl Fn(usize, &mut [Complex]) + Sync) -> Result<(), NodeError> {
        self.values.par_chunks_mut(self.side).enumerate().try_for_each(|(j, row)| {
            job.check()?;
            each(j, row);
            Ok(())
        })
    }

    fn transpose(&mut self) {
        let (side, from) = (self.side, &self.values);
        let mut to = vec![[0.0; 2]; from.len()];
        to.par_chunks_mut(side * BLOCK.min(side)).enumerate().for_each(|(block, rows)| {
            for first in (0..side).step_by(BLOCK) {
                for (j, row) in rows.chunks_exact_mut(side).enumerate() {
                    for (i, value) in row[first..].iter_mut().take(BLOCK).enumerate() {
                        *value = from[(first + i) * side + block * BLOCK + j];
                    }
                }
            }
        });
        self.values = to;
    }
}

/// e^(−2πi k / side) for the first half of a turn.
fn twiddles(side: usize) -> Vec<Complex> {
    let angle = |k: usize| -std::f64::consts::TAU * k as f64 / side as f64;
    (0..side / 2).map(|k| [math::cos(angle(k)), math::sin(angle(k))]).collect()
}

/// The discrete Fourier transform of a row in place.
fn transform(row: &mut [Complex], twiddles: &[Complex]) {
    let side = row.len();
    if side < 2 {
        return;
    }
    let spare = usize::BITS - side.trailing_zeros();
    for k in 0..side {
        let mirrored = k.reverse_bits() >> spare;
        if k < mirrored {
            row.swap(k, mirrored);
        }
    }
    let mut half = 1;
    while half < side {
        let stride = side / (2 * half);
        for pair in row.chunks_exact_mut(2 * half) {
            let (low, high) = pair.split_at_mut(half);
            for ((a, b), turn) in low.iter_mut().zip(high).zip(twiddles.iter().step_by(stride)) {
                let turned = [b[0] * turn[0] - b[1] * turn[1], b[0] * turn[1] + b[1] * turn[0]];
                *b = [a[0] - turned[0], a[1] - turned[1]];
                *a = [a[0] + turned[0], a[1] + turned[1]];
            }
        }
        half *= 2;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_transform_is_the_sum_that_defines_it() {
        for side in [1, 2, 8, 64] {
            let row: Vec<Complex> =
                (0..side).map(|k| [math::sin(1.7 * k as f64), math::cos(0.3 * (k * k) as f64)]).collect();
            let mut got = row.clone();
            transform(&mut got, &twiddles(side));
            for (m, got) in got.iter().enumerate() {
                let mut sum = [0.0; 2];
                for (k, value) in row.iter().enumerate() {
                    let angle = -std::f64::consts::TAU * (m * k % side) as f64 / side as f64;
                    let (cos, sin) = (math::cos(angle), math::sin(angle));
                    sum[0] += value[0] * cos - value[1] * sin;
                    sum[1] += value[0] * sin + value[1] * cos;
                }
                // 64 terms of order 1, a rounding each
                assert!((0..2).all(|part| (got[part] - sum[part]).abs() < 1e-13 * 64.0), "{side} {m}: {got:?} {sum:?}");
            }
        }
    }
}
