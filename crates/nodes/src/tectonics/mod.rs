//! Uplift, flexure, rock at the surface and at depth.

pub mod flexure;
pub mod outcrop;
pub mod rock;
pub mod stratify;
pub mod uplift;

use orograph_graph::Node;

/// The nodes of this category, in palette order.
pub static NODES: &[&Node] = &[&uplift::NODE, &flexure::NODE, &rock::NODE, &stratify::NODE, &outcrop::NODE];
