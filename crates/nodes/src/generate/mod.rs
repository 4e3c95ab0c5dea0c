//! Terrain generators: noise, spectra, shapes.

pub mod constant;
pub mod crater;
pub mod diffused;
pub mod dunes;
pub mod faults;
pub mod fractal;
pub mod gradient;
pub mod island;
pub mod noise;
pub mod paint;
pub mod path;
pub mod perlin;
pub mod range;
pub mod ridged;
pub mod route;
pub mod shape;
pub mod spectral;
pub mod volcano;

use orograph_graph::Node;

/// The nodes of this category, in palette order.
pub static NODES: &[&Node] = &[
    &constant::NODE,
    &perlin::NODE,
    &noise::NODE,
    &ridged::NODE,
    &fractal::NODE,
    &spectral::NODE,
    &diffused::NODE,
    &gradient::NODE,
    &dunes::NODE,
    &crater::NODE,
    &volcano::NODE,
    &range::NODE,
    &faults::NODE,
    &island::NODE,
    &shape::NODE,
    &path::NODE,
    &route::NODE,
    &paint::NODE,
];
