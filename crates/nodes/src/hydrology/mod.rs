//! Drainage and rivers.

pub mod flow;
pub mod lakes;
pub mod rivers;
pub mod snow;

use orograph_graph::Node;

/// The nodes of this category, in palette order.
pub static NODES: &[&Node] = &[&flow::NODE, &rivers::NODE, &lakes::NODE, &snow::NODE];
