//! Spectral synthesis: terrain as a sum of random waves with a power-law spectrum.
//!
//! A. Fournier, D. Fussell and L. Carpenter (1982), "Computer rendering of stochastic models", and D. Saupe in H.-O.
//! Peitgen and D. Saupe (1988), "The Science of Fractal Images". Differences: random draws belong to waves of the world
//! and not to cells of a raster, the spectrum is bounded on both sides by scales in metres, and heights are in metres
//! by a closed form instead of rescaling the result.

mod device;
pub(super) mod torus;

use orograph_graph::World;

use self::torus::{Draw, Spectrum, Torus};
use crate::{
    numerics::{
        fourier::LANES,
        math::{self, lane},
    },
    prelude::*,
};

choice! {
    /// Spectrum whose exponent is `beta`.
    pub enum Convention {
        /// The power spectrum of a profile across the terrain, f^−β with β = 2H + 1: used by most measurements.
        Profile = "profile",
        /// The power spectrum of the surface by wave number, f^−β with β = 2H + 2.
        Surface = "surface",
    }
}

choice! {
    /// How wave amplitudes are drawn.
    pub enum Amplitudes {
        /// Gaussian: as in nature, some waves are higher and some lower than the spectrum.
        Random = "random",
        /// Every wave has exactly the amplitude of the spectrum; only phases are random.
        Even = "even",
    }
}

params! {
    /// Root mean square of heights around their mean, over an area much larger than the longest waves.
    relief: f64 = 250.0, Metres, 0.0..=1e5, soft 10..=2000;
    /// How steeply power falls with frequency: higher values are smoother.
    beta: f64 = 2.6, One, 0.0..=6.0, soft 1.5..=3.5;
    /// Spectrum whose exponent is `beta`.
    convention: Convention = Convention::Profile, One, ..;
    /// Wavelength of the longest waves.
    outer_scale: f64 = 10000.0, Metres, 0.01..=1e8, soft 1000..=50000;
    /// Wavelength of the shortest waves.
    inner_scale: f64 = 20.0, Metres, 0.001..=1e7, soft 1..=500;
    /// How many times longer waves are along `azimuth` than across it.
    stretch: f64 = 1.0, One, 1.0..=100.0, soft 1..=10;
    /// Direction along which the terrain is stretched, clockwise from north.
    azimuth: f64 = 45.0, Degrees, -360.0..=360.0, soft 0..=180;
    /// How wave amplitudes are drawn.
    amplitudes: Amplitudes = Amplitudes::Random, One, ..;
    /// Makes opposite sides of the world fit together.
    tileable: bool = false, One, ..;
    /// Random seed of the waves.
    seed: Seed = Seed(0), Count, ..;
}

outputs! {
    /// Height above the mean of the terrain.
    height: Height;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Spectral",
    category: "generate",
    summary: "Terrain with a given power spectrum: a sum of random waves of all lengths and directions.",
    doc: include_str!("../spectral.md"),
    sources: &[
        "A. Fournier, D. Fussell and L. Carpenter (1982), Computer rendering of stochastic models, Communications of the ACM \
         25 (6), 371-384",
        "D. Saupe (1988), Algorithms for random fractals, in H.-O. Peitgen and D. Saupe (eds), The Science of Fractal Images, \
         Springer",
    ],
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::World,
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    gpu: Some(&device::GPU),
    resolution: Resolution::Within(0.05),
    example: "outer_scale: 8000, beta: 3",
    ..Node::DEFAULT
};

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    let params = Params::read(sizing.params);
    params.torus(&sizing.window.world).bytes(&sizing.window, &Power::new(&params))
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    checked(job, &params)?;
    let power = Power::new(&params);
    let height = params.torus(job.world()).sum(job, params.draw(job), &power)?;
    Ok(Given { height: Some(Field::new(job.window(), height)) }.into())
}

/// Refuses scales the wrong way around, and warns of waves that the cells cannot represent.
fn checked(job: &Job<'_>, params: &Params) -> Result<(), NodeError> {
    if params.inner_scale >= params.outer_scale {
        return Err(NodeError::failed_with_hint(
            "the shortest waves are not shorter than the longest",
            format!("write an `inner_scale` below {}", orograph_graph::plain(params.outer_scale)),
        ));
    }
    if 2.0 * job.cell_m() > params.outer_scale {
        job.warn("waves as long as `outer_scale` are shorter than two cells: the terrain is flat");
    }
    Ok(())
}

impl Params {
    fn draw(&self, job: &Job<'_>) -> Draw {
        Draw { seed: job.seed(), even: self.amplitudes == Amplitudes::Even }
    }

    fn torus(&self, world: &World) -> Torus {
        if self.tileable { Torus::tiled(world) } else { Torus::around(world, self.outer_scale * self.stretch.sqrt()) }
    }
}

/// A power-law spectrum between two scales.
struct Power {
    /// Half the exponent of the power spectral density of the surface.
    fall: f64,
    /// Root of the density at the outer scale, in m².
    root: f64,
    /// Octaves between the outer and the inner scale.
    octaves: f64,
    /// East and south components of a unit frequency along the stretch and across it, scaled by the stretch, in waves
    /// per outer scale.
    along_m: [f32; 2],
    across_m: [f32; 2],
    /// Waves per metre above which the spectrum is 0.
    end: f64,
}

impl Power {
    fn new(params: &Params) -> Self {
        let beta = match params.convention {
            Convention::Profile => params.beta + 1.0,
            Convention::Surface => params.beta,
        };
        let azimuth = params.azimuth.to_radians();
        let (east, south) = (math::sin(azimuth), -math::cos(azimuth));
        let (long_m, short_m) =
            (params.outer_scale * params.stretch.sqrt(), params.outer_scale / params.stretch.sqrt());
        let octaves = math::log2(params.outer_scale / params.inner_scale);
        let mut power = Self {
            fall: 0.5 * beta,
            root: 1.0,
            octaves,
            along_m: [(east * long_m) as f32, (south * long_m) as f32],
            across_m: [(-south * short_m) as f32, (east * short_m) as f32],
            end: math::exp2(octaves + 0.5) / short_m,
        };
        power.root = params.relief * params.outer_scale / power.total().sqrt();
        power
    }

    /// The integral of `f^−β` over the plane of frequencies, at unit outer scale: `2π ∫ f^(2−β) d ln f`.
    fn total(&self) -> f64 {
        const STEPS: u32 = 4096;
        let step = (self.octaves + 1.0) / f64::from(STEPS);
        let sum: f64 = (0..STEPS)
            .map(|k| {
                let octave = (f64::from(k) + 0.5) * step - 0.5;
                let share = math::smoothstep(octave + 0.5) * math::smoothstep(self.octaves + 0.5 - octave);
                share * share * math::exp2(2.0 * (1.0 - self.fall) * octave)
            })
            .sum();
        std::f64::consts::TAU * std::f64::consts::LN_2 * step * sum
    }
}

impl Spectrum for Power {
    #[inline(always)]
    fn roots(&self, east: &[f32; LANES], south: f32) -> [f32; LANES] {
        let (fall, octaves, root) = (-self.fall as f32, self.octaves as f32, self.root as f32);
        let mut roots = [0.0; LANES];
        for lane in 0..LANES {
            let along = east[lane] * self.along_m[0] + south * self.along_m[1];
            let across = east[lane] * self.across_m[0] + south * self.across_m[1];
            let octave = 0.5 * lane::log2(along * along + across * across);
            // both ends fade over one octave
            let share = lane::smoothstep(octave + 0.5) * lane::smoothstep(octaves + 0.5 - octave);
            roots[lane] = root * share * lane::exp2(fall * octave);
        }
        roots
    }

    fn end(&self) -> f64 {
        self.end
    }
}

#[cfg(test)]
mod tests;
