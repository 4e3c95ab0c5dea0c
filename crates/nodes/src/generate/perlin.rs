//! Fractional Brownian motion from octaves of gradient noise.
//!
//! K. Perlin (1985), "An image synthesizer"; K. Perlin (2002), "Improving noise"; F. K. Musgrave, C. E. Kolb and R. S.
//! Mace (1989), "The synthesis and rendering of eroded fractal terrains". What differs from them is told in
//! [`super::noise`].

use super::noise::{Fractal, Gradients, NOISE_SCALE, Octave, raster};
use crate::prelude::*;
use crate::simd::simd;

params! {
    /// Wavelength of the largest hills.
    wavelength: f64 = 4000.0, Metres, 1.0..=1e6, soft 200..=20000;
    /// Octaves, from coarse to fine; those finer than the cells can hold are left out.
    octaves: i64 = 12, Count, 1..=24, soft 1..=16;
    /// Ratio of the wavelength of an octave to that of the next finer one.
    lacunarity: f64 = 2.0, One, 1.1..=8.0, soft 1.7..=3.0;
    /// Ratio of the amplitude of an octave to that of the one before: how rough the land is.
    gain: f64 = 0.5, One, 0.0..=1.0, soft 0.3..=0.7;
    /// Largest height above and depth below zero; the standard deviation is about 0.18 of it at the defaults.
    amplitude: f64 = 1000.0, Metres, 0.0..=1e6, soft 0..=4000;
    /// Directions of the gradients.
    gradients: Gradients = Gradients::Even, One, ..;
    /// Which of the endless landscapes this is.
    seed: Seed = Seed(0), Count, ..;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Perlin",
    category: "generate",
    summary: "Rolling hills: fractional Brownian motion from octaves of gradient noise.",
    doc: include_str!("perlin.md"),
    sources: &[
        "K. Perlin, 1985, An image synthesizer",
        "K. Perlin, 2002, Improving noise",
        "F. K. Musgrave, C. E. Kolb, R. S. Mace, 1989, The synthesis and rendering of eroded fractal terrains",
        "D. S. Ebert, F. K. Musgrave, D. Peachey, K. Perlin, S. Worley, 2003, Texturing and Modeling",
    ],
    outputs: &[Output::gives("height", PortType::Height, "Elevation, between ± `amplitude`.")],
    params: Params::specs,
    cpu: run,
    example: "wavelength: 5000, octaves: 10, gain: 0.45, amplitude: 800, seed: 3",
    ..Node::DEFAULT
};

impl Params {
    fn fractal(&self, seed: u32) -> Fractal {
        Fractal {
            wavelength_m: self.wavelength,
            octaves: self.octaves,
            lacunarity: self.lacunarity,
            gain: self.gain,
            seed,
            gradients: self.gradients,
        }
    }
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let octaves = params.fractal(job.seed()).octaves(job.cell_m());
    let sum = Sum { scales: octaves.iter().map(|octave| scale(octave, params.amplitude)).collect() };
    let samples = raster::raster(job, &octaves, params.gradients, &sum)?;
    Ok(Outputs::one("height", Field::new(job.window(), samples)))
}

/// Factor on an octave's noise: its share of the amplitude, in metres.
fn scale(octave: &Octave, amplitude_m: f64) -> f32 {
    (amplitude_m * octave.share * octave.fade) as f32 * NOISE_SCALE
}

/// The plain sum of octaves.
struct Sum {
    scales: Vec<f32>,
}

impl raster::Combine for Sum {
    type Row = ();

    fn scale(&self, octave: usize) -> f32 {
        self.scales[octave]
    }

    fn begin(&self, (): &mut (), heights: &mut [f32]) {
        heights.fill(0.0);
    }

    fn add(&self, _: usize, noise: &raster::OctaveRow<'_>, (): &mut (), heights: &mut [f32]) {
        add_row(heights, noise.p, noise.q, noise.e, noise.f, noise.t, noise.v);
    }

    fn end(&self, (): &mut (), _: &mut [f32]) {}
}

simd! {
    /// Adds an octave to a row of heights.
    fn add_row(heights: &mut [f32], p: &[f32], q: &[f32], e: &[f32], f: &[f32], t: f32, v: f32) {
        for ((((h, p), q), e), f) in heights.iter_mut().zip(p).zip(q).zip(e).zip(f) {
            *h += p + t * q + v * (e + t * f);
        }
    }
}
