//! Balances incision by rills, smoothing by creep and the means of the model's cells.
//!
//! In each step, every cell is lowered towards its receiver: h = (h + C hᵣ) / (1 + C) with C = v ((A / A₀)^m + 1) / d.
//! This is the implicit solution of the stream-power law (Braun and Willett 2013); the constant term represents debris
//! flows in headwaters (Stock and Dietrich 2006). A₀ is the square of the spacing, v the distance that erosion travels
//! upstream in a step and d the distance to the receiver. Drainage areas are capped: larger rivers erode no faster,
//! because the model already contains their courses and gradients. Creep follows. Then the loss of mean height of each
//! coarse cell, interpolated linearly between their centres, is added back: all of it to the heights, and half of it to
//! the uplift of all later steps. Uplift thus converges to the erosion rate, as in a landscape at steady state.

use orograph_graph::{
    memory::{filled, zeroed},
    mix,
};

use super::{Params, drain::Lakes};
use crate::{
    numerics::{
        coarse::{Between, Coarse},
        hillslope::Hillslope,
        lines::Ends,
        math, par,
        routing::{Depressions, Drainage, Grid, Outlet, code, receivers},
        variation::Variation,
        waves::{SHORTEST_CELLS, Waves},
    },
    prelude::*,
};

/// Steps of a run.
const STEPS: u32 = 8;
/// Distance that erosion travels upstream in a step where the drainage area is 0, in spacings.
const REACH: f64 = 0.35;
/// Diffusivity times the duration of a step, in squares of the spacing.
const CREEP: f64 = 0.0032;
/// Cap on drainage areas, in squares of the spacing: larger rivers erode no faster.
const LARGEST: f64 = 9.0;
/// Weight of the current step in the running mean of drainage areas.
const NEWEST: f32 = 0.4;
/// Fraction of the lost mean height that is added to the uplift of all later steps.
const LEARNT: f32 = 0.5;
/// Number of corrections of the means after the last step.
const ROUNDS: u32 = 6;
/// The longest waves in which the depth varies, in spacings, and the shortest, in the longest.
const VARIATION_WAVES: [f64; 2] = [20.0, 0.1];
/// The initial irregularities grow with slope up to this slope.
const STEEPEST: f64 = 1.2;

/// Returns the heights of a model without voids after rills have been cut. `strength` is a factor on erosion.
///
/// # Errors
/// [`NodeError::Cancelled`], or an error if no side of the world is open to water.
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
    par::change_with(&mut heights, model, |height, &model| *height = f64::from(model));
    land.route(job, &heights)?;
    let lakes = Lakes::of(&land.depressions, &heights)?;
    let factors = factors(job, params)?;
    let factor = |cell: usize| factors.get(cell).copied().unwrap_or(1.0);
    begin(job, params, strength.min(1.0), model, &mut heights)?;
    hold(&land.grid, model, &mut heights);

    let coarse = Coarse::new(&window, params.coarse / window.cell_m());
    // the diffusivity, and a time of which its product is the creep of a step
    let (creep, square) = ((CREEP * params.rounding * strength) as f32, params.spacing * params.spacing);
    let (creeps, span) = match &factors[..] {
        [] => (Lane::Constant(creep), square),
        factors => (Lane::Samples(factors), f64::from(creep) * square),
    };
    let hillslope = Hillslope::new(&window, creeps, 0.0);
    let law = Law::new(params.spacing, strength, window.cell_m());
    let (mut uplift, mut area): (Vec<f32>, Vec<f32>) = (zeroed(window.len())?, Vec::new());
    for step in 0..STEPS {
        job.advance(step as f32 / (STEPS + 1) as f32)?;
        land.route(job, &heights)?;
        if area.is_empty() {
            area = zeroed(window.len())?;
            par::change_with(&mut area, &land.cells, |mean, &cells| *mean = cells as f32);
        } else {
            par::change_with(&mut area, &land.cells, |mean, &cells| *mean += NEWEST * (cells as f32 - *mean));
        }
        par::change_at(&mut heights, |cell, height| {
            if code::has_receiver(land.codes[cell]) {
                *height += f64::from(uplift[cell]);
            }
        });
        land.drainage.upstream(job, &land.grid, &land.codes, &mut heights, |cell, code, height, below| {
            let drop = height - below;
            let coefficient = || law.coefficient(area[cell], code) * f64::from(factor(cell));
            if drop > 0.0 { below + drop / (1.0 + coefficient()) } else { height }
        })?;
        hillslope.creep(job, &mut heights, span, step..step + 1, &|_| false, None)?;
        let lost = lost(job, &coarse, model, &heights)?;
        raise(params, model, &lost, &mut heights);
        hold(&land.grid, model, &mut heights);
        par::change_with(&mut uplift, &lost, |uplift, lost| *uplift += LEARNT * lost);
    }
    drop((uplift, area));
    for _ in 0..ROUNDS {
        let lost = lost(job, &coarse, model, &heights)?;
        raise(params, model, &lost, &mut heights);
        hold(&land.grid, model, &mut heights);
    }
    if mask.constant() != Some(1.0) || params.variation > 0.0 {
        par::change_at(&mut heights, |cell, height| {
            let before = f64::from(model[cell]);
            *height = before + f64::from(factor(cell).min(1.0) * mask.at(cell)) * (*height - before);
        });
    }
    land.route(job, &heights)?;
    lakes.drain(job, &land, &mut heights)?;
    let mut found: Vec<f32> = zeroed(window.len())?;
    par::change_with(&mut found, &heights, |found, &height| *found = height as f32);
    Ok(found)
}

/// Factors on the erosion of each cell; empty where it is `depth` everywhere.
fn factors(job: &Job<'_>, params: &Params) -> Result<Vec<f32>, NodeError> {
    if params.variation <= 0.0 {
        return Ok(Vec::new());
    }
    let (window, [longest, shortest], seed) = (job.window(), VARIATION_WAVES, mix(job.seed() ^ 0x5217_15EE));
    let variation = Variation::of_slopes(job, params.variation, longest * params.spacing, shortest, seed);
    let mut factors = filled(window.len(), 1.0)?;
    variation.scale(job, &window, &mut factors)?;
    Ok(factors)
}

/// Receivers, depressions and drainage areas of the current heights.
pub struct Land {
    pub grid: Grid,
    pub codes: Vec<u8>,
    pub depressions: Depressions<f64>,
    pub drainage: Drainage,
    /// Drainage area of each cell, in cells.
    pub cells: Vec<u32>,
}

impl Land {
    /// Routes flow over `heights`; depressions overflow at their outlets.
    fn route(&mut self, job: &Job<'_>, heights: &[f64]) -> Result<(), NodeError> {
        receivers::d8(job, &self.grid, heights, &mut self.codes)?;
        self.depressions.find(job, &self.grid, heights, &self.codes)?;
        self.depressions.carve(job, &self.grid, &mut self.codes)?;
        par::change(&mut self.cells, |cells| *cells = 1);
        self.drainage.accumulate(job, &self.grid, &self.codes, &mut self.cells)
    }
}

/// The stream-power law of a step.
struct Law {
    /// v / d for face and for diagonal neighbours.
    reaches: [f64; 2],
    /// The area of a cell as a fraction of A₀.
    share: f64,
}

impl Law {
    fn new(spacing_m: f64, strength: f64, cell_m: f64) -> Self {
        let reach = REACH * strength * spacing_m / cell_m;
        let share = cell_m / spacing_m;
        Self { reaches: [reach, reach * std::f64::consts::FRAC_1_SQRT_2], share: share * share }
    }

    /// Returns C for a cell that drains `cells` cells along `code`.
    #[inline(always)]
    fn coefficient(&self, cells: f32, code: u8) -> f64 {
        let share = (f64::from(cells) * self.share).min(LARGEST);
        self.reaches[usize::from(code::is_diagonal(code::direction(code)))] * (share.sqrt() + 1.0)
    }
}

/// Adds the initial irregularities from which rills develop: noise of the spacing and shorter wavelengths, with an
/// amplitude proportional to the slope.
fn begin(job: &Job<'_>, params: &Params, strength: f64, model: &[f32], heights: &mut [f64]) -> Result<(), NodeError> {
    let window = job.window();
    let (nx, ny) = (window.nx(), window.ny());
    let seed = mix(job.seed() ^ 0x5217_15ED);
    let waves = Waves { longest_m: params.spacing, spectral_slope: 4.0, stretch: 1.0, grain: 0.7, seed };
    let mut noise = waves.field(job, &window, SHORTEST_CELLS * window.cell_m())?;
    let half = (0.5 * params.coarse / window.cell_m()).round().clamp(1.0, 1e9) as usize;
    let joined = [0, 1].map(|axis| Ends::of(&window, axis) == Ends::Wrap);
    let amplitude_m = params.irregularity * strength * params.spacing;
    par::rows_within(job, [0.0, 0.0], &mut noise, |j, row| {
        let height = |i: usize, j: usize| f64::from(model[j * nx + i]);
        let slope = |low: f64, high: f64, cells: usize| {
            if cells > 0 { (high - low) / (cells as f64 * window.cell_m()) } else { 0.0 }
        };
        let ends = |at: usize, count: usize, is_joined: bool| {
            if is_joined {
                let beside = [-1, 1].map(|way| Ends::Wrap.index(at as i64 + way * half as i64, count));
                return (beside, 2 * half);
            }
            let beside = [at.saturating_sub(half), (at + half).min(count - 1)];
            (beside, beside[1] - beside[0])
        };
        let ([north, south], tall) = ends(j, ny, joined[1]);
        for (i, noise) in row.iter_mut().enumerate() {
            let ([west, east], wide) = ends(i, nx, joined[0]);
            let across = slope(height(west, j), height(east, j), wide);
            let down = slope(height(i, north), height(i, south), tall);
            *noise *= (amplitude_m * math::hypot(across, down).min(STEEPEST)) as f32;
        }
    })?;
    par::change_with(heights, &noise, |height, noise| *height += f64::from(*noise));
    Ok(())
}

/// Adds the lost mean height. Changes are limited to the spacing times the steepest slope: otherwise retreating walls
/// would be raised without limit.
fn raise(params: &Params, model: &[f32], lost: &[f32], heights: &mut [f64]) {
    let most = STEEPEST * params.spacing;
    par::change_at(heights, |cell, height| {
        let model = f64::from(model[cell]);
        *height = (*height + f64::from(lost[cell])).clamp(model - most, model + most);
    });
}

/// Keeps cells at `base` sides at the level of the model: what the means of their coarse cells lack is added inside.
fn hold(grid: &Grid, model: &[f32], heights: &mut [f64]) {
    let rows = (0..grid.nx).flat_map(|x| [(x, 0), (x, grid.ny - 1)]);
    for (x, y) in rows.chain((0..grid.ny).flat_map(|y| [(0, y), (grid.nx - 1, y)])) {
        if grid.outlet(x, y) == Outlet::Base {
            heights[y * grid.nx + x] = f64::from(model[y * grid.nx + x]);
        }
    }
}

/// Returns how far the means of coarse cells are below those of the model, interpolated linearly between their centres.
fn lost(job: &Job<'_>, coarse: &Coarse, model: &[f32], heights: &[f64]) -> Result<Vec<f32>, NodeError> {
    let mut lost: Vec<f32> = zeroed(model.len())?;
    par::change_at(&mut lost, |cell, lost| *lost = (f64::from(model[cell]) - heights[cell]) as f32);
    let means = coarse.means(job, &lost)?;
    drop(lost);
    coarse.spread(job, [0.0, 0.0], &means, Between::Linear)
}
