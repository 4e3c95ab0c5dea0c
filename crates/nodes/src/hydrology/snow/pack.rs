//! The snow on the ground through time, and its balance.

use std::borrow::Cow;

use orograph_graph::{Balance, Field, Job, NodeError, Report, memory::zeroed};

use super::{
    Inputs, Params,
    slide::{Holding, slide},
    weather::{self, Step, YEAR_D, snow_share},
};
use crate::{
    numerics::{
        gradient::{Method, Surface},
        horizon::Horizon,
        par,
        routing::Grid,
        sunlight::{
            self,
            path::{self, DAY_S},
        },
        voids,
    },
    prelude::Lane,
};

/// The snow of a world. Amounts are in metres of water.
pub(super) struct Pack<'a> {
    /// Terrain without voids.
    pub land: Cow<'a, [f32]>,
    pub snow: Vec<f64>,
    /// What has melted at each cell; empty if it is not wanted.
    pub melted: Vec<f64>,
    /// Sums over all cells of what fell, melted and left the world.
    fell: f64,
    melt: f64,
    left: f64,
}

/// The parameters, and the climate inputs without voids.
struct Climate<'a> {
    params: &'a Params,
    temperature: Layer<'a>,
    precipitation: Layer<'a>,
}

enum Layer<'a> {
    Constant(f32),
    Cells(Cow<'a, [f32]>),
}

impl<'a> Layer<'a> {
    fn new(job: &Job<'_>, lane: Lane<'a>) -> Result<Self, NodeError> {
        Ok(match lane {
            Lane::Constant(value) => Self::Constant(value),
            Lane::Samples(samples) => Self::Cells(voids::filled(job, samples)?),
        })
    }

    #[inline]
    fn at(&self, cell: usize) -> f64 {
        match self {
            Self::Constant(value) => f64::from(*value),
            Self::Cells(cells) => f64::from(cells[cell]),
        }
    }
}

impl<'a> Pack<'a> {
    /// Runs the whole time.
    ///
    /// # Errors
    /// A world without an outlet, [`NodeError::Cancelled`], or not enough memory.
    pub fn grow(job: &'a Job<'_>, params: &Params, keep_melt: bool) -> Result<Self, NodeError> {
        let inputs = Inputs::read(job)?;
        let land = voids::filled(job, inputs.height.samples())?;
        let count = land.len();
        let melted = if keep_melt { zeroed(count)? } else { Vec::new() };
        let mut pack = Self { land, snow: zeroed(count)?, melted, fell: 0.0, melt: 0.0, left: 0.0 };
        let steps = weather::steps(params);
        if steps.is_empty() {
            return Ok(pack);
        }
        let climate = Climate {
            params,
            temperature: Layer::new(job, inputs.temperature)?,
            precipitation: Layer::new(job, inputs.precipitation)?,
        };
        if let Layer::Cells(cells) = &climate.precipitation
            && par::any(cells, |rate| *rate < 0.0)
        {
            job.warn("`precipitation` is negative in some places, where it counts as 0");
        }
        let grid = if params.slides > 0 { Some(Grid::new(&job.window())?) } else { None };
        let shelter = if params.wind > 0.0 { weather::sheltered(job, &pack.land, params)? } else { Vec::new() };
        let filled = matches!(pack.land, Cow::Owned(_)).then(|| Field::new(job.window(), pack.land.to_vec()));
        let height = filled.as_ref().unwrap_or(inputs.height);
        let (holding, to_depth) = (Holding::new(params), 1000.0 / params.density);
        let mut sun: Option<Horizon<'_>> = None;
        for (at, step) in steps.iter().enumerate() {
            let done = [0.95 * at as f32 / steps.len() as f32; 2];
            job.advance(done[0])?;
            pack.fall(job, &climate, &shelter, step)?;
            if pack.can_melt(job, &climate, step) {
                let horizon = match sun.take() {
                    Some(horizon) => horizon,
                    None => Horizon::new(job, done, height, params.rays(job.world()))?,
                };
                let arc = path::day(step.day, params.latitude, 24, params.transmittance);
                let surface = Surface::new(height, Method::Horn);
                let sunshine = arc.map(|arc| sunlight::sums(job, done, &horizon, &surface, &[arc])).transpose()?;
                pack.thaw(job, &climate, step, sunshine.as_deref())?;
                sun = Some(horizon);
            }
            if let Some(grid) = &grid {
                for _ in 0..params.slides {
                    pack.left += slide(job, grid, &pack.land, &holding, to_depth, &mut pack.snow)?;
                }
            }
        }
        if pack.fell <= 0.0 {
            job.warn("no snow falls: it is above 2 °C everywhere, or there is no precipitation; lower `temperature`");
        }
        Ok(pack)
    }

    fn temperature_c(&self, climate: &Climate<'_>, step: &Step, cell: usize) -> f64 {
        climate.temperature.at(cell) + step.season_c - 1e-3 * climate.params.lapse_rate * f64::from(self.land[cell])
    }

    /// Adds the snow of a step. The wind moves it, so that the sum stays the same.
    fn fall(&mut self, job: &Job<'_>, climate: &Climate<'_>, shelter: &[f32], step: &Step) -> Result<(), NodeError> {
        let (nx, sea_level) = (job.window().nx(), job.sea_level());
        let years = step.days / YEAR_D;
        let mut snow = std::mem::take(&mut self.snow);
        let fresh = |cell: usize| {
            if sea_level.is_some_and(|level| f64::from(self.land[cell]) < level) {
                return 0.0;
            }
            let share = snow_share(self.temperature_c(climate, step, cell));
            climate.precipitation.at(cell).max(0.0) * years * share
        };
        let weight = |cell: usize| shelter.get(cell).map_or(1.0, |weight| f64::from(*weight));
        let mut scale = 1.0;
        if !shelter.is_empty() {
            let sums = par::collect(self.land.chunks(nx), |j, row| {
                job.check()?;
                let cells = j * nx..j * nx + row.len();
                Ok::<_, NodeError>(cells.fold([0.0, 0.0], |[plain, blown], cell| {
                    let fresh = fresh(cell);
                    [plain + fresh, blown + fresh * weight(cell)]
                }))
            })?;
            let [plain, blown] = sums.iter().fold([0.0, 0.0], |sum, row| [sum[0] + row[0], sum[1] + row[1]]);
            scale = if blown > 0.0 { plain / blown } else { 1.0 };
        }
        let sums = par::collect(snow.chunks_mut(nx), |j, row| {
            job.check()?;
            let mut sum = 0.0;
            for (i, snow) in row.iter_mut().enumerate() {
                let cell = j * nx + i;
                let amount = fresh(cell) * weight(cell) * scale;
                *snow += amount;
                sum += amount;
            }
            Ok::<_, NodeError>(sum)
        })?;
        self.snow = snow;
        self.fell += sums.iter().sum::<f64>();
        Ok(())
    }

    /// Returns true if it thaws anywhere on snow.
    fn can_melt(&self, job: &Job<'_>, climate: &Climate<'_>, step: &Step) -> bool {
        let nx = job.window().nx();
        par::collect_all(self.snow.chunks(nx), |j, row| {
            row.iter().enumerate().any(|(i, snow)| *snow > 0.0 && self.temperature_c(climate, step, j * nx + i) > 0.0)
        })
        .contains(&true)
    }

    /// Melts the snow of a step. `sunshine` is that of [`sunlight::sums`] over a day; None in the polar night.
    fn thaw(
        &mut self,
        job: &Job<'_>,
        climate: &Climate<'_>,
        step: &Step,
        sunshine: Option<&[f32]>,
    ) -> Result<(), NodeError> {
        let (nx, params) = (job.window().nx(), climate.params);
        let mut snow = std::mem::take(&mut self.snow);
        let mut melted = std::mem::take(&mut self.melted);
        let mut kept = melted.chunks_mut(nx);
        let rows = snow.chunks_mut(nx).map(|snow| (snow, kept.next()));
        let melts = par::collect(rows, |j, (snow, mut melted)| {
            job.check()?;
            let energy = sunshine.map(|sums| &sums[(2 * j + 1) * nx..][..nx]);
            let mut sum = 0.0;
            for (i, snow) in snow.iter_mut().enumerate() {
                let above_c = self.temperature_c(climate, step, j * nx + i).max(0.0);
                let sunlight = energy.map_or(0.0, |energy| f64::from(energy[i]) / DAY_S);
                let rate = 1e-3 * (params.melt_factor + params.radiation_factor * sunlight) * above_c;
                let melt = (rate * step.days).min(*snow);
                *snow -= melt;
                sum += melt;
                if let Some(melted) = &mut melted {
                    melted[i] += melt;
                }
            }
            Ok::<_, NodeError>(sum)
        })?;
        (self.snow, self.melted) = (snow, melted);
        self.melt += melts.iter().sum::<f64>();
        Ok(())
    }

    /// The balance of the snow as volumes of water, and its extent.
    pub fn report(&self, params: &Params, cell_m2: f64) -> Report {
        let remains: f64 = self.snow.iter().sum();
        let to_depth = 1000.0 / params.density;
        let covered = self.snow.iter().filter(|snow| **snow * to_depth > 0.05).count() as f64;
        let mut report = Report::default();
        let volume = |metres: f64| cell_m2 * metres;
        report.balance(Balance::new(
            "snow",
            0.0,
            &[("fell", volume(self.fell))],
            &[("melted", volume(self.melt)), ("slid_off_the_world", volume(self.left))],
            volume(remains),
        ));
        report.measure("covered_area", cell_m2 * covered, "m²");
        report.measure("coverage", covered / self.snow.len().max(1) as f64, "");
        report.measure("greatest_depth", to_depth * self.snow.iter().copied().fold(0.0, f64::max), "m");
        report
    }
}
