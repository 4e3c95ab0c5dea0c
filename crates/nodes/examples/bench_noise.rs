//! Time per cell of the noise generators on one core: `cargo run --release -p orograph-nodes --example bench_noise`.
//!
//! The median of nine runs at 4096 x 4096 cells, or as many a side as the first argument says.

use std::time::Instant;

use orograph_graph::{Cancel, Job, ParamValue, ParamValues, Warnings, Window, World};
use orograph_nodes::registry;

fn main() {
    let cells = std::env::args().nth(1).map_or(4096, |cells| cells.parse().expect("cells a side"));
    let registry = registry();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
    for (id, octaves, wavelength) in [
        ("Perlin", 1, 64.0),
        ("Perlin", 1, 1024.0),
        ("Perlin", 8, 1024.0),
        ("Perlin", 12, 1024.0),
        ("Ridged", 8, 1024.0),
        ("Ridged", 12, 1024.0),
    ] {
        let node = registry.get(id).expect("a noise node");
        let mut params = ParamValues::defaults(&node.specs());
        params.set("octaves", ParamValue::Int(octaves));
        params.set("wavelength", ParamValue::Float(wavelength));
        params.set("lacunarity", ParamValue::Float(2.0));
        let world = World { cells: [cells; 2], size: [f64::from(cells); 2], ..World::default() };
        let job = Job {
            node,
            params: &params,
            inputs: Vec::new(),
            window: Window::whole(world),
            folder: std::path::PathBuf::new(),
            cancel: Cancel::default(),
            progress: &|_| {},
            warnings: Warnings::default(),
            glimpses: None,
        };
        let mut times: Vec<f64> = (0..9)
            .map(|_| {
                #[expect(clippy::disallowed_methods, reason = "the time is what is asked for")]
                let start = Instant::now();
                let outputs = pool.install(|| (node.cpu)(&job)).expect("a result");
                let seconds = start.elapsed().as_secs_f64();
                drop(outputs);
                1e9 * seconds / (f64::from(cells) * f64::from(cells))
            })
            .collect();
        times.sort_by(f64::total_cmp);
        println!(
            "{id:>8} {octaves:>3} octaves from {wavelength:>6} cells: {:.3} ns per cell, best {:.3}",
            times[4], times[0]
        );
    }
}
