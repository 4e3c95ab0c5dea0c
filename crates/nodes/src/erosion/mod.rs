//! What wears the land down.

pub mod creep;
mod hillslope;
pub mod hydraulic_pipe;
mod repose;
pub mod stream_power;
pub mod thermal;
pub mod weathering;

use orograph_graph::Node;

/// The nodes of this category, in palette order.
pub static NODES: &[&Node] =
    &[&stream_power::NODE, &hydraulic_pipe::NODE, &thermal::NODE, &weathering::NODE, &creep::NODE];
