//! Every node of Orograph: declarations and CPU kernels, one file per node in the folder of its category.

pub mod combine;
pub mod erosion;
pub mod filter;
pub mod generate;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod hydrology;
pub mod import;
pub mod measure;
mod numbers;
pub mod numerics;
#[cfg(test)]
mod peer_tests;
mod prelude;
pub mod quantity;
pub mod raster;
pub mod render;
pub mod select;
pub mod tectonics;
#[cfg(test)]
mod testing;
pub mod vector;
mod wgsl;

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
    Registry::new(categories.into_iter().flatten().copied()).with_extent_of(raster::extent_of)
}

#[cfg(test)]
mod tests {
    #[test]
    fn every_declaration_is_sound() {
        assert_eq!(super::registry().faults(), Vec::<String>::new());
    }
}
