//! How the power spectrum of a square raster falls; for tests.

use crate::math;

/// Fast Fourier transform of a power of two of complex numbers, in place.
fn transform(values: &mut [[f64; 2]]) {
    let n = values.len();
    let bits = n.trailing_zeros();
    for i in 0..n {
        let j = i.reverse_bits() >> (usize::BITS - bits);
        if i < j {
            values.swap(i, j);
        }
    }
    let mut half = 1;
    while half < n {
        let angle = -std::f64::consts::PI / half as f64;
        for k in 0..half {
            let (c, s) = (math::cos(angle * k as f64), math::sin(angle * k as f64));
            for start in (0..n).step_by(2 * half) {
                let ([ar, ai], [br, bi]) = (values[start + k], values[start + k + half]);
                let (tr, ti) = (c * br - s * bi, c * bi + s * br);
                values[start + k] = [ar + tr, ai + ti];
                values[start + k + half] = [ar - tr, ai - ti];
            }
        }
        half *= 2;
    }
}

/// The exponent β with which the radially averaged power spectral density of an n x n raster falls, f^-β, between two
/// wavelengths in cells; mean removed, Hann window, equal weight per octave of frequency.
pub(crate) fn fall(samples: &[f32], n: usize, shortest: f64, longest: f64) -> f64 {
    let mean = samples.iter().map(|&v| f64::from(v)).sum::<f64>() / samples.len() as f64;
    let hann = |i: usize| 0.5 - 0.5 * math::cos(2.0 * std::f64::consts::PI * (i as f64 + 0.5) / n as f64);
    let mut rows: Vec<Vec<[f64; 2]>> = (0..n)
        .map(|j| {
            let mut row: Vec<[f64; 2]> =
                (0..n).map(|i| [(f64::from(samples[j * n + i]) - mean) * hann(i) * hann(j), 0.0]).collect();
            transform(&mut row);
            row
        })
        .collect();
    // bins of a quarter octave of frequency: sum of log power is taken of the bin's mean power
    let bin = |frequency: f64| (math::log2(frequency * longest) * 4.0).floor();
    let bins = bin(1.0 / shortest) as usize;
    let mut sums = vec![(0.0, 0.0, 0.0); bins];
    let mut column = vec![[0.0; 2]; n];
    for i in 0..n {
        for (value, row) in column.iter_mut().zip(&mut rows) {
            *value = row[i];
        }
        transform(&mut column);
        for (j, [re, im]) in column.iter().enumerate() {
            let wave = |k: usize| k.min(n - k) as f64 / n as f64;
            let frequency = math::hypot(wave(i), wave(j));
            let at = bin(frequency);
            if at >= 0.0 && (at as usize) < bins {
                let (power, total, count) = &mut sums[at as usize];
                *power += re * re + im * im;
                *total += math::ln(frequency);
                *count += 1.0;
            }
        }
    }
    let points: Vec<(f64, f64)> = sums.iter().map(|&(p, f, count)| (f / count, math::ln(p / count))).collect();
    let m = points.len() as f64;
    let (mx, my) = points.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 / m, y + p.1 / m));
    let (xy, xx) =
        points.iter().fold((0.0, 0.0), |(xy, xx), p| (xy + (p.0 - mx) * (p.1 - my), xx + (p.0 - mx) * (p.0 - mx)));
    -xy / xx
}
