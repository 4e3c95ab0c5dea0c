//! Uplift: domes, ranges, faults and plates.
//!
//! The shapes are those of landscape evolution models; each module gives its formula. This module applies the variation
//! and writes the outputs, which all shapes have in common.

mod fault;
mod plates;

use orograph_graph::memory::zeroed;

use self::{fault::Fault, plates::Plates};
use crate::{
    numerics::{
        math,
        noise::{Basis, Fractal, sum},
        par,
        range::{Range, paths},
    },
    prelude::*,
};

choice! {
    /// Shape of the uplift.
    pub enum Shape {
        /// A dome about `centre`.
        Gaussian = "gaussian",
        /// A range along `path`, with a `front` to its right and a `back` to its left.
        Range = "range",
        /// Two blocks along the line through `centre` at `azimuth`: the left one rises and the right one sinks.
        Fault = "fault",
        /// Drifting plates: terrain rises where they collide and sinks where they diverge.
        Plates = "plates",
        /// The same everywhere.
        Uniform = "uniform",
    }
}

params! {
    /// Shape of the uplift.
    shape: Shape = Shape::Gaussian, One, ..;
    /// Maximum rate, or, for a fault, the total throw rate; where the rate is negative, the terrain sinks.
    rate: f64 = 0.001, MetresPerYear, -1.0..=1.0, soft 0..=0.005;
    /// Duration of the uplift in `displacement`.
    duration: f64 = 1e6, Years, 0.0..=1e9, soft 0..=1e7;
    /// Centre of a dome, or a point on a fault, from the world's north-west corner.
    centre: Position = Position([8192.0, 8192.0]), Metres, -1e7..=1e7, when shape = "gaussian" | "fault";
    /// Distance from the centre of a dome at which the rate has fallen to 61 % (one standard deviation).
    radius: f64 = 5000.0, Metres, 1.0..=1e7, soft 500..=50000, when shape = "gaussian";
    /// Points along the crest of a range.
    path: PathPoints = PathPoints(vec![[1500.0, 11500.0], [6500.0, 9500.0], [10000.0, 6500.0], [15000.0, 5000.0]]), Metres, -1e7..=1e7, when shape = "range", unless lines;
    /// Distance to the right of a range's path at which the rate has fallen to 61 %.
    front: f64 = 1500.0, Metres, 1.0..=1e7, soft 500..=50000, when shape = "range";
    /// Distance to the left of a range's path at which the rate has fallen to 61 %.
    back: f64 = 3000.0, Metres, 1.0..=1e7, soft 500..=100000, when shape = "range";
    /// Direction of a fault, clockwise from north; the block to its right sinks.
    azimuth: f64 = 30.0, Degrees, -360.0..=360.0, soft 0..=360, when shape = "fault";
    /// Distance on each side of a fault within which 71 % of the step lies.
    step: f64 = 100.0, Metres, 0.1..=1e6, soft 10..=2000, when shape = "fault";
    /// Distance from a fault at which the motion of both blocks has fallen to 37 %.
    decay: f64 = 10000.0, Metres, 1.0..=1e9, soft 5000..=20000, when shape = "fault";
    /// Fraction of a fault's throw by which the left block rises; the right one sinks by the rest.
    footwall: f64 = 0.3, One, 0.0..=1.0, when shape = "fault";
    /// Mean distance between the centres of neighbouring plates.
    plate_size: f64 = 8000.0, Metres, 100.0..=1e8, soft 2000..=1000000, when shape = "plates";
    /// Width of the belts where plates meet; at most a tenth of `plate_size`.
    belt: f64 = 500.0, Metres, 1.0..=1e7, soft 100..=100000, when shape = "plates";
    /// How much the rate varies from place to place, as a fraction of it.
    variation: f64 = 0.0, One, 0.0..=1.0, soft 0..=0.5;
    /// Longest wavelength of the variation.
    variation_size: f64 = 5000.0, Metres, 1.0..=1e7, soft 1000..=50000, given variation;
    /// Random seed of plates and variation.
    seed: Seed = Seed(0), Count, ..;
}

inputs! {
    /// Factor on the rate, per cell if wired: a painted map of uplift.
    map: Mask = 1.0, 0.0..=1.0;
    /// Lines along the crests of a range, such as those of `Path`.
    lines: Option<Lines>;
}

outputs! {
    /// Rate of uplift.
    uplift: Scalar(MetresPerYear);
    /// Uplift over `duration`.
    displacement: Height;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Uplift",
    category: "tectonics",
    summary: "Uplift and subsidence: domes, ranges, faults, plates.",
    doc: include_str!("uplift.md"),
    sources: &[
        "J. Braun and S. D. Willett (2013), A very efficient O(n), implicit and parallel method to solve the stream \
         power equation governing fluvial incision and landscape evolution, Geomorphology 180-181, 170-179",
        "G. Cordonnier, J. Braun, M.-P. Cani, B. Benes, É. Galin, A. Peytavie and É. Guérin (2016), Large scale terrain \
         generation from tectonic uplift and fluvial erosion, Computer Graphics Forum 35 (2), 165-175",
        "P. England and D. McKenzie (1982), A thin viscous sheet model for continental deformation, Geophysical \
         Journal of the Royal Astronomical Society 70, 295-321",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::Point,
    cpu: run,
    example: "centre: (8000, 8000), radius: 5000, rate: 0.001",
    ..Node::DEFAULT
};

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let window = job.window();
    let mut uplift = params.shape(job)?;
    if params.variation > 0.0 {
        let noise = params.noise(job)?;
        par::rows(job, &mut uplift, |j, row| {
            for (uplift, noise) in row.iter_mut().zip(&noise[j * window.nx()..]) {
                *uplift *= 1.0 + noise;
            }
        })?;
    }
    let map = Inputs::read(job)?.map;
    let duration_yr = params.duration as f32;
    par::rows(job, &mut uplift, |j, row| {
        let map = map.slice(j * window.nx()..(j + 1) * window.nx());
        for (i, uplift) in row.iter_mut().enumerate() {
            *uplift *= map.at(i);
        }
    })?;
    let wants = Wants::of(job);
    let field = |samples| Field::new(window, samples);
    Ok(Given {
        displacement: wants.displacement.then(|| field(par::map_of(&uplift, |rate| rate * duration_yr))),
        uplift: wants.uplift.then(|| field(uplift)),
    }
    .into())
}

impl Params {
    /// Returns the rate of the shape without variation.
    fn shape(&self, job: &Job<'_>) -> Result<Vec<f32>, NodeError> {
        match self.shape {
            Shape::Gaussian => self.dome(job),
            Shape::Range => {
                let paths = paths(Inputs::read(job)?.lines, &self.path.0);
                Range { paths, widths_m: [self.front, self.back] }.gaussian(job, self.rate)
            }
            Shape::Fault => Fault {
                centre: self.centre.0,
                azimuth_deg: self.azimuth,
                step_m: self.step,
                decay_m: self.decay,
                footwall: self.footwall,
                rate: self.rate,
            }
            .raster(job),
            Shape::Plates if self.belt > plates::WIDEST * self.plate_size => Err(NodeError::failed_with_hint(
                "the belts between the plates are wider than a tenth of a plate",
                format!("write `belt: {}` or less", orograph_graph::plain(plates::WIDEST * self.plate_size)),
            )),
            Shape::Plates => {
                Plates { size_m: self.plate_size, belt_m: self.belt, rate: self.rate, seed: job.seed() }.raster(job)
            }
            Shape::Uniform => Ok(vec![self.rate as f32; job.window().len()]),
        }
    }

    /// U = U₀ exp(−r² / 2R²).
    fn dome(&self, job: &Job<'_>) -> Result<Vec<f32>, NodeError> {
        let window = job.window();
        // the exponential of a sum of squares is the product of two
        let falloff = |at_m: f64, centre_m: f64| {
            let distance = (at_m - centre_m) / self.radius;
            math::exp(-0.5 * distance * distance)
        };
        let columns: Vec<f64> = (0..window.nx()).map(|i| falloff(window.centre_m(i, 0)[0], self.centre[0])).collect();
        let mut uplift = zeroed(window.len())?;
        par::rows(job, &mut uplift, |j, row| {
            let along = self.rate * falloff(window.centre_m(0, j)[1], self.centre[1]);
            for (uplift, across) in row.iter_mut().zip(&columns) {
                *uplift = (along * across) as f32;
            }
        })?;
        Ok(uplift)
    }

    /// Noise between ± `variation`.
    fn noise(&self, job: &Job<'_>) -> Result<Vec<f32>, NodeError> {
        let fractal = Fractal {
            wavelength_m: self.variation_size,
            octaves: 2,
            lacunarity: 2.0,
            gain: 0.5,
            tileable: false,
            // a seed different from that of the plates
            seed: orograph_graph::mix(job.seed() ^ 0x5851_f42d),
        };
        let octaves = fractal.octaves(job.world());
        sum::lattices(job, &octaves, Basis::Bell, self.variation)
    }
}

#[cfg(test)]
mod tests;
