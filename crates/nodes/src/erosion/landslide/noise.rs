//! Smooth noise that makes outlines, floors and sheets irregular.

use super::draw;
use crate::numerics::math;

/// Returns smooth noise between −1 and 1 with a wavelength of 2.
pub(super) fn noise(place: [f64; 2], seed: u32) -> f64 {
    let first = place.map(f64::floor);
    let [u, v] = [0, 1].map(|axis| math::smoothstep(place[axis] - first[axis]));
    let at = |dx: f64, dy: f64| {
        let row = orograph_graph::mix((first[1] + dy) as i32 as u32 ^ orograph_graph::mix(seed));
        2.0 * draw::unit(orograph_graph::mix((first[0] + dx) as i32 as u32 ^ row)) - 1.0
    };
    (1.0 - v) * ((1.0 - u) * at(0.0, 0.0) + u * at(1.0, 0.0)) + v * ((1.0 - u) * at(0.0, 1.0) + u * at(1.0, 1.0))
}
