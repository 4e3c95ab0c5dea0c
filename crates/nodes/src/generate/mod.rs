//! Land from nothing: noise, spectra, shapes.

pub mod constant;
pub mod diffused;
pub mod noise;
pub mod perlin;
pub mod ridged;
pub mod spectral;

use orograph_graph::Node;

/// The nodes of this category, in palette order.
pub static NODES: &[&Node] =
    &[&constant::NODE, &perlin::NODE, &noise::node::NODE, &ridged::NODE, &spectral::NODE, &diffused::NODE];
