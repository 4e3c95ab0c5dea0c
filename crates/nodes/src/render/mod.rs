//! Pictures.

pub mod hillshade;
pub mod tints;

use orograph_graph::Node;

/// The nodes of this category, in palette order.
pub static NODES: &[&Node] = &[&hillshade::NODE];
