//! Every node of Orograph: declarations and CPU kernels, one file per node in the folder of its category.

pub mod cells;
pub mod combine;
pub mod components;
pub mod distance;
pub mod erosion;
pub mod filter;
mod fourier;
pub mod generate;
pub mod gradient;
pub mod horizon;
pub mod hydrology;
pub mod import;
pub mod math;
pub mod measure;
pub mod memory;
pub mod par;
#[cfg(test)]
mod peer_tests;
mod prelude;
pub mod quantity;
mod range;
pub mod raster;
pub mod render;
pub mod select;
pub mod simd;
mod strokes;
pub mod tectonics;
#[cfg(test)]
mod testing;

use orograph_graph::{Node, Registry};

/// All nodes, in palette order.
#[must_use]
pub fn registry() -> Registry {
    let categories: [&[&'static Node]; 10] = [
        generate::NODES,
        import::NODES,
        combine::NODES,
        filter::NODES,
        tectonics::NODES,
        hydrology::NODES,
        erosion::NODES,
        select::NODES,
        measure::NODES,
        render::NODES,
    ];
    Registry::new(categories.into_iter().flatten().copied())
}

#[cfg(test)]
mod tests {
    #[test]
    fn every_declaration_is_sound() {
        assert_eq!(super::registry().faults(), Vec::<String>::new());
    }
}
