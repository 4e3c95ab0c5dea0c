//! Slides: snow beyond what a slope holds moves down to where it is held.
//!
//! M. Bernhardt and K. Schulz (2010): cells are visited from high to low, and what exceeds the holding depth of a cell
//! is distributed to its lower neighbours, here in proportion to slope^1.1 (Freeman 1991). One pass carries snow from a
//! crest to the foot of its face.
//!
//! The slope that counts grows with the snow that comes to rest: a cell holds the depth h for which h is the holding
//! depth of the slope from its own surface, at h, to its lowest neighbour. Without that a single cell at the foot of a
//! face would keep what a whole face sheds. Hollows fill up and overflow as lakes do in `Flow`.

use std::{f32::consts::SQRT_2, f64::consts::PI};

use orograph_graph::{
    Field, Job, NodeError,
    memory::{copied, zeroed},
};

use super::{Law, Params};
use crate::numerics::{
    gradient::{Method, Surface},
    math::{self, lane},
    par,
    routing::{
        Depressions, Grid, Spread,
        code::{direction, has_receiver, is_diagonal},
        receivers, spread,
    },
};

/// Exponent of the slope in the distribution to lower neighbours.
const SPREAD: Spread = Spread::Freeman { exponent: 1.1 };
/// Bisections of the logarithm of the depth that a cell holds, to 1 %.
const BISECTIONS: u32 = 9;
/// Entries of the tables of holding depths per degree.
const PER_DEGREE: f64 = 20.0;

/// Returns the depth of snow in metres that a slope in degrees holds.
pub(super) fn held_m(law: Law, slope_deg: f64, least_m: f64) -> f64 {
    let held = match law {
        Law::Exponential => 145.0 * math::exp(-0.14 * slope_deg),
        // 0.1°: level ground holds any depth
        Law::Power => 3178.4 * math::pow(slope_deg.max(0.1), -1.998),
    };
    held.max(least_m)
}

/// The holding depths of a run, in metres, at equal steps of the slope.
pub(super) struct Holding {
    depths_m: Vec<f32>,
    least_m: f32,
}

impl Holding {
    pub fn new(params: &Params) -> Self {
        let depth = |k: usize| held_m(params.law, k as f64 / PER_DEGREE, params.least) as f32;
        Self { depths_m: (0..=(90.0 * PER_DEGREE) as usize + 1).map(depth).collect(), least_m: params.least as f32 }
    }

    /// Returns the depth that a slope, given by its tangent, holds.
    #[inline(always)]
    fn at(&self, tangent: f32) -> f32 {
        let place = lane::atan(tangent) * const { (PER_DEGREE * 180.0 / PI) as f32 };
        let at = place as usize;
        let (one, other) = (self.depths_m[at], self.depths_m[at + 1]);
        one + (place - at as f32) * (other - one)
    }

    /// Returns the depth that a cell holds: `most_m`, or less if its surface would then fall too steeply to a neighbour
    /// at the distance `length_m` whose surface is `above_m` higher than the ground of the cell.
    fn stable(&self, most_m: f32, above_m: f32, length_m: f32) -> f32 {
        let held = |depth_m: f32| self.at(((depth_m - above_m) / length_m).max(0.0));
        // on a plane both are equal but for the rounding of heights
        if held(most_m) >= (1.0 - 1e-3) * most_m {
            return most_m;
        }
        // the holding depth falls with the depth: they are equal at one place
        let (mut low, mut high) = (self.least_m, most_m);
        for _ in 0..BISECTIONS {
            let middle = (low * high).sqrt();
            if held(middle) >= middle {
                low = middle;
            } else {
                high = middle;
            }
        }
        low
    }
}

/// Lets snow, in metres of water, slide once. `to_depth` is the depth of snow per depth of water. Returns what leaves
/// the world, in metres of water on a cell.
///
/// # Errors
/// [`NodeError::Cancelled`], or not enough memory.
pub(super) fn slide(
    job: &Job<'_>,
    grid: &Grid,
    land: &[f32],
    holding: &Holding,
    to_depth: f64,
    snow: &mut [f64],
) -> Result<f64, NodeError> {
    let nx = grid.nx;
    let mut held = held_by_planes(job, grid, land, holding, to_depth, snow)?;
    // the surface of the snow that stays, and the ways down it
    let mut surface: Vec<f32> = zeroed(grid.cells())?;
    let rows = surface.chunks_mut(nx).zip(land.chunks(nx)).zip(snow.chunks(nx).zip(held.chunks(nx)));
    par::all(rows, |_, ((surface, land), (snow, held))| {
        for ((surface, land), (snow, held)) in surface.iter_mut().zip(land).zip(snow.iter().zip(held)) {
            *surface = (f64::from(*land) + (snow * to_depth).min(f64::from(*held))) as f32;
        }
    });
    let mut codes = zeroed(grid.cells())?;
    receivers::d8(job, grid, &surface, &mut codes)?;
    let sea_level = job.sea_level();
    if let Some(level) = sea_level {
        receivers::end_at_sea(land, level, &mut codes);
    }
    let mut depressions = Depressions::default();
    depressions.find(job, grid, &surface, &codes)?;
    depressions.carve(job, grid, &mut codes)?;
    depressions.fill(&mut surface);
    drop(depressions);

    par::each(held.chunks_mut(nx), |j, held| {
        job.check()?;
        for (i, held) in held.iter_mut().enumerate() {
            let (cell, code) = (j * nx + i, codes[j * nx + i]);
            if has_receiver(code) {
                let below = surface[grid.receiver(cell as u32, code) as usize];
                let length = if is_diagonal(direction(code)) { SQRT_2 } else { 1.0 };
                *held = holding.stable(*held, below - land[cell], length * job.cell_m() as f32);
            }
        }
        Ok::<_, NodeError>(())
    })?;
    let most = |cell: usize| match sea_level {
        Some(level) if f64::from(land[cell]) < level => 0.0,
        _ => f64::from(held[cell]) / to_depth,
    };
    let left = spread::overflow(job, grid, &surface, &codes, SPREAD, most, snow)?;
    Ok(left.into_iter().sum())
}

/// Returns the depths in metres that the slopes of the snow's surface hold, from planes through 3 x 3 cells.
fn held_by_planes(
    job: &Job<'_>,
    grid: &Grid,
    land: &[f32],
    holding: &Holding,
    to_depth: f64,
    snow: &[f64],
) -> Result<Vec<f32>, NodeError> {
    let nx = grid.nx;
    let mut surface = copied(land)?;
    par::change_with(&mut surface, snow, |surface, snow| {
        *surface = (f64::from(*surface) + snow * to_depth) as f32;
    });
    let surface = Field::new(job.window(), surface);
    let gradients = Surface::new(&surface, Method::Horn);
    let mut held = zeroed(grid.cells())?;
    par::each(held.chunks_mut(nx), |j, held| {
        job.check()?;
        gradients.row(j, |start, east, south| {
            for ((held, p), q) in held[start..].iter_mut().zip(east).zip(south) {
                *held = holding.at((p * p + q * q).sqrt());
            }
        });
        Ok::<_, NodeError>(())
    })?;
    Ok(held)
}
