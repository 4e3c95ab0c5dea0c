//! The land during a run: its heights and what the law needs to know of it.

use rayon::prelude::*;

use super::{Params, Receivers, area::Area, incision::Law, rock::Rock, slides};
use crate::{
    hydrology::engine::{Depressions, Drainage, Grid, Outlet, code, receivers},
    math,
    prelude::*,
};

/// The state of a run, and what does not change during it.
pub struct Land<'a> {
    grid: Grid,
    /// Heights in metres.
    pub heights: Vec<f64>,
    codes: Vec<u8>,
    /// Directions of steepest descent, for random receivers.
    tangents: Vec<u8>,
    depressions: Depressions<f64>,
    drainage: Drainage,
    /// Drainage areas of the last routing.
    pub area: Area<'a>,
    cell_m: f64,
    uplift: Lane<'a>,
    rock: Rock<'a>,
    steepest: Steepest,
    receivers: Receivers,
    seed: u32,
    law: Law,
    n: f64,
}

/// The steepest drop over a distance of 1.
enum Steepest {
    Everywhere(f64),
    Each(Vec<f32>),
}

impl<'a> Land<'a> {
    /// The land at the start.
    ///
    /// # Errors
    /// When the world has no outlet or the inputs contradict each other.
    pub fn new(job: &'a Job<'_>, params: &Params, start: &Field) -> Result<Self, NodeError> {
        let grid = Grid::new(&job.window())?;
        let cells = grid.cells();
        let cell_m = job.cell_m();
        let law = Law::new(params.n);
        let tangent = |degrees: f32| {
            let degrees = f64::from(degrees).clamp(0.0, 90.0);
            if degrees < 90.0 { math::tan(degrees.to_radians()) } else { f64::INFINITY }
        };
        let steepest = match job.lane("repose") {
            Lane::Constant(degrees) => Steepest::Everywhere(tangent(degrees)),
            Lane::Samples(degrees) => {
                Steepest::Each(degrees.par_iter().map(|&degrees| tangent(degrees) as f32).collect())
            }
        };
        Ok(Self {
            heights: start.samples().par_iter().map(|&height| f64::from(height)).collect(),
            codes: vec![0; cells],
            tangents: vec![0; if params.receivers == Receivers::RhoInfinity { cells } else { 0 }],
            depressions: Depressions::default(),
            drainage: Drainage::default(),
            area: Area::new(&law, cells, job.lane("rain"), cell_m * cell_m, params.critical_area, params.m),
            cell_m,
            uplift: job.lane("uplift"),
            rock: Rock::new(job, params, &law)?,
            steepest,
            receivers: params.receivers,
            seed: job.seed(),
            law,
            n: params.n,
            grid,
        })
    }

    /// Whether a cell keeps its height.
    #[must_use]
    pub fn is_base(&self, cell: usize) -> bool {
        self.codes[cell] & code::OUTLET != 0
            && self.grid.outlet(cell % self.grid.nx, cell / self.grid.nx) == Outlet::Base
    }

    /// Raises the land for the time of a step, then erodes it.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn step(&mut self, job: &Job<'_>, step_yr: f64, step: u32) -> Result<(), NodeError> {
        self.raise(job, step_yr)?;
        self.route(job, Some(step))?;
        self.erode(job, step_yr)?;
        match &self.steepest {
            Steepest::Everywhere(f64::INFINITY) => Ok(()),
            Steepest::Everywhere(slope) => slides::settle(job, &self.grid, &mut self.heights, self.cell_m, |_| *slope),
            Steepest::Each(slopes) => {
                slides::settle(job, &self.grid, &mut self.heights, self.cell_m, |cell| f64::from(slopes[cell]))
            }
        }
    }

    fn raise(&mut self, job: &Job<'_>, step_yr: f64) -> Result<(), NodeError> {
        if self.uplift.constant() == Some(0.0) {
            return Ok(());
        }
        let (grid, uplift) = (&self.grid, self.uplift);
        self.heights.par_chunks_mut(grid.nx).enumerate().try_for_each(|(y, heights)| {
            job.check()?;
            let first = y * grid.nx;
            let border = grid.is_border_row(y);
            for (x, height) in heights.iter_mut().enumerate() {
                let side = border || x == 0 || x + 1 == grid.nx;
                if !(side && grid.outlet(x, y) == Outlet::Base) {
                    *height += f64::from(uplift.at(first + x)) * step_yr;
                }
            }
            Ok(())
        })
    }

    /// Receivers, ways out of depressions and drainage areas of the land as it is: of a step, or by steepest descent.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn route(&mut self, job: &Job<'_>, step: Option<u32>) -> Result<(), NodeError> {
        let (grid, heights, codes) = (&self.grid, &self.heights, &mut self.codes);
        match step {
            Some(step) if self.receivers == Receivers::RhoInfinity => {
                let seed = orograph_graph::mix(self.seed ^ orograph_graph::mix(step));
                receivers::rho_infinity(job, grid, heights, codes, &mut self.tangents, seed)?;
            }
            _ => receivers::d8(job, grid, heights, codes)?,
        }
        self.depressions.find(job, grid, heights, codes)?;
        self.depressions.carve(job, grid, codes)?;
        self.area.accumulate(job, grid, codes, &mut self.drainage)
    }

    /// Solves the law over a step, receivers first.
    fn erode(&mut self, job: &Job<'_>, step_yr: f64) -> Result<(), NodeError> {
        let mut heights = std::mem::take(&mut self.heights);
        let Self { law, area, tangents, rock, .. } = &*self;
        // By direction of steepest descent, for links across a side and across a corner.
        let lengths_m = [false, true].map(|diagonal| {
            std::array::from_fn::<_, 256, _>(|tangent| self.cell_m * receivers::length(diagonal, tangent as u8))
        });
        let bases = lengths_m.map(|row| row.map(|length_m| step_yr / math::pow(length_m, self.n)));
        let coefficient = |erodibility: f64, base: f64| law.coefficient(erodibility * base);
        let everywhere = rock.everywhere().map(|k| bases.map(|row| row.map(|base| coefficient(k, base))));
        let solve = |cell: usize, code: u8, height: f64, below: f64| {
            let drop = height - below;
            // The floor of a lake waits until the pass it drains through is cut below it.
            if drop.is_nan() || drop <= 0.0 {
                return height;
            }
            let diagonal = usize::from(code::is_diagonal(code::direction(code)));
            let along = match tangents.get(cell) {
                Some(tangent) if code & code::TURNED == 0 => usize::from(*tangent),
                _ => 255 * diagonal,
            };
            let without_area = match &everywhere {
                Some(coefficients) => coefficients[diagonal][along],
                None => coefficient(rock.erodibility(cell), bases[diagonal][along]),
            };
            let coefficient = rock.vary(law, cell, law.times(without_area, area.power(law, cell)));
            let left = law.left(coefficient, drop);
            let slope = match &self.steepest {
                Steepest::Everywhere(slope) => *slope,
                Steepest::Each(slopes) => f64::from(slopes[cell]),
            };
            let steepest = slope * lengths_m[diagonal][along];
            below + if left > steepest { steepest } else { left }
        };
        let solved = self.drainage.upstream(job, &self.grid, &self.codes, &mut heights, solve);
        self.heights = heights;
        solved
    }
}
