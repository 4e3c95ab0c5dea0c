//! Temperature through the year, and the effect of the wind on where snow falls.

use std::f64::consts::{FRAC_1_SQRT_2, TAU};

use orograph_graph::{Job, NodeError, memory::zeroed};

use super::Params;
use crate::numerics::{lines::Ends, math, par};

/// Days of a year.
pub(super) const YEAR_D: f64 = 365.25;
/// The warmest day north of the equator; half a year later south of it.
const WARMEST: f64 = 196.0;
/// Precipitation is snow at 0 °C and below, and rain from this temperature on.
const RAIN_C: f64 = 2.0;
/// Weights of the slope along the wind and of the curvature (Liston and Elder 2006).
const WEIGHTS: [f64; 2] = [0.58, 0.42];
/// Slope and curvature with the full effect.
const FULL: [f64; 2] = [0.577, 0.15];

/// A step in time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    /// Day of the year in its middle.
    pub day: f64,
    pub days: f64,
    /// Difference of the temperature from the mean of the year.
    pub season_c: f64,
}

/// Returns the steps of a run.
pub(super) fn steps(params: &Params) -> Vec<Step> {
    let count = params.count();
    let days = params.duration * YEAR_D / count.max(1) as f64;
    let warmest = if params.latitude < 0.0 { WARMEST - 0.5 * YEAR_D } else { WARMEST };
    let step = |k: usize| {
        let day = (params.day as f64 - days * ((count - k) as f64 - 0.5)).rem_euclid(YEAR_D);
        let season_c = params.seasonality * math::cos(TAU * (day - warmest) / YEAR_D);
        Step { day: day.max(1.0), days, season_c }
    };
    (0..count).map(step).collect()
}

/// Returns the part of precipitation that falls as snow.
pub(super) fn snow_share(temperature_c: f64) -> f64 {
    ((RAIN_C - temperature_c) / RAIN_C).clamp(0.0, 1.0)
}

/// Returns the relative amounts of snow that fall on each cell in the wind: 1 on level ground, less where wind is fast,
/// on windward slopes and crests, and more in its lee and in hollows.
///
/// # Errors
/// [`NodeError::Cancelled`], or not enough memory.
pub(super) fn sheltered(job: &Job<'_>, land: &[f32], params: &Params) -> Result<Vec<f32>, NodeError> {
    let window = job.window();
    let (nx, ny) = (window.nx(), window.ny());
    let cells = (params.wind_length / job.cell_m()).round().max(1.0);
    let (reach, length_m) = (cells.min((nx + ny) as f64) as i64, cells * job.cell_m());
    let ends = [0, 1].map(|axis| Ends::of(&window, axis));
    let azimuth = params.wind_azimuth.to_radians();
    // the direction in which the wind blows: east, south
    let blows = [-math::sin(azimuth), math::cos(azimuth)];
    let mut out: Vec<f32> = zeroed(land.len())?;
    par::each(out.chunks_mut(nx), |j, row| {
        job.check()?;
        let rows = [-reach, 0, reach].map(|dy| ends[1].index(j as i64 + dy, ny) * nx);
        for (i, out) in row.iter_mut().enumerate() {
            let columns = [-reach, 0, reach].map(|dx| ends[0].index(i as i64 + dx, nx));
            let at = |dx: usize, dy: usize| f64::from(land[rows[dy] + columns[dx]]);
            let here = at(1, 1);
            let slope = [at(2, 1) - at(0, 1), at(1, 2) - at(1, 0)].map(|rise| rise / (2.0 * length_m));
            let bulge = |one: f64, other: f64| (here - 0.5 * (one + other)) / (2.0 * length_m);
            let curvature = 0.25
                * (bulge(at(0, 1), at(2, 1))
                    + bulge(at(1, 0), at(1, 2))
                    + FRAC_1_SQRT_2 * (bulge(at(0, 0), at(2, 2)) + bulge(at(2, 0), at(0, 2))));
            let effects = [slope[0] * blows[0] + slope[1] * blows[1], curvature];
            let scaled = [0, 1].map(|k| WEIGHTS[k] * (effects[k] / FULL[k]).clamp(-1.0, 1.0));
            *out = (1.0 - params.wind * (scaled[0] + scaled[1])) as f32;
        }
        Ok::<_, NodeError>(())
    })?;
    Ok(out)
}
