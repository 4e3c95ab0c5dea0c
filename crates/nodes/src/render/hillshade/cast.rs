//! Cast shadows, and the part of the sky that each cell sees.

use orograph_graph::World;

use super::Params;
use crate::{
    numerics::{
        cells::BLOCK,
        horizon::{Horizon, Rays},
        math,
        simd::simd,
    },
    prelude::*,
};

/// Number of directions in which the sky is looked at.
pub(super) const AROUND: u32 = 12;

/// Growth of the sampling steps along a direction.
const GROWTH: f64 = 0.08;

/// Width of the edge of a shadow as a fraction of the sun's tangent: about 3° at an altitude of 45°, six suns, so that
/// edges are not jagged.
const EDGE: f64 = 0.1;

/// Returns the directions: towards the sun first.
pub(super) fn rays(params: &Params, world: &World) -> Rays {
    let sky = (0..AROUND).map(|k| 360.0 * f64::from(k) / f64::from(AROUND));
    Rays::new(std::iter::once(params.azimuth).chain(sky), params.distance, world, GROWTH)
}

/// Returns the distance around a cell in metres that is read.
pub(super) fn reach_m(distance_m: f64, cell_m: f64) -> f64 {
    Rays::reach_m(distance_m, cell_m, GROWTH)
}

/// Returns the tangents of the horizon at which the sun is hidden, and at which it is not.
pub(super) fn edge(params: &Params) -> [f32; 2] {
    let tangent = math::tan(params.altitude.min(89.9).to_radians());
    [(1.0 + 0.5 * EDGE) * tangent, (1.0 - 0.5 * EDGE) * tangent].map(|tangent| tangent as f32)
}

/// What terrain hides of sun and sky.
pub(super) struct Cast<'a> {
    horizon: Horizon<'a>,
    exaggeration: f32,
    strength: f32,
    /// Tangents of the horizon at which the sun is hidden, and at which it is not.
    edge: [f32; 2],
}

impl<'a> Cast<'a> {
    /// Prepares horizons; returns None if the light has no shadows.
    pub fn new(job: &Job<'_>, height: &'a Field, params: &Params) -> Result<Option<Self>, NodeError> {
        if params.shadows == 0.0 {
            return Ok(None);
        }
        let horizon = Horizon::new(job, [0.0, 0.2], height, rays(params, &height.window().world))?;
        Ok(Some(Self {
            horizon,
            exaggeration: params.exaggeration as f32,
            strength: params.shadows as f32,
            edge: edge(params),
        }))
    }

    /// Computes the part of the sun and of the sky that the cells of a row see.
    pub fn row(&self, j: usize, lit: &mut [f32], sky: &mut [f32]) {
        let nx = lit.len();
        let mut tangents = [0.0; BLOCK];
        for start in (0..nx).step_by(BLOCK) {
            let columns = start..nx.min(start + BLOCK);
            let (lit, sky) = (&mut lit[columns.clone()], &mut sky[columns.clone()]);
            self.horizon.tangents(0, j, columns.clone(), &mut tangents);
            shadow(self, &tangents, lit);
            sky.fill(0.0);
            for ray in 1..self.horizon.rays() {
                self.horizon.tangents(ray, j, columns.clone(), &mut tangents);
                hide(self, &tangents, sky);
            }
            let share = self.strength / AROUND as f32;
            sky.iter_mut().for_each(|hidden| *hidden = 1.0 - (*hidden * share).min(1.0));
        }
    }
}

simd! {
    /// Computes the part of the sun above the horizon.
    fn shadow(cast: &Cast<'_>, tangents: &[f32], lit: &mut [f32]) {
        let [hidden, seen] = cast.edge;
        for (lit, &tangent) in lit.iter_mut().zip(tangents) {
            let part = (hidden - tangent * cast.exaggeration) / (hidden - seen);
            let part = if part < 1.0 { part } else { 1.0 };
            let part = if part > 0.0 { part } else { 0.0 };
            *lit = 1.0 - cast.strength * (1.0 - part);
        }
    }
}

simd! {
    /// Adds the squared sines of horizon angles: the hidden part of the light of an even sky.
    fn hide(cast: &Cast<'_>, tangents: &[f32], sums: &mut [f32]) {
        for (sum, &tangent) in sums.iter_mut().zip(tangents) {
            let tangent = tangent * cast.exaggeration;
            let square = tangent * tangent;
            *sum += square / (1.0 + square);
        }
    }
}
