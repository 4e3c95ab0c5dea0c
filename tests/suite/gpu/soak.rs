//! A few of the random edits of `examples/soak.rs`.

use orograph_nodes::gpu::GpuOptions;
use orograph_tests::{gpu::open, soak::soak};

/// The values on the device are limited to 64 rasters of 64 x 64 cells; the scratch of a storm alone takes 20.
#[test]
fn random_edits_keep_the_budget_and_the_tolerances() {
    let budget = 1 << 20;
    let Some(gpu) = open("soak", &GpuOptions { budget: Some(budget), ..GpuOptions::default() }) else { return };
    let found = soak(&gpu, budget, 32, 5);
    assert_eq!(found.faults, [""; 0], "{found:?}");
    assert!(found.is_few_nudged(), "{found:?}");
    assert!(found.on_device > 20 && found.compared > 20 && found.refused < 8, "{found:?}");
}
