//! Smooth noise that makes outlines, floors and sheets irregular.

use crate::numerics::noise::place;

/// Returns smooth noise between −1 and 1, with a standard deviation of 0.4 and features about one unit apart.
pub(super) fn noise(at: [f64; 2], seed: u32) -> f64 {
    (1.7 * place::at(at, seed)).clamp(-1.0, 1.0)
}

/// Returns rough noise whose longest features are three units apart: three octaves of [`noise`].
pub(super) fn rough(at: [f64; 2], seed: u32) -> f64 {
    let octave = |k: u32| {
        let scale = f64::from(1 << k);
        noise(at.map(|at| at * scale / 3.0), seed ^ k) / scale
    };
    (0..3).map(octave).sum()
}
