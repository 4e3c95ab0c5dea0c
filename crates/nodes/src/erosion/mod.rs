//! Erosion.

pub mod creep;
pub mod fans;
pub mod glacial;
pub mod hydraulic_pipe;
pub mod landslide;
pub mod rills;
#[cfg(test)]
mod strata_tests;
pub mod stream_power;
pub mod thermal;
pub mod weathering;

use orograph_graph::Node;

/// The nodes of this category, in palette order.
pub static NODES: &[&Node] = &[
    &stream_power::NODE,
    &hydraulic_pipe::NODE,
    &glacial::NODE,
    &landslide::NODE,
    &fans::NODE,
    &thermal::NODE,
    &weathering::NODE,
    &creep::NODE,
    &rills::NODE,
];
