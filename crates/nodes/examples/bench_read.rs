//! Times the reading of a raster file, for comparison with other programs: see `tests/peers/README.md`.
//!
//! `bench_read FILE REPEATS`: prints the shortest elapsed and the median processor time in seconds, and the sum of all
//! numbers. Threads are those of `RAYON_NUM_THREADS`. Processor time comes from `/proc`, so Linux is needed.

mod clock;

use std::{error::Error, path::Path, time::Instant};

use orograph_nodes::{
    numerics::memory::LargePages,
    raster::{Raster, read},
};

use clock::processor_s;

#[global_allocator]
static MEMORY: LargePages = LargePages;

#[expect(clippy::disallowed_methods, reason = "it measures time")]
fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().collect();
    let [_, file, repeats] = &args[..] else { return Err("usage: bench_read FILE REPEATS".into()) };
    let sum = |raster: Raster| raster.samples.iter().map(|v| f64::from(*v)).sum::<f64>();
    // a first time that is not counted
    let all = sum(read(Path::new(file))?);
    let (mut shortest_s, mut processor) = (f64::INFINITY, Vec::new());
    for _ in 0..repeats.parse::<usize>()?.max(1) {
        let (start, before_s) = (Instant::now(), processor_s()?);
        let raster = read(Path::new(file))?;
        shortest_s = shortest_s.min(start.elapsed().as_secs_f64());
        processor.push(processor_s()? - before_s);
        drop(raster);
    }
    processor.sort_by(f64::total_cmp);
    println!("{shortest_s:.4} {:.4} {all}", processor[processor.len() / 2]);
    Ok(())
}
