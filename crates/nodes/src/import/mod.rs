//! Terrain from files and from other programs.

pub mod given;
#[expect(clippy::module_inception, reason = "the category and its node have one name")]
pub mod import;

use orograph_graph::Node;

/// The nodes of this category, in palette order.
pub static NODES: &[&Node] = &[&import::NODE];
