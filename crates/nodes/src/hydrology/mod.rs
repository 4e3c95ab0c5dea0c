//! Drainage and rivers.

pub mod basins;
pub mod flow;
pub mod lakes;
pub mod rivers;
pub mod snow;
pub mod steepness;

use orograph_graph::Node;

/// The nodes of this category, in palette order.
pub static NODES: &[&Node] = &[&flow::NODE, &rivers::NODE, &basins::NODE, &steepness::NODE, &lakes::NODE, &snow::NODE];
