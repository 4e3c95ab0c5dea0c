//! What raises and lowers the land.

pub mod flexure;
pub mod uplift;

use orograph_graph::Node;

/// The nodes of this category, in palette order.
pub static NODES: &[&Node] = &[&uplift::NODE, &flexure::NODE];
