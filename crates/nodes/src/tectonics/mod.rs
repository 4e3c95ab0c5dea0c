//! Uplift, flexure and rock.

pub mod flexure;
pub mod rock;
pub mod uplift;

use orograph_graph::Node;

/// The nodes of this category, in palette order.
pub static NODES: &[&Node] = &[&uplift::NODE, &flexure::NODE, &rock::NODE];
