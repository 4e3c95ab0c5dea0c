//! Land from nothing: noise, spectra, shapes.

pub mod constant;

use orograph_graph::Node;

/// The nodes of this category, in palette order.
pub static NODES: &[&Node] = &[&constant::NODE];
