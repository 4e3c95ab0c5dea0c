//! Masks and measures per cell, for driving other nodes.

use orograph_graph::Node;

/// The nodes of this category, in palette order.
pub static NODES: &[&Node] = &[];
