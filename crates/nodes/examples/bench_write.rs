//! Times the writing of a raw terrain in each format, for comparison with other programs: see `tests/peers/README.md`.
//!
//! `bench_write TERRAIN SIDE REPEATS OUT [FORMAT ...]`: TERRAIN is a square of SIDE x SIDE little-endian f32; files go
//! to the folder OUT. Prints for each format its name, the shortest elapsed and the median processor time in seconds,
//! and the bytes of the file. Threads are those of `RAYON_NUM_THREADS`. Processor time comes from `/proc`, so Linux is
//! needed.

mod clock;

use std::{error::Error, path::Path, time::Instant};

use orograph_graph::{Field, Window, World};
use orograph_nodes::{
    numerics::memory::LargePages,
    raster::{Format, Meta, Writing, write},
};

use clock::processor_s;

#[global_allocator]
static MEMORY: LargePages = LargePages;

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().collect();
    let [_, terrain, side, repeats, out, formats @ ..] = &args[..] else {
        return Err("usage: bench_write TERRAIN SIDE REPEATS OUT [FORMAT ...]".into());
    };
    let (side, repeats) = (side.parse::<u32>()?, repeats.parse::<usize>()?.max(1));
    let bytes = std::fs::read(terrain)?;
    let samples: Vec<f32> =
        bytes.chunks_exact(4).map(|bytes| f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])).collect();
    let world = World { size: [f64::from(side) * 10.0; 2], cells: [side; 2], ..World::default() };
    let window = Window::whole(world);
    if samples.len() != window.len() {
        return Err(format!("{terrain} has {} samples, not {side} x {side}", samples.len()).into());
    }
    let field = Field::new(window, samples);
    let asked = |format: &Format| formats.is_empty() || formats.iter().any(|name| name == format.name());
    for format in Format::ALL.into_iter().filter(asked) {
        let path = Path::new(out).join(format!("ours_{}.{}", format.name(), format.extension()));
        let run = || write(&path, format, &field, Writing::default(), &Meta::default(), &|| true);
        time(format.name(), repeats, || run().map(|_| ()).map_err(Into::into))?;
        println!(" {}", std::fs::metadata(&path)?.len());
    }
    Ok(())
}

/// Writes that many times after a first one that is not counted, and prints how long it took.
#[expect(clippy::disallowed_methods, reason = "it measures time")]
fn time(name: &str, repeats: usize, run: impl Fn() -> Result<(), Box<dyn Error>>) -> Result<(), Box<dyn Error>> {
    run()?;
    let (mut shortest_s, mut processor) = (f64::INFINITY, Vec::new());
    for _ in 0..repeats {
        let (start, before_s) = (Instant::now(), processor_s()?);
        run()?;
        shortest_s = shortest_s.min(start.elapsed().as_secs_f64());
        processor.push(processor_s()? - before_s);
    }
    processor.sort_by(f64::total_cmp);
    print!("{name} {shortest_s:.4} {:.4}", processor[processor.len() / 2]);
    Ok(())
}
