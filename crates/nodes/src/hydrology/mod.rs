//! Where water goes.

pub mod engine;
pub mod flow;

use orograph_graph::Node;

/// The nodes of this category, in palette order.
pub static NODES: &[&Node] = &[&flow::NODE];
