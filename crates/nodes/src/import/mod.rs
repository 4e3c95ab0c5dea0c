//! Terrain from files.

#[expect(clippy::module_inception, reason = "the category and its only node have one name")]
pub mod import;

use orograph_graph::Node;

/// The nodes of this category, in palette order.
pub static NODES: &[&Node] = &[&import::NODE];
