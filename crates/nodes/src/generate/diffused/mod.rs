//! White noise smoothed many times by a mean filter.
//!
//! G. Dahan (2025), "La création et la manipulation de champs de hauteur": layers of a 3 x 3 mean filter on white
//! noise, and a blend of 2, 4, 8, ... layers. Both are computed by their effect on cosine waves, at a cost
//! independent of the number of layers. A third form is their limit, Gaussian smoothing by a length in metres, which
//! does not depend on the cells.

mod mirror;

use orograph_graph::{World, memory::zeroed, mix};

use super::spectral::torus::{Draw, Spectrum, Torus};
use crate::{
    numerics::{fourier::LANES, math::lane, par},
    prelude::*,
};

choice! {
    /// How noise is smoothed.
    pub enum Form {
        /// By a Gaussian of the length `correlation`; `octaves` adds finer and lower noise.
        Gaussian = "gaussian",
        /// By `layers` of the mean filter on the cells.
        Layers = "layers",
        /// A blend of 1, 2, 4, ... layers of the mean filter, up to 2 to the power of `octaves`.
        Fractal = "fractal",
    }
}

params! {
    /// How noise is smoothed.
    form: Form = Form::Gaussian, One, ..;
    /// Root mean square height, averaged over many seeds.
    relief: f64 = 200.0, Metres, 0.0..=1e5, soft 10..=2000;
    /// Standard deviation of the Gaussian that smooths the coarsest noise.
    correlation: f64 = 900.0, Metres, 0.01..=1e7, soft 50..=5000, when form = "gaussian";
    /// Number of noises, each with half the length of the one before; in the fractal form, doublings of the layers.
    octaves: i64 = 6, Count, 1..=12, when form = "gaussian" | "fractal";
    /// Height of each finer noise as a fraction of the one before.
    gain: f64 = 0.5, One, 0.0..=1.0, soft 0.3..=0.7, when form = "gaussian";
    /// Passes of the mean filter.
    layers: i64 = 150, Count, 0..=100_000, soft 0..=500, when form = "layers";
    /// Weight of the filtered values in each pass of the mean filter, and of the coarser layers in their blend.
    alpha: f64 = 0.5, One, 0.0..=1.0, when form = "layers" | "fractal";
    /// Makes opposite sides of the world fit together. Gaussian form only; the others are mirrored at the sides.
    tileable: bool = false, One, .., when form = "gaussian";
    /// Random seed of the noise.
    seed: Seed = Seed(0), Count, ..;
}

outputs! {
    /// Height above the mean of the terrain.
    height: Height;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Diffused",
    category: "generate",
    summary: "Soft, rounded hills: white noise smoothed by diffusion.",
    doc: include_str!("../diffused.md"),
    sources: &[
        "G. Dahan (2025), La création et la manipulation de champs de hauteur, travail d'initiative personnelle encadré",
        "J. Makhoul (1980), A fast cosine transform in one and two dimensions, IEEE Transactions on Acoustics, Speech, and \
         Signal Processing 28 (1), 27-34",
    ],
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::World,
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    example: "correlation: 1200, octaves: 2",
    ..Node::DEFAULT
};

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    let params = Params::read(sizing.params);
    match params.form {
        Form::Gaussian => params.torus(&sizing.window.world).bytes(&sizing.window, &Hills::new(&params)),
        // noise in double precision and its transform
        Form::Layers | Form::Fractal => sizing.cells(12.0),
    }
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let height = match params.form {
        Form::Gaussian => params.gaussian(job)?,
        Form::Layers => {
            let layers = params.layers as u32;
            layered(job, params.relief, |mean| power(layer(params.alpha, mean), layers))?
        }
        Form::Fractal => layered(job, params.relief, |mean| blend(params.alpha, params.octaves as u32, mean))?,
    };
    Ok(Given { height: Some(Field::new(job.window(), height)) }.into())
}

impl Params {
    fn torus(&self, world: &World) -> Torus {
        if self.tileable { Torus::tiled(world) } else { Torus::around(world, 8.0 * self.correlation) }
    }

    fn gaussian(&self, job: &Job<'_>) -> Result<Vec<f32>, NodeError> {
        let torus = self.torus(job.world());
        let hills = Hills::new(self);
        torus.sum(job, Draw { seed: job.seed(), even: false }, &hills)
    }
}

/// Sum of Gaussian spectra, one for each octave.
struct Hills {
    /// For each octave, the factor of the squared wavenumber (waves per metre) in the exponent, and its density at
    /// wavenumber 0.
    octaves: Vec<[f32; 2]>,
    /// Waves per metre above which the spectrum is 0.
    end: f64,
}

/// Exponent below which an octave is less than the last bit of the strongest one.
const LEAST: f64 = -60.0;

impl Hills {
    /// The density of an octave with correlation length L and the fraction s of the variance is `4π s L² exp(−4π² L²
    /// f²)`.
    fn new(params: &Params) -> Self {
        use std::f64::consts::PI;
        let octaves = (0..params.octaves as u32).map(|octave| {
            let length_m = params.correlation / power(2.0, octave);
            (length_m * length_m, power(params.gain * params.gain, octave))
        });
        let octaves: Vec<(f64, f64)> = octaves.collect();
        let total: f64 = octaves.iter().map(|(_, share)| share).sum();
        let finest =
            octaves.iter().filter(|(_, share)| *share > 0.0).fold(f64::INFINITY, |least, (area, _)| least.min(*area));
        let scale = 4.0 * PI * params.relief * params.relief / total;
        Self {
            octaves: octaves
                .iter()
                .map(|(area, share)| [(-4.0 * PI * PI * area) as f32, (scale * share * area) as f32])
                .collect(),
            end: (-LEAST / (4.0 * PI * PI * finest)).sqrt(),
        }
    }
}

impl Spectrum for Hills {
    #[inline(always)]
    fn roots(&self, east: &[f32; LANES], south: f32) -> [f32; LANES] {
        let mut roots = [0.0; LANES];
        // the longest of these waves
        let least = east[0] * east[0] + south * south;
        for &[exponent, density] in &self.octaves {
            if least * exponent > LEAST as f32 {
                for lane in 0..LANES {
                    let square = east[lane] * east[lane] + south * south;
                    roots[lane] += density * lane::exp2(std::f32::consts::LOG2_E * exponent * square);
                }
            }
        }
        roots.map(f32::sqrt)
    }

    fn end(&self) -> f64 {
        self.end
    }
}

/// Returns the response of the 3 x 3 mean filter, with a weight of 2 in the middle, to a wave; x and y are the cosines
/// of its phase steps from cell to cell.
fn mean(x: f64, y: f64) -> f64 {
    ((1.0 + 2.0 * x) * (1.0 + 2.0 * y) + 1.0) / 10.0
}

/// Returns the response of one layer to a wave for which that of the mean filter is `mean`.
fn layer(alpha: f64, mean: f64) -> f64 {
    1.0 - alpha + alpha * mean
}

/// Returns the response of the fractal blend to it: `h₀ = F₁, hᵢ = α hᵢ₋₁ + (1 − α) F₂ᵢ`, where Fₗ is l layers on the
/// same noise.
fn blend(alpha: f64, doublings: u32, mean: f64) -> f64 {
    let mut layers = layer(alpha, mean);
    let mut blend = layers;
    for _ in 0..doublings {
        layers *= layers;
        blend = alpha * blend + (1.0 - alpha) * layers;
    }
    blend
}

/// Returns `base` raised to an integer power.
fn power(mut base: f64, mut exponent: u32) -> f64 {
    let mut power = 1.0;
    while exponent > 0 {
        if exponent % 2 == 1 {
            power *= base;
        }
        base *= base;
        exponent /= 2;
    }
    power
}

/// Returns white noise on the cells of the world, filtered and scaled to a root mean square of `relief`.
/// `response(m)` is the filter's response to a wave for which that of one mean is m.
fn layered(job: &Job<'_>, relief: f64, response: impl Fn(f64) -> f64 + Sync) -> Result<Vec<f32>, NodeError> {
    let window = job.window();
    let seed = job.seed();
    let noise = (0..window.ny() as u32).flat_map(|j| {
        let row = mix(j.wrapping_mul(0xd816_3841).wrapping_add(seed));
        (0..window.nx() as u32).map(move |i| {
            let key = mix(i.wrapping_mul(0x8da6_b343).wrapping_add(row));
            (f64::from(key >> 8) + 0.5) / f64::from(1 << 24) - 0.5
        })
    });
    let response = |x: f64, y: f64| response(mean(x, y));
    let filtered = mirror::filter(job, noise.collect(), window.nx(), response)?;
    // uniform noise from -½ to ½ has a variance of 1/12
    let variance = mirror::variance(job, [window.nx(), window.ny()], response)? / 12.0;
    let scale = relief / variance.sqrt();
    let mut height = zeroed(window.len())?;
    par::rows_within(job, [0.9, 1.0], &mut height, |j, row| {
        for (height, value) in row.iter_mut().zip(&filtered[j * window.nx()..]) {
            *height = (scale * value) as f32;
        }
    })?;
    Ok(height)
}

#[cfg(test)]
mod tests;
