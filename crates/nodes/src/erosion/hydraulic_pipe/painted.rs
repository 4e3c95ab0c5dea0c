//! Terrain and rain of a run: the inputs, the spring, and the strokes painted on both.

use orograph_graph::{Stroke, Tool, memory::zeroed};

use super::{Inputs, Params, band::Scene, budget, physics::Physics};
use crate::{
    numerics::{
        beds::{Beds, Ground},
        strokes::{Path, act},
    },
    prelude::*,
};

/// Terrain and rain where they differ from the inputs.
#[derive(Clone, Debug, Default)]
pub(super) struct Painted {
    pub land: Option<Vec<f32>>,
    /// Rain with the spring in it, in mm/h.
    spring: Option<Vec<f32>>,
    /// Rain that was painted, in mm/h.
    drops: Option<Vec<f32>>,
    /// All of that together.
    pub rain: Option<Vec<f32>>,
    /// Layers of rock, where there are any.
    beds: Option<Beds>,
}

impl Painted {
    pub fn new(job: &Job<'_>, inputs: &Inputs<'_>, params: &Params) -> Self {
        let beds = inputs.strata.map(|strata| Beds::of_rock(strata.column()));
        Self { spring: spring(job, inputs.rain, params), beds, ..Self::default() }
    }

    /// Terrain height.
    pub fn land<'s>(&'s self, job: &'s Job<'_>) -> Result<&'s [f32], NodeError> {
        let input = Inputs::read(job)?.height.samples();
        Ok(self.land.as_deref().unwrap_or(input))
    }

    /// Returns the inputs of a run with these physics.
    pub fn scene<'s>(&'s self, job: &'s Job<'_>, physics: Physics) -> Result<Scene<'s>, NodeError> {
        let (window, inputs) = (job.window(), Inputs::read(job)?);
        let rain = self.rain.as_deref().or(self.spring.as_deref());
        let strata = self.beds.as_ref().zip(inputs.strata);
        Ok(Scene {
            cells: [window.nx(), window.ny()],
            boundary: job.world().boundary,
            land: self.land(job)?,
            rain: rain.map_or(inputs.rain, Lane::Samples),
            erodibility: inputs.erodibility,
            ground: strata.map(|(beds, strata)| Ground { beds, offset: strata.offset().samples() }),
            physics,
        })
    }

    /// Returns its inputs without painted rain.
    pub fn dry_scene<'s>(&'s self, job: &'s Job<'_>, physics: Physics) -> Result<Scene<'s>, NodeError> {
        let rain = self.spring.as_deref().map_or(Inputs::read(job)?.rain, Lane::Samples);
        Ok(Scene { rain, ..self.scene(job, physics)? })
    }

    /// Rain that was painted, over all land, in mm/h.
    pub fn drops(&self, scene: &Scene<'_>) -> f64 {
        self.drops.as_deref().map_or(0.0, |drops| budget::rain(&Scene { rain: Lane::Samples(drops), ..*scene }))
    }

    /// Applies strokes, in order; `fraction` of the run is done.
    pub fn paint(&mut self, strokes: &[Stroke], job: &Job<'_>, fraction: f32) -> Result<(), NodeError> {
        let mut rains = false;
        for stroke in strokes {
            let path = Path::new(stroke, job.world());
            match stroke.tool {
                Tool::Raise | Tool::Lower => {
                    let mut land = self.land(job)?.to_vec();
                    act(job, [fraction; 2], &[&path], &mut land, |path, height, metres| match path.tool {
                        Tool::Raise => height + metres,
                        _ => height - metres,
                    })?;
                    self.land = Some(land);
                }
                _ => {
                    let mut drops = self.drops.take().map_or_else(|| zeroed(job.window().len()), Ok)?;
                    act(job, [fraction; 2], &[&path], &mut drops, |path, rain, weight| match path.tool {
                        Tool::Rain => rain + weight,
                        _ => rain - rain * weight,
                    })?;
                    self.drops = Some(drops);
                    rains = true;
                }
            }
        }
        if rains && let Some(drops) = &self.drops {
            let lane = self.spring.as_deref().map_or(Inputs::read(job)?.rain, Lane::Samples);
            self.rain = Some(drops.iter().enumerate().map(|(at, drop)| lane.at(at).max(0.0) + drop).collect());
        }
        Ok(())
    }
}

/// Returns rain including the spring, in mm/h. Returns None when there is no spring.
fn spring(job: &Job<'_>, rain: Lane<'_>, params: &Params) -> Option<Vec<f32>> {
    let rates = spring_rates(job, params)?;
    Some(rates.iter().enumerate().map(|(at, rate)| rain.at(at).max(0.0) + rate).collect())
}

/// Returns the water of the spring, in mm/h. Returns None when there is none.
///
/// It is spread with the weight (1 - distance / radius)₊, or falls on the cell it is in.
pub(super) fn spring_rates(job: &Job<'_>, params: &Params) -> Option<Vec<f32>> {
    if params.river <= 0.0 {
        return None;
    }
    let window = job.window();
    let weight = |at: usize| {
        let [x, y] = window.centre_m(at % window.nx(), at / window.nx());
        let [dx, dy] = [x - params.river_at[0], y - params.river_at[1]];
        let radius_m = params.river_radius.max(job.cell_m());
        (1.0 - (dx * dx + dy * dy).sqrt() / radius_m).max(0.0)
    };
    let sum: f64 = (0..window.len()).map(weight).sum();
    // mm/h over one cell that are 1 m³/s
    let rate = 3.6e6 * params.river / (job.cell_m() * job.cell_m()) / sum.max(f64::MIN_POSITIVE);
    Some((0..window.len()).map(|at| (weight(at) * rate) as f32).collect())
}
