//! The balance of cutting, rounding and the model's means.
//!
//! Over a step each cell falls towards its receiver, h = (h + C hᵣ) / (1 + C) with C = v ((A / A₀)^m + 1) / d, which is the
//! law of rivers with headwaters solved implicitly (Braun and Willett 2013; the constant stands for debris flows, Stock
//! and Dietrich 2006). A₀ is the square of the spacing, v the distance that erosion moves upstream over a step and d the
//! distance to the receiver. Areas count up to a limit: rivers that drain more are as strong, because the model knows
//! their course and slope. Then slopes creep, and what the means of coarse cells have lost is added, linearly between
//! their centres: all of it to the heights, half of it also to the uplift of all later steps. The uplift thus learns what
//! erosion takes, as in a landscape at steady state.

use orograph_graph::{memory::zeroed, mix};
use rayon::prelude::*;

use super::{Params, drain::Lakes};
use crate::{
    numerics::{
        coarse::{Between, Coarse},
        hillslope::Hillslope,
        math, par,
        routing::{Depressions, Drainage, Grid, code, receivers},
        waves::{SHORTEST_CELLS, Waves},
    },
    prelude::*,
};

/// Steps of a run.
const STEPS: u32 = 8;
/// Spacings that erosion moves upstream over a step on ground that drains nothing.
const REACH: f64 = 0.35;
/// Squares of the spacing over a step that creep spreads by.
const CREEP: f64 = 0.0032;
/// Rivers that drain more squares of the spacing cut no faster.
const LARGEST: f64 = 9.0;
/// The share of a step in the mean area of the last ones.
const NEWEST: f32 = 0.4;
/// The share of a change of means that every later step makes as well.
const LEARNT: f32 = 0.5;
/// How often the means are put right at the end.
const ROUNDS: u32 = 6;
/// The steepest slope by which irregularities grow.
const STEEPEST: f64 = 1.2;

/// The heights with rills of a model without voids. `strength` is how far erosion goes, as a factor.
///
/// # Errors
/// [`NodeError::Cancelled`], or when no side of the world lets water out.
pub fn of(job: &Job<'_>, params: &Params, strength: f64, model: &[f32], mask: Lane<'_>) -> Result<Vec<f32>, NodeError> {
    let window = job.window();
    let mut land = Land {
        grid: Grid::new(&window)?,
        codes: zeroed(window.len())?,
        depressions: Depressions::default(),
        drainage: Drainage::default(),
        cells: zeroed(window.len())?,
    };
    let mut heights: Vec<f64> = zeroed(window.len())?;
    heights.par_iter_mut().zip(model).for_each(|(height, &model)| *height = f64::from(model));
    land.route(job, &heights)?;
    let lakes = Lakes::of(&land.depressions, &heights)?;
    begin(job, params, strength.min(1.0), model, &mut heights)?;

    let coarse = Coarse::new(&window, params.coarse / window.cell_m());
    let hillslope = Hillslope::new(&window, Lane::Constant((CREEP * params.rounding * strength) as f32), 0.0);
    let law = Law::new(params.spacing, strength, window.cell_m());
    let (mut uplift, mut area): (Vec<f32>, Vec<f32>) = (zeroed(window.len())?, Vec::new());
    for step in 0..STEPS {
        job.advance(step as f32 / (STEPS + 1) as f32)?;
        land.route(job, &heights)?;
        if area.is_empty() {
            area = zeroed(window.len())?;
            area.par_iter_mut().zip(&land.cells).for_each(|(mean, &cells)| *mean = cells as f32);
        } else {
            area.par_iter_mut().zip(&land.cells).for_each(|(mean, &cells)| *mean += NEWEST * (cells as f32 - *mean));
        }
        let inside = heights.par_iter_mut().zip(&uplift).zip(&land.codes);
        inside.filter(|(_, code)| code::has_receiver(**code)).for_each(|((height, up), _)| *height += f64::from(*up));
        land.drainage.upstream(job, &land.grid, &land.codes, &mut heights, |cell, code, height, below| {
            let drop = height - below;
            if drop > 0.0 { below + drop / (1.0 + law.coefficient(area[cell], code)) } else { height }
        })?;
        hillslope.creep(job, &mut heights, params.spacing * params.spacing, step, &|_| false, None)?;
        let lost = lost(job, &coarse, model, &heights)?;
        raise(params, model, &lost, &mut heights);
        uplift.par_iter_mut().zip(&lost).for_each(|(uplift, lost)| *uplift += LEARNT * lost);
    }
    drop((uplift, area));
    for _ in 0..ROUNDS {
        let lost = lost(job, &coarse, model, &heights)?;
        raise(params, model, &lost, &mut heights);
    }
    if mask.constant() != Some(1.0) {
        heights.par_iter_mut().enumerate().for_each(|(cell, height)| {
            let before = f64::from(model[cell]);
            *height = before + f64::from(mask.at(cell)) * (*height - before);
        });
    }
    land.route(job, &heights)?;
    lakes.drain(job, &land, &mut heights)?;
    let mut found: Vec<f32> = zeroed(window.len())?;
    found.par_iter_mut().zip(&heights).for_each(|(found, &height)| *found = height as f32);
    Ok(found)
}

/// Receivers, depressions and areas of the land as it is.
pub struct Land {
    pub grid: Grid,
    pub codes: Vec<u8>,
    pub depressions: Depressions<f64>,
    pub drainage: Drainage,
    /// Cells that drain through each.
    pub cells: Vec<u32>,
}

impl Land {
    /// Finds where the water of `heights` goes, depressions running over.
    fn route(&mut self, job: &Job<'_>, heights: &[f64]) -> Result<(), NodeError> {
        receivers::d8(job, &self.grid, heights, &mut self.codes)?;
        self.depressions.find(job, &self.grid, heights, &self.codes)?;
        self.depressions.carve(job, &self.grid, &mut self.codes)?;
        self.cells.par_iter_mut().for_each(|cells| *cells = 1);
        self.drainage.accumulate(job, &self.grid, &self.codes, &mut self.cells)
    }
}

/// The law of a step.
struct Law {
    /// v / d for links across a side and across a corner.
    reaches: [f64; 2],
    /// A / A₀ of a cell.
    share: f64,
}

impl Law {
    fn new(spacing_m: f64, strength: f64, cell_m: f64) -> Self {
        let reach = REACH * strength * spacing_m / cell_m;
        let share = cell_m / spacing_m;
        Self { reaches: [reach, reach * std::f64::consts::FRAC_1_SQRT_2], share: share * share }
    }

    /// C of a link of a cell through which so many cells drain.
    #[inline(always)]
    fn coefficient(&self, cells: f32, code: u8) -> f64 {
        let share = (f64::from(cells) * self.share).min(LARGEST);
        self.reaches[usize::from(code::is_diagonal(code::direction(code)))] * (share.sqrt() + 1.0)
    }
}

/// Adds the irregularities on which rills begin: waves as long as the spacing and shorter, as steep as the land.
fn begin(job: &Job<'_>, params: &Params, strength: f64, model: &[f32], heights: &mut [f64]) -> Result<(), NodeError> {
    let window = job.window();
    let (nx, ny) = (window.nx(), window.ny());
    let seed = mix(job.seed() ^ 0x5217_15ED);
    let waves = Waves { longest_m: params.spacing, spectral_slope: 4.0, stretch: 1.0, grain: 0.7, seed };
    let mut noise = waves.field(job, &window, SHORTEST_CELLS * window.cell_m())?;
    let half = (0.5 * params.coarse / window.cell_m()).round().clamp(1.0, 1e9) as usize;
    let amplitude_m = params.irregularity * strength * params.spacing;
    par::rows_within(job, [0.0, 0.0], &mut noise, |j, row| {
        let height = |i: usize, j: usize| f64::from(model[j * nx + i]);
        let slope = |low: f64, high: f64, cells: usize| {
            if cells > 0 { (high - low) / (cells as f64 * window.cell_m()) } else { 0.0 }
        };
        let (north, south) = (j.saturating_sub(half), (j + half).min(ny - 1));
        for (i, noise) in row.iter_mut().enumerate() {
            let (west, east) = (i.saturating_sub(half), (i + half).min(nx - 1));
            let across = slope(height(west, j), height(east, j), east - west);
            let down = slope(height(i, north), height(i, south), south - north);
            *noise *= (amplitude_m * math::hypot(across, down).min(STEEPEST)) as f32;
        }
    })?;
    heights.par_iter_mut().zip(&noise).for_each(|(height, noise)| *height += f64::from(*noise));
    Ok(())
}

/// Adds what was lost. No change is larger than a spacing times the steepest slope: walls that erosion moves back would
/// be raised without end.
fn raise(params: &Params, model: &[f32], lost: &[f32], heights: &mut [f64]) {
    let most = STEEPEST * params.spacing;
    heights.par_iter_mut().zip(lost).zip(model).for_each(|((height, &lost), &model)| {
        let model = f64::from(model);
        *height = (*height + f64::from(lost)).clamp(model - most, model + most);
    });
}

/// By how much the means of coarse cells are below the model's, linearly between their centres.
fn lost(job: &Job<'_>, coarse: &Coarse, model: &[f32], heights: &[f64]) -> Result<Vec<f32>, NodeError> {
    let mut lost: Vec<f32> = zeroed(model.len())?;
    let cells = model.par_iter().zip(heights);
    lost.par_iter_mut().zip(cells).for_each(|(lost, (&model, height))| *lost = (f64::from(model) - height) as f32);
    let means = coarse.means(job, &lost)?;
    drop(lost);
    coarse.spread(job, [0.0, 0.0], &means, Between::Linear)
}
