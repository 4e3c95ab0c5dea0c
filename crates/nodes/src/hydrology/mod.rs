//! Where water goes.

pub mod drained;
pub mod engine;
pub mod flow;
mod flow_scratch;
mod lakes;
pub mod rivers;

use orograph_graph::Node;

/// The nodes of this category, in palette order.
pub static NODES: &[&Node] = &[&flow::NODE, &rivers::NODE];
