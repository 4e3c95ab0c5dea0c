//! Masks and terrain measures per cell, as inputs for other nodes.

pub mod aspect;
pub mod buffer;
pub mod components;
pub mod curvature;
pub mod distance;
pub mod occlusion;
pub mod position;
pub mod roughness;
#[expect(clippy::module_inception, reason = "a node's file has the name of the node")]
pub mod select;
pub mod slope;
pub mod sun;
pub mod wetness;

use orograph_graph::Node;

use crate::numerics::{math, simd::simd};

/// The nodes of this category, in palette order.
pub static NODES: &[&Node] = &[
    &select::NODE,
    &slope::NODE,
    &aspect::NODE,
    &curvature::NODE,
    &position::NODE,
    &roughness::NODE,
    &occlusion::NODE,
    &sun::NODE,
    &wetness::NODE,
    &distance::NODE,
    &buffer::NODE,
    &components::NODE,
];

simd! {
    /// Maps values to 1 within the range, falling to 0 over `falloff` outside of it by the cubic `3 t² - 2 t³`.
    fn within(values: &mut [f32], range: [f32; 2], falloff: f32) {
        let sharpness = if falloff > 0.0 { 1.0 / falloff } else { f32::MAX };
        for value in values {
            let below = range[0] - *value;
            let above = *value - range[1];
            let outside = if below > above { below } else { above };
            let outside = if outside > 0.0 { outside } else { 0.0 };
            *value = math::lane::smoothstep(1.0 - (outside * sharpness).min(1.0));
        }
    }
}
