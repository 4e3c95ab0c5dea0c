//! `noise-peers SIDE REPEATS`: times the noise of other libraries on one thread. Prints one line per kernel and
//! library: the kernel, its octaves, the library, and the median processor time in nanoseconds per cell. Linux only.

use libnoise::{Generator, Source};
use noise_functions::{Noise, Perlin};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args = std::env::args().skip(1).map(|arg| arg.parse()).collect::<Result<Vec<usize>, _>>()?;
    let [side, repeats] = args[..] else { return Err("usage: noise-peers SIDE REPEATS".into()) };
    let (one, first) = (1.0 / 64.0, 1.0 / 1024.0);

    let functions = Run { library: "noise-functions-0.8.5", side, repeats };
    let plain = Perlin.seed(7).frequency(one);
    functions.time("perlin", 1, |out| fill(out, side, |x, y| plain.sample2([x, y])));
    let sum = Perlin.fbm(8, 0.5, 2.0).seed(7).frequency(first);
    functions.time("perlin", 8, |out| fill(out, side, |x, y| sum.sample2([x, y])));
    for octaves in [8, 12] {
        let ridged = Perlin.ridged().fbm(octaves, 0.5, 2.0).seed(7).frequency(first);
        functions.time("ridged", octaves, |out| fill(out, side, |x, y| ridged.sample2([x, y])));
    }

    libnoise(Run { library: "libnoise-1.2.0", ..functions }, one, first);
    Ok(())
}

fn libnoise(libnoise: Run, one: f32, first: f32) {
    let side = libnoise.side;
    // its own frequencies are slower
    let place = |x: f32, y: f32| [f64::from(x * first), f64::from(y * first)];
    let plain = Source::perlin(7);
    libnoise
        .time("perlin", 1, |out| fill(out, side, |x, y| plain.sample([f64::from(x * one), f64::from(y * one)]) as f32));
    let sum = Source::perlin(7).fbm(8, 1.0, 2.0, 0.5);
    libnoise.time("perlin", 8, |out| fill(out, side, |x, y| sum.sample(place(x, y)) as f32));
    for octaves in [8, 12] {
        let ridged = Source::perlin(7).ridgedmulti(octaves, 1.0, 2.0, 2.0);
        libnoise.time("ridged", octaves, |out| fill(out, side, |x, y| ridged.sample(place(x, y)) as f32));
    }
}

fn fill(out: &mut [f32], side: usize, noise: impl Fn(f32, f32) -> f32) {
    for (y, row) in out.chunks_exact_mut(side).enumerate() {
        for (x, height) in row.iter_mut().enumerate() {
            *height = noise(x as f32, y as f32);
        }
    }
}

struct Run {
    library: &'static str,
    side: usize,
    repeats: usize,
}

impl Run {
    /// Prints the median time of a raster, after one run to warm up.
    fn time(&self, kernel: &str, octaves: u32, run: impl Fn(&mut [f32])) {
        let mut out = vec![0.0; self.side * self.side];
        run(&mut out);
        let mut times = Vec::new();
        for _ in 0..self.repeats {
            let start = processor_ns();
            run(&mut out);
            times.push((processor_ns() - start) / (self.side * self.side) as f64);
        }
        times.sort_by(f64::total_cmp);
        println!("{kernel} {octaves} {} {:.3}", self.library, times[self.repeats / 2]);
    }
}

/// Processor time of this thread in nanoseconds.
fn processor_ns() -> f64 {
    std::thread::yield_now();
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    told.split(' ').next().and_then(|ns| ns.parse().ok()).unwrap_or(f64::NAN)
}
