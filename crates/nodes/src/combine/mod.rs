//! Arithmetic and curves over fields.

pub mod clamp;
#[expect(clippy::module_inception, reason = "a node's file has the name of the node")]
pub mod combine;
pub mod curve;
pub mod matching;
pub mod normalise;
pub mod remap;

use orograph_graph::Node;

/// The nodes of this category, in palette order.
pub static NODES: &[&Node] =
    &[&combine::NODE, &curve::NODE, &clamp::NODE, &remap::NODE, &normalise::NODE, &matching::NODE];
