//! Land from nothing: noise, spectra, shapes.

pub mod constant;
pub mod noise;
pub mod perlin;
pub mod ridged;

use orograph_graph::Node;

/// The nodes of this category, in palette order.
pub static NODES: &[&Node] = &[&constant::NODE, &perlin::NODE, &noise::node::NODE, &ridged::NODE];
