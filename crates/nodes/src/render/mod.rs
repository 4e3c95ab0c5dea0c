//! Pictures: shaded relief, colours, and the textures that engines take.

pub mod blend;
pub mod hillshade;
pub mod light;
pub mod normal_map;
pub mod palettes;
pub mod ramp;
pub mod splat;
pub mod tints;

use orograph_graph::Node;

/// The nodes of this category, in palette order.
pub static NODES: &[&Node] = &[&hillshade::NODE, &ramp::NODE, &blend::NODE, &normal_map::NODE, &splat::NODE];
