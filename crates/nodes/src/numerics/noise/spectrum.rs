//! Exponent and directional dependence of the power spectrum of a square raster; for tests.

use crate::numerics::math;

/// Fast Fourier transform of complex numbers in place; their number is a power of two.
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

/// Calls `each(along, down, power)` for each wave of an n x n raster, with frequencies from 0 to ½ per cell; mean
/// removed, Hann window.
fn waves(samples: &[f32], n: usize, mut each: impl FnMut(f64, f64, f64)) {
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
    let wave = |k: usize| (k.min(n - k) as f64 / n as f64).copysign(if k < n / 2 { 1.0 } else { -1.0 });
    let mut column = vec![[0.0; 2]; n];
    for i in 0..n {
        for (value, row) in column.iter_mut().zip(&mut rows) {
            *value = row[i];
        }
        transform(&mut column);
        for (j, [re, im]) in column.iter().enumerate() {
            each(wave(i), wave(j), re * re + im * im);
        }
    }
}

/// Returns the exponent β of the radially averaged power spectral density, f^-β, of an n x n raster between two
/// wavelengths in cells, with equal weight per octave of frequency.
pub(crate) fn fall(samples: &[f32], n: usize, shortest: f64, longest: f64) -> f64 {
    // bins of a quarter octave of frequency; the fit uses the logarithm of each bin's mean power
    let bin = |frequency: f64| (math::log2(frequency * longest) * 4.0).floor();
    let bins = bin(1.0 / shortest) as usize;
    let mut sums = vec![(0.0, 0.0, 0.0); bins];
    waves(samples, n, |along, down, wave_power| {
        let frequency = math::hypot(along, down);
        let at = bin(frequency);
        if at >= 0.0 && (at as usize) < bins {
            let (power, total, count) = &mut sums[at as usize];
            *power += wave_power;
            *total += math::ln(frequency);
            *count += 1.0;
        }
    });
    let points: Vec<(f64, f64)> = sums.iter().map(|&(p, f, count)| (f / count, math::ln(p / count))).collect();
    let m = points.len() as f64;
    let (mx, my) = points.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 / m, y + p.1 / m));
    let (xy, xx) =
        points.iter().fold((0.0, 0.0), |(xy, xx), p| (xy + (p.0 - mx) * (p.1 - my), xx + (p.0 - mx) * (p.0 - mx)));
    -xy / xx
}

/// Returns the power times the fourth power of frequency by direction, in bins of 9° from 0° to 90° relative to their
/// mean, for the waves of an n x n raster between two wavelengths in cells. Directions are taken modulo 90°.
pub(crate) fn by_direction(samples: &[f32], n: usize, shortest: f64, longest: f64) -> [f64; 10] {
    let mut sums = [(0.0, 0.0); 10];
    waves(samples, n, |along, down, wave_power| {
        let frequency = math::hypot(along, down);
        if (1.0 / longest..1.0 / shortest).contains(&frequency) {
            let quarter = math::atan2(down, along) / std::f64::consts::FRAC_PI_2;
            let (power, count) = &mut sums[((quarter - quarter.floor()) * 10.0) as usize % 10];
            *power += wave_power * math::pow(frequency, 4.0);
            *count += 1.0;
        }
    });
    let powers = sums.map(|(power, count)| power / count);
    let mean = powers.iter().sum::<f64>() / 10.0;
    powers.map(|power| power / mean)
}
