//! Land from nothing: noise, spectra, shapes.

pub mod constant;
pub mod crater;
pub mod diffused;
pub mod fractal;
pub mod noise;
pub mod perlin;
pub mod ridged;
pub mod shape;
pub mod spectral;
pub mod volcano;

use orograph_graph::Node;

/// The nodes of this category, in palette order.
pub static NODES: &[&Node] = &[
    &constant::NODE,
    &perlin::NODE,
    &noise::node::NODE,
    &ridged::NODE,
    &fractal::NODE,
    &spectral::NODE,
    &diffused::NODE,
    &crater::NODE,
    &volcano::NODE,
    &shape::NODE,
];
