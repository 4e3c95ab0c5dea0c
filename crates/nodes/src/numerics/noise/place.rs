//! Noise at single places in double precision, for features in coordinates of their own, such as polar ones.
//!
//! Gradient noise after K. Perlin (1985), "An image synthesizer". The rasters of [`super::sheet`] are many times as
//! fast per cell, but lie on the rows and columns of the world. Here every call draws its own lattice points, so that a
//! place can be bent before it is looked up.

use orograph_graph::mix;

/// Places farther than this many wavelengths from the origin repeat the noise there.
const FAR: f64 = 2_147_483_000.0;
/// Eight unit vectors, 45° apart, turned by 22.5° so that none lies along an axis of the lattice.
const GRADIENTS: [[f64; 2]; 8] = [
    [0.923_879_532_511_286_7, 0.382_683_432_365_089_8],
    [0.382_683_432_365_089_8, 0.923_879_532_511_286_7],
    [-0.382_683_432_365_089_8, 0.923_879_532_511_286_7],
    [-0.923_879_532_511_286_7, 0.382_683_432_365_089_8],
    [-0.923_879_532_511_286_7, -0.382_683_432_365_089_8],
    [-0.382_683_432_365_089_8, -0.923_879_532_511_286_7],
    [0.382_683_432_365_089_8, -0.923_879_532_511_286_7],
    [0.923_879_532_511_286_7, -0.382_683_432_365_089_8],
];

/// Returns a number from 0 to 1 for a key; each salt gives another one.
#[inline]
pub(crate) fn unit(key: u32, salt: u32) -> f64 {
    (f64::from(mix(key ^ mix(salt)) >> 8) + 0.5) / f64::from(1 << 24)
}

/// Returns the key of a feature on a line of features.
#[inline]
pub(crate) fn key(seed: u32, index: i64) -> u32 {
    mix((index as u32).wrapping_mul(0x8da6_b343).wrapping_add(mix(seed)))
}

/// Returns the key of a feature on a lattice.
#[inline]
pub(crate) fn key_at(seed: u32, [column, line]: [i64; 2]) -> u32 {
    let row = mix((line as u32).wrapping_mul(0xd816_3841).wrapping_add(seed));
    mix((column as u32).wrapping_mul(0x8da6_b343).wrapping_add(row))
}

/// Returns noise along a line, from −1 to 1, with features about one unit long.
#[inline]
pub(crate) fn along(x: f64, seed: u32) -> f64 {
    let (cell, t) = parts(x);
    let seed = mix(seed);
    let draw = |index: i64| {
        let hash = mix((index as u32).wrapping_mul(0x8da6_b343).wrapping_add(seed));
        f64::from(hash >> 8) * (2.0 / 16_777_216.0) - 1.0
    };
    let (a, b) = (draw(cell), draw(cell + 1));
    a + (b - a) * fade(t)
}

/// Returns noise in the plane, from −1 to 1, with a standard deviation of a quarter and features about one unit apart.
#[inline]
pub(crate) fn at([x, y]: [f64; 2], seed: u32) -> f64 {
    let ((column, s), (line, t)) = (parts(x), parts(y));
    // the hash of [`key_at`], with the parts of a row computed once
    let rows = [line, line + 1].map(|line| mix((line as u32).wrapping_mul(0xd816_3841).wrapping_add(seed)));
    let dot = |i: i64, j: usize| {
        let hash = mix(((column + i) as u32).wrapping_mul(0x8da6_b343).wrapping_add(rows[j]));
        let [gx, gy] = GRADIENTS[(hash >> 29) as usize];
        gx * (s - i as f64) + gy * (t - j as f64)
    };
    let (u, v) = (fade(s), fade(t));
    let (top, low) = (dot(0, 0), dot(0, 1));
    let top = top + (dot(1, 0) - top) * u;
    let low = low + (dot(1, 1) - low) * u;
    std::f64::consts::SQRT_2 * (top + (low - top) * v)
}

/// Octaves of [`at`], each half as long as the one before; those too fine for the cells are left out.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Octaves {
    /// Wavelength of the first octave.
    pub wavelength_m: f64,
    /// Maximum number of octaves.
    pub count: u32,
    /// Ratio of the amplitude of an octave to that of the one before.
    pub gain: f64,
    /// Side of a cell.
    pub cell_m: f64,
    /// Seed.
    pub seed: u32,
}

impl Octaves {
    /// Returns the sum at a place; the first octave is within ±1.
    pub fn at(&self, [x, y]: [f64; 2]) -> f64 {
        let (mut sum, mut share, mut wavelength_m) = (0.0, 1.0, self.wavelength_m);
        for octave in 0..self.count {
            let seen = visible(wavelength_m, self.cell_m);
            if seen <= 0.0 {
                break;
            }
            // lattices of different octaves share no points
            let shift = 0.37 * f64::from(octave + 1);
            let seed = self.seed.wrapping_add(octave.wrapping_mul(0x9e37_79b9));
            sum += share * seen * at([x / wavelength_m + shift, y / wavelength_m - shift], seed);
            share *= self.gain;
            wavelength_m *= 0.5;
        }
        sum
    }
}

/// Returns the fraction of features of a size that cells can show: 1 from 4.8 cells, 0 below 2.4.
#[inline]
pub(crate) fn visible(wavelength_m: f64, cell_m: f64) -> f64 {
    crate::numerics::math::smoothstep((wavelength_m / cell_m - 2.4) / 2.4)
}

/// Returns the whole part below a number and the fraction above it. `floor` is a call on machines without SSE 4.1.
#[inline]
fn parts(x: f64) -> (i64, f64) {
    let x = x.clamp(-FAR, FAR);
    let whole = x as i64;
    let whole = whole - i64::from(x < whole as f64);
    (whole, x - whole as f64)
}

#[inline]
fn fade(t: f64) -> f64 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Over 10⁵ places both noises are centred, keep their bounds, and are continuous.
    #[test]
    fn noise_is_centred_bounded_and_continuous() {
        let places = (0..100_000).map(|k| [0.137 * f64::from(k % 317), 0.171 * f64::from(k / 317)]);
        let (mut sum, mut squares) = (0.0, 0.0);
        for [x, y] in places {
            let noise = at([x, y], 5);
            assert!(noise.abs() <= 1.0 && along(x, 5).abs() <= 1.0);
            assert!((at([x + 1e-6, y], 5) - noise).abs() < 1e-4 && (along(x + 1e-6, 5) - along(x, 5)).abs() < 1e-4);
            (sum, squares) = (sum + noise, squares + noise * noise);
        }
        assert!((sum / 1e5_f64).abs() < 0.02, "{sum}");
        assert!(((squares / 1e5_f64).sqrt() - 0.33).abs() < 0.1, "{}", (squares / 1e5).sqrt());
    }

    /// Octaves below 2.4 cells are left out, so that finer cells only add to the sum.
    #[test]
    fn cells_decide_how_many_octaves_there_are() {
        let octaves = |cell_m: f64| Octaves { wavelength_m: 100.0, count: 9, gain: 0.5, cell_m, seed: 3 };
        assert_eq!(octaves(50.0).at([13.0, 7.0]), 0.0);
        let coarse = octaves(20.0);
        assert_eq!(coarse.at([13.0, 7.0]), Octaves { count: 2, ..coarse }.at([13.0, 7.0]));
        assert!(octaves(1.0).at([f64::MAX, -f64::MAX]).is_finite());
    }
}
