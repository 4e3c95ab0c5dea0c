//! Fourier transforms on the GPU: lengths with all factors, and others, have the error of single precision.

use orograph_graph::{ParamValue, Wanted, Window, World};
use orograph_nodes::gpu::GpuOptions;
use orograph_tests::{
    example,
    gpu::{field, open, run},
    inputs, set,
};

#[test]
fn sums_of_waves_have_the_error_of_single_precision() {
    let Some(gpu) = open("waves", &GpuOptions { poison: true, ..GpuOptions::default() }) else { return };
    let node = orograph_nodes::registry().get("Spectral").expect("a node");
    // factors 2, 3, 4, 5 and 8 along both sides; primes; a length of one; passes that are divided among dispatches
    for (cells, most) in [
        ([240, 150], 5e-7),
        ([256, 81], 5e-7),
        ([125, 1024], 5e-7),
        ([97, 331], 2e-6),
        ([1, 60], 5e-7),
        ([1024, 1024], 5e-7),
    ] {
        for tileable in [false, true] {
            let size = cells.map(|count| f64::from(count) * 100.0);
            let window = Window::whole(World { size, cells, seed: 3, ..World::default() });
            let case = set(example(node), &[("tileable", ParamValue::Bool(tileable))]);
            let expected = (node.cpu)(&case.job(inputs(&case, window), window)).expect("the kernel runs");
            let found = run(&gpu, &case, &inputs(&case, window), window, Wanted::ALL).expect("the kernel runs");
            let [found, expected] = [found, expected].map(|mut outputs| field(&mut outputs, "height"));
            let pairs = || found.samples().iter().zip(expected.samples()).map(|(a, b)| (f64::from(*a), f64::from(*b)));
            let error = pairs().map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
            let all = pairs().map(|(_, b)| b * b).sum::<f64>();
            let error = (error / all).sqrt();
            assert!(error < most, "{cells:?}, tileable {tileable}: {error}");
        }
    }
}
