//! What wears the land down.

mod repose;
pub mod thermal;

use orograph_graph::Node;

/// The nodes of this category, in palette order.
pub static NODES: &[&Node] = &[&thermal::NODE];
