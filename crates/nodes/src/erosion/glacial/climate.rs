//! Mass balance: what snow adds and what melts.
//!
//! Of an equilibrium line altitude: a linear balance with two gradients and a largest accumulation.
//!
//! Of a climate: the temperature T = T₀ − γ z is the mean of a normal distribution over the year. The part of the
//! precipitation that falls below 1 °C is snow; melt is the degree-day factor times the integral of the temperatures
//! above 0 °C (R. J. Braithwaite 1984; R. Calov and R. Greve 2005, equation 6), 365.25 (σ φ(T/σ) + T Φ(T/σ)) days and
//! kelvins.

use orograph_graph::{Job, Lane, NodeError};

use super::{Climate as Kind, Params, grid::Grid};
use crate::numerics::{coarse::Coarse, math, voids};

/// Density of ice over that of water.
const ICE_TO_WATER: f64 = 0.91;
/// Temperature in °C above which precipitation is rain.
const RAIN_C: f64 = 1.0;
/// Range of tabulated temperatures in °C, and entries per degree.
pub(super) const TABLE_C: [f64; 2] = [-60.0, 60.0];
pub(super) const PER_DEGREE: f64 = 8.0;

/// A climate input on the ice grid.
pub(super) enum Layer {
    Constant(f64),
    Cells(Vec<f32>),
}

impl Layer {
    /// The means of an input over ice cells. Voids are filled from what is around them; a map without a number is 0.
    pub fn new(job: &Job<'_>, coarse: &Coarse, lane: Lane<'_>) -> Result<Self, NodeError> {
        let samples = match lane {
            Lane::Constant(value) => return Ok(Self::Constant(f64::from(value))),
            Lane::Samples(samples) => samples,
        };
        Ok(Self::Cells(coarse.means(job, &voids::filled(job, samples)?)?))
    }

    #[inline(always)]
    pub fn at(&self, cell: usize) -> f64 {
        match self {
            Self::Constant(value) => *value,
            Self::Cells(cells) => f64::from(cells[cell]),
        }
    }
}

/// Inputs of the climate, per cell of the world.
pub(super) struct Inputs<'a> {
    pub ela: Lane<'a>,
    pub temperature: Lane<'a>,
    pub precipitation: Lane<'a>,
    pub lapse_rate: Lane<'a>,
}

/// The balance of every place at every height.
pub(super) enum Climate {
    Ela { ela: Layer, gradients: [f64; 2], most: f64 },
    Temperature { temperature: Layer, precipitation: Layer, lapse_rate: Layer, snow: Vec<f64>, melt: Vec<f64> },
}

impl Climate {
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn new(job: &Job<'_>, coarse: &Coarse, params: &Params, inputs: &Inputs<'_>) -> Result<Self, NodeError> {
        if params.climate == Kind::Ela {
            return Ok(Self::Ela {
                ela: Layer::new(job, coarse, inputs.ela)?,
                gradients: [params.accumulation_gradient, params.ablation_gradient],
                most: params.max_accumulation,
            });
        }
        let sigma = params.variability.max(1e-3);
        let entries = ((TABLE_C[1] - TABLE_C[0]) * PER_DEGREE) as usize + 1;
        let table = |value: &dyn Fn(f64) -> f64| {
            (0..entries).map(|k| value(TABLE_C[0] + k as f64 / PER_DEGREE) / ICE_TO_WATER).collect()
        };
        // Φ(x) = erfc(−x / √2) / 2
        let below = |x: f64| 0.5 * math::erfc(-x * std::f64::consts::FRAC_1_SQRT_2);
        let melt = |mean: f64| {
            let x = mean / sigma;
            let density = math::exp(-0.5 * x * x) / (2.0 * std::f64::consts::PI).sqrt();
            1e-3 * params.degree_day * 365.25 * (sigma * density + mean * below(x))
        };
        Ok(Self::Temperature {
            temperature: Layer::new(job, coarse, inputs.temperature)?,
            precipitation: Layer::new(job, coarse, inputs.precipitation)?,
            lapse_rate: Layer::new(job, coarse, inputs.lapse_rate)?,
            snow: table(&|mean| below((RAIN_C - mean) / sigma)),
            melt: table(&melt),
        })
    }

    /// Balance of a cell whose surface is at a height, in metres of ice per year, in a climate whose heights are all
    /// `shift_m` higher.
    #[inline(always)]
    pub fn balance(&self, cell: usize, surface_m: f64, shift_m: f64) -> f64 {
        match self {
            Self::Ela { ela, gradients, most } => {
                let above = surface_m - ela.at(cell) - shift_m;
                if above > 0.0 { (gradients[0] * above).min(*most) } else { gradients[1] * above }
            }
            Self::Temperature { temperature, precipitation, lapse_rate, snow, melt } => {
                let mean = temperature.at(cell) - 1e-3 * lapse_rate.at(cell) * (surface_m - shift_m);
                let place = ((mean - TABLE_C[0]) * PER_DEGREE).clamp(0.0, (snow.len() - 1) as f64 - 1e-6);
                let (k, t) = (place as usize, place - place.floor());
                let between = |table: &[f64]| table[k] + t * (table[k + 1] - table[k]);
                precipitation.at(cell).max(0.0) * between(snow) - between(melt)
            }
        }
    }

    /// [`Self::balance`] of a row of cells, from the cell `first` on.
    pub fn balances(&self, first: usize, surfaces_m: &[f64], shift_m: f64, out: &mut [f64]) {
        if let Self::Ela { ela: Layer::Constant(ela), gradients, most } = self {
            // the common case without a branch
            for (out, surface_m) in out.iter_mut().zip(surfaces_m) {
                let above = surface_m - ela - shift_m;
                let gain = gradients[0] * above;
                let gain = if gain < *most { gain } else { *most };
                *out = if above > 0.0 { gain } else { gradients[1] * above };
            }
            return;
        }
        for (k, (out, surface_m)) in out.iter_mut().zip(surfaces_m).enumerate() {
            *out = self.balance(first + k, *surface_m, shift_m);
        }
    }

    /// Returns true if precipitation is negative somewhere.
    pub fn is_negative(&self, grid: &Grid) -> bool {
        match self {
            Self::Ela { .. } => false,
            Self::Temperature { precipitation, .. } => (0..grid.len()).any(|cell| precipitation.at(cell) < 0.0),
        }
    }
}

/// How far heights of the climate are above those of the glacial maximum, in metres, at the fraction `t` of the run:
/// in each cycle they fall over the first 30 %, stay until 80 %, and rise in equal stages to the end.
pub(super) fn shift_m(params: &Params, t: f64) -> f64 {
    let phase = (t * params.cycles as f64).fract();
    let share = if phase < 0.3 {
        1.0 - phase / 0.3
    } else if phase < 0.8 {
        0.0
    } else {
        let stages = params.stages.max(1) as f64;
        ((phase - 0.8) / 0.2 * stages).floor().min(stages - 1.0) / stages + 1.0 / stages
    };
    params.warming * share
}
