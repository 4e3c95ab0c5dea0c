//! Smooth noise that makes outlines, floors and sheets irregular.

use crate::numerics::noise::place;

/// Returns smooth noise between −1 and 1, with a standard deviation of 0.4 and features about one unit apart.
pub(super) fn noise(at: [f64; 2], seed: u32) -> f64 {
    (1.7 * place::at(at, seed)).clamp(-1.0, 1.0)
}
