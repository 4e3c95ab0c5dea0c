//! Measures of terrain.

pub mod compare;
pub mod metrics;

use orograph_graph::Node;

/// The nodes of this category, in palette order.
pub static NODES: &[&Node] = &[&metrics::NODE, &compare::NODE];
