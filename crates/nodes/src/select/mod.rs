//! Masks and measures per cell, for driving other nodes.

pub mod distance;
pub mod slope;

use orograph_graph::Node;

/// The nodes of this category, in palette order.
pub static NODES: &[&Node] = &[&slope::NODE, &distance::NODE];
