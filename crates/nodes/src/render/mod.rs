//! Pictures: shaded relief, colours, and textures for engines.

pub mod blend;
pub mod hillshade;
pub mod landcover;
pub mod normal_map;
pub mod ramp;
pub mod splat;

use orograph_graph::Node;

/// The nodes of this category, in palette order.
pub static NODES: &[&Node] =
    &[&hillshade::NODE, &ramp::NODE, &landcover::NODE, &blend::NODE, &normal_map::NODE, &splat::NODE];
