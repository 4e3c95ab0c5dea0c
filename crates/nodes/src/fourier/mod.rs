//! Discrete Fourier transforms of any length, with the same bits on every machine.
//!
//! Lengths that are powers of two are transformed by the radix-2 algorithm of J. W. Cooley and J. W. Tukey (1965), "An
//! algorithm for the machine calculation of complex Fourier series"; all others as a convolution of such a length, after
//! L. I. Bluestein (1970), "A linear filtering approach to the computation of discrete Fourier transform". Eight rows are
//! transformed side by side, one in each lane of a vector, so that the result does not depend on the width of vectors.
//! Twiddle factors come from the library of equal bits; that, and adding in a fixed order, is what libraries tuned to each
//! machine do not offer.

pub(crate) mod grid;

use crate::{math, simd::simd};

/// A complex number: real and imaginary part.
pub(crate) type Complex = [f64; 2];

/// Rows that are transformed side by side.
pub(crate) const LANES: usize = 8;

/// The same place of several rows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Batch {
    pub re: [f64; LANES],
    pub im: [f64; LANES],
}

impl Batch {
    /// Nothing.
    pub const ZERO: Self = Self { re: [0.0; LANES], im: [0.0; LANES] };
}

/// What transforms rows of one length.
pub(crate) struct Plan {
    length: usize,
    /// e^(−2πi k / n) for the first half of a turn, n being the length or that of the convolution.
    twiddles: Vec<Complex>,
    /// Where the length is no power of two.
    chirp: Option<Chirp>,
}

/// Bluestein's convolution.
struct Chirp {
    /// e^(−πi k² / length).
    waves: Vec<Complex>,
    /// The transform of their conjugates around 0, over its length.
    kernel: Vec<Complex>,
}

impl Plan {
    /// For rows of that length, at least 1.
    pub fn new(length: usize) -> Self {
        if length.is_power_of_two() {
            return Self { length, twiddles: twiddles(length), chirp: None };
        }
        let padded = (2 * length - 1).next_power_of_two();
        let twiddles = twiddles(padded);
        let waves: Vec<Complex> =
            (0..length as u64).map(|k| turn(-((k * k % (2 * length as u64)) as f64) / (2.0 * length as f64))).collect();
        let mut kernel = vec![Batch::ZERO; padded];
        for (k, wave) in waves.iter().enumerate() {
            for at in [k, (padded - k) % padded] {
                (kernel[at].re[0], kernel[at].im[0]) = (wave[0], -wave[1]);
            }
        }
        butterflies(&mut kernel, &twiddles);
        let scale = 1.0 / padded as f64;
        let kernel = kernel.iter().map(|k| [k.re[0] * scale, k.im[0] * scale]).collect();
        Self { length, twiddles, chirp: Some(Chirp { waves, kernel }) }
    }

    /// Room for rows: as many places as the transform needs, at least the length.
    pub fn room(&self) -> Vec<Batch> {
        vec![Batch::ZERO; self.chirp.as_ref().map_or(self.length, |chirp| chirp.kernel.len())]
    }

    /// Replaces the first places of [`Self::room`], as many as the length, by their transform `Xₖ = Σ xⱼ e^(−2πi jk / length)`.
    /// What is behind them does not count.
    pub fn transform(&self, values: &mut [Batch]) {
        let Some(Chirp { waves, kernel }) = &self.chirp else { return butterflies(values, &self.twiddles) };
        values[self.length..].fill(Batch::ZERO);
        multiply(values, waves);
        butterflies(values, &self.twiddles);
        // back by the conjugate of the transform of the conjugate
        multiply(values, kernel);
        conjugate(values);
        butterflies(values, &self.twiddles);
        conjugate(&mut values[..self.length]);
        multiply(values, waves);
    }
}

/// e^(2πi t).
pub(crate) fn turn(t: f64) -> Complex {
    let angle = std::f64::consts::TAU * t;
    [math::cos(angle), math::sin(angle)]
}

/// e^(−2πi k / side) for the first half of a turn.
fn twiddles(side: usize) -> Vec<Complex> {
    (0..side / 2).map(|k| turn(-(k as f64) / side as f64)).collect()
}

simd! {
    /// Multiplies places by numbers, as many as there are.
    fn multiply(values: &mut [Batch], by: &[Complex]) {
        for (value, [c, s]) in values.iter_mut().zip(by) {
            for lane in 0..LANES {
                let (re, im) = (value.re[lane], value.im[lane]);
                value.re[lane] = re * c - im * s;
                value.im[lane] = re * s + im * c;
            }
        }
    }
}

simd! {
    fn conjugate(values: &mut [Batch]) {
        for value in values {
            value.im = value.im.map(|im| -im);
        }
    }
}

simd! {
    /// The transform of rows whose length is a power of two.
    fn butterflies(values: &mut [Batch], twiddles: &[Complex]) {
        let side = values.len();
        if side < 2 {
            return;
        }
        let spare = usize::BITS - side.trailing_zeros();
        for k in 0..side {
            let mirrored = k.reverse_bits() >> spare;
            if k < mirrored {
                values.swap(k, mirrored);
            }
        }
        let mut half = 1;
        while half < side {
            let stride = side / (2 * half);
            for pair in values.chunks_exact_mut(2 * half) {
                let (low, high) = pair.split_at_mut(half);
                for ((a, b), [c, s]) in low.iter_mut().zip(high).zip(twiddles.iter().step_by(stride)) {
                    for lane in 0..LANES {
                        let re = b.re[lane] * c - b.im[lane] * s;
                        let im = b.re[lane] * s + b.im[lane] * c;
                        b.re[lane] = a.re[lane] - re;
                        b.im[lane] = a.im[lane] - im;
                        a.re[lane] += re;
                        a.im[lane] += im;
                    }
                }
            }
            half *= 2;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::at_every_level;

    #[test]
    fn a_transform_is_the_sum_that_defines_it() {
        for length in [1, 2, 3, 8, 12, 37, 64, 100] {
            let value = |lane: usize, k: usize| {
                let (k, lane) = (k as f64, lane as f64);
                [math::sin(1.7 * k + lane), math::cos(0.3 * (k * k) - lane)]
            };
            let plan = Plan::new(length);
            let mut got = plan.room();
            for (k, batch) in got.iter_mut().enumerate() {
                // what is behind the row is to be ignored
                for lane in 0..LANES {
                    [batch.re[lane], batch.im[lane]] = value(lane, k);
                }
            }
            plan.transform(&mut got);
            for (m, got) in got[..length].iter().enumerate() {
                for lane in 0..LANES {
                    let mut sum = [0.0; 2];
                    for k in 0..length {
                        let [re, im] = value(lane, k);
                        let [cos, sin] = turn(-((m * k % length) as f64) / length as f64);
                        sum[0] += re * cos - im * sin;
                        sum[1] += re * sin + im * cos;
                    }
                    let error = (got.re[lane] - sum[0]).abs().max((got.im[lane] - sum[1]).abs());
                    // 100 terms of order 1, a rounding each, and as many again in a convolution
                    assert!(error < 1e-13 * 100.0, "{length} {m} {lane}: {error}");
                }
            }
        }
    }

    #[test]
    fn bits_do_not_depend_on_vectors() {
        for length in [64, 45] {
            let plan = Plan::new(length);
            at_every_level(|| {
                let mut values = plan.room();
                for (k, value) in values[..length].iter_mut().enumerate() {
                    value.re = std::array::from_fn(|lane| math::sin((k * k + lane) as f64));
                }
                plan.transform(&mut values);
                values[..length].iter().map(|value| (value.re, value.im)).collect::<Vec<_>>()
            });
        }
    }
}
