//! A table of layers at random: hard and soft in turn, of log-normal thickness.

use orograph_graph::{Layer, Srgb, mix};

use super::Params;
use crate::numerics::math;

/// Standard deviation of the natural logarithm of a thickness.
const SPREAD: f64 = 0.5;
/// The steepest slopes of soft and of hard layers, in degrees, and how far they vary.
const REPOSES: [f64; 2] = [33.0, 62.0];
const REPOSE_SPREAD: f64 = 6.0;
/// Colours of soft layers, such as shale and marl, and of hard ones, such as sandstone and limestone.
const SOFT: [u32; 4] = [0x8c_6a_52, 0x9a_7f_65, 0x7f_75_66, 0xa0_6a_4e];
const HARD: [u32; 4] = [0xd2_b8_92, 0xc9_9a_6a, 0xb9_a9_8e, 0xdc_c9_a8];

/// The layers of a node without a table.
pub fn generated(params: &Params, seed: u32) -> Vec<Layer> {
    let draw = |layer: u32, which: u32| {
        f64::from(mix(seed ^ mix(layer.wrapping_mul(8) + which) ^ 0x57A7_7AB1) >> 8) * (1.0 / 16_777_216.0)
    };
    // the sum of four draws is close enough to a normal distribution
    let normal = |layer: u32, first: u32| {
        let sum: f64 = (0..4).map(|which| draw(layer, first + which)).sum();
        (sum - 2.0) * 3.0_f64.sqrt()
    };
    let half = params.contrast.sqrt();
    (0..params.count as u32)
        .map(|layer| {
            let is_hard = layer % 2 == 0;
            let thickness = params.thickness * math::exp(SPREAD * normal(layer, 0) - 0.5 * SPREAD * SPREAD);
            // within a quarter of the contrast, in its logarithm
            let vary = math::pow(params.contrast, 0.25 * (draw(layer, 4) - 0.5));
            let hardness = (if is_hard { half } else { 1.0 / half }) * vary;
            let steepness = if params.contrast > 1.0 { REPOSES[usize::from(is_hard)] } else { Layer::USUAL.repose };
            let colours = if is_hard { HARD } else { SOFT };
            Layer {
                thickness: thickness.clamp(Layer::THICKNESSES[0], Layer::THICKNESSES[1]),
                hardness: hardness.clamp(Layer::HARDNESSES[0], Layer::HARDNESSES[1]),
                repose: steepness + REPOSE_SPREAD * (2.0 * draw(layer, 5) - 1.0),
                colour: Srgb::hex(colours[(draw(layer, 6) * colours.len() as f64) as usize]),
            }
        })
        .collect()
}
