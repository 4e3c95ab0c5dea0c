//! Perfectly plastic glaciers along the paths of steepest descent: O(N), without steps of time.
//!
//! The balance is accumulated down the smoothed surface of the step before; where the sum is above zero there is ice.
//! Up those paths the surface rises as Nye's (1951) plastic ice does, (s − b) ds/dx = τ / (ρ g), solved for each link
//! from its receiver: s = (sᵣ + b)/2 + √(((sᵣ − b)/2)² + τ d / (ρ g)). τ is the stress at which ice on the slope of the
//! surface carries the discharge, at most the yield stress. Ground beside a glacier that is below its surface is filled
//! to it. The mean velocity is the discharge over the section, whose width is 0.4 Q^0.45 m (Q in m³/yr), in the way of
//! the scaling of valley glaciers (Bahr 1997).

use orograph_graph::{Job, NodeError, Window, World, memory::filled, memory::zeroed};

use super::{
    blur::blurred,
    climate::Climate,
    debris::{Settled, dropped, fitting},
    grid::Grid,
    ice::{Ice, THIN_M},
    kernels::Rheology,
};
use crate::numerics::{
    math, par,
    routing::{self, Depressions, Drainage, code, receivers},
};

/// Smoothing of the surface before it is routed, and of the ice after.
const SMOOTH_M: [f64; 2] = [120.0, 80.0];
/// Mean stress over a glacier's width, over that of its middle.
const MEAN_STRESS: f64 = 0.5;
/// Thickness in metres for which ice that deforms adds to sliding.
const TYPICAL_M: f64 = 150.0;
/// Smallest slope for which the stress is found.
const FLATTEST: f64 = 0.02;
/// Width of a glacier of 1 m³/yr, in metres, and the exponent of its discharge.
const WIDTH: [f64; 2] = [0.4, 0.45];

/// Ice of one moment.
pub(super) struct Plastic {
    routes: routing::Grid,
    rheology: Rheology,
    codes: Vec<u8>,
    depressions: Depressions<f64>,
    drainage: Drainage,
    /// Discharge of ice out of each cell, in m³/yr.
    discharge: Vec<f64>,
    /// Area of positive balance that drains through each cell, in m².
    pub area: Vec<f64>,
    /// Surface of each cell.
    pub level: Vec<f64>,
}

/// A cell of a glacier, seen from the one that drains to it.
#[derive(Clone, Copy)]
struct Reach {
    level: f64,
    speed: f64,
    is_ice: bool,
}

impl Plastic {
    /// # Errors
    /// When no side of the world lets ice out, or there is not enough memory.
    pub fn new(window: &Window, grid: &Grid, rheology: Rheology, bed: &[f64]) -> Result<Self, NodeError> {
        let cells = [grid.nx as u32, grid.ny as u32];
        let routes = routing::Grid::new(&Window::whole(World { cells, ..window.world }))?;
        Ok(Self {
            routes,
            rheology,
            codes: zeroed(grid.len())?,
            depressions: Depressions::default(),
            drainage: Drainage::default(),
            discharge: zeroed(grid.len())?,
            area: zeroed(grid.len())?,
            level: orograph_graph::memory::copied(bed)?,
        })
    }

    /// Finds the ice on a bed, in a climate whose heights are `shift_m` higher, with speeds of at most `fastest` m/yr.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn find(
        &mut self,
        job: &Job<'_>,
        grid: &Grid,
        climate: &Climate,
        bed: &[f64],
        [shift_m, fastest]: [f64; 2],
        ice: &mut Ice,
    ) -> Result<(), NodeError> {
        let (nx, area_m2, rheology) = (grid.nx, grid.area_m2(), self.rheology);
        let mut rough: Vec<f32> = zeroed(grid.len())?;
        par::change_with(&mut rough, &self.level, |rough, level| *rough = *level as f32);
        let [smooth] = blurred(grid, [&rough], &|_| SMOOTH_M[0], SMOOTH_M[0])?;
        let mut heights: Vec<f64> = zeroed(grid.len())?;
        par::change_with(&mut heights, &smooth, |height, smooth| *height = f64::from(*smooth));
        drop(smooth);
        receivers::d8(job, &self.routes, &heights, &mut self.codes)?;
        self.depressions.find(job, &self.routes, &heights, &self.codes)?;
        self.depressions.carve(job, &self.routes, &mut self.codes)?;

        let level = &self.level;
        let balance = |cell: usize| climate.balance(cell, level[cell], shift_m);
        let fill = |out: &mut [f64], value: &(dyn Fn(f64) -> f64 + Sync)| {
            par::all(out.chunks_mut(nx), |j, row| {
                row.iter_mut().enumerate().for_each(|(i, out)| *out = value(balance(j * nx + i)));
            });
        };
        fill(&mut self.area, &|balance| if balance > 0.0 { area_m2 } else { 0.0 });
        self.drainage.accumulate(job, &self.routes, &self.codes, &mut self.area)?;
        fill(&mut self.discharge, &|balance| area_m2 * balance);
        self.drainage.downstream(job, &self.routes, &self.codes, &mut self.discharge, |_, _, own| own.max(0.0))?;
        par::change(&mut self.discharge, |discharge| *discharge = discharge.max(0.0));

        let discharge = &self.discharge;
        let none = Reach { level: 0.0, speed: 0.0, is_ice: false };
        let mut reaches = filled(grid.len(), none)?;
        let [dx, dy] = grid.cell_m;
        // τ / (ρ g) of a discharge q per width: q = u τ / (ρ g S) with u = (Aₛ + 2 A H / 5) τ³
        let mobility = rheology.sliding + rheology.deformation * TYPICAL_M;
        let stress_m = |cell: usize, slope: f64| {
            let width = (WIDTH[0] * math::pow(discharge[cell], WIDTH[1])).max(dx.min(dy));
            MEAN_STRESS * (discharge[cell] / width * slope.max(FLATTEST) / mobility).sqrt().sqrt().min(rheology.yield_m)
        };
        let through = |cell: usize, depth: f64| {
            let width = (WIDTH[0] * math::pow(discharge[cell], WIDTH[1])).max(dx.min(dy));
            (discharge[cell] / (width * depth.max(10.0))).min(fastest)
        };
        par::all(reaches.chunks_mut(nx), |j, reaches| {
            for (i, reach) in reaches.iter_mut().enumerate() {
                let cell = j * nx + i;
                *reach = Reach { level: bed[cell], speed: 0.0, is_ice: discharge[cell] > 0.0 };
            }
        });
        self.drainage.upstream(job, &self.routes, &self.codes, &mut reaches, |cell, link, own, below| {
            let ground = bed[cell];
            if own.is_ice {
                let direction = code::direction(link);
                let length = if code::is_diagonal(direction) {
                    math::hypot(dx, dy)
                } else if direction == 0 || direction == 4 {
                    dx
                } else {
                    dy
                };
                let slope = (heights[cell] - heights[self.routes.receiver(cell as u32, link) as usize]) / length;
                let half = 0.5 * (below.level - ground);
                let level = 0.5 * (below.level + ground) + (half * half + stress_m(cell, slope) * length).sqrt();
                Reach { level, speed: through(cell, level - ground), is_ice: true }
            } else if below.is_ice && ground < below.level {
                Reach { level: below.level, ..below }
            } else {
                own
            }
        })?;

        // surfaces of neighbouring paths differ; their mean does not
        let mut share: Vec<f32> = zeroed(grid.len())?;
        par::change_with(&mut rough, &reaches, |rough, reach| {
            *rough = if reach.is_ice { reach.level as f32 } else { 0.0 }
        });
        par::change_with(&mut share, &reaches, |share, reach| *share = f32::from(u8::from(reach.is_ice)));
        let [rough, share] = blurred(grid, [&rough, &share], &|_| SMOOTH_M[1], SMOOTH_M[1])?;
        let codes = &self.codes;
        let [east, south] = &mut ice.velocity;
        let rows =
            ice.depth.chunks_mut(nx).zip(ice.sliding.chunks_mut(nx)).zip(east.chunks_mut(nx).zip(south.chunks_mut(nx)));
        par::all(rows.zip(self.level.chunks_mut(nx)), |j, (((depth, sliding), (east, south)), level)| {
            for i in 0..depth.len() {
                let cell = j * nx + i;
                let reach = &reaches[cell];
                let surface = if reach.is_ice { f64::from(rough[cell] / share[cell]) } else { bed[cell] };
                let thick = (surface - bed[cell]).max(0.0);
                let speed = if thick > THIN_M { reach.speed } else { 0.0 };
                let way = if code::has_receiver(codes[cell]) {
                    let (x, y) = code::STEPS[code::direction(codes[cell])];
                    let length = math::hypot(f64::from(x), f64::from(y));
                    [f64::from(x) / length, f64::from(y) / length]
                } else {
                    [0.0; 2]
                };
                let slides = rheology.sliding / (rheology.deformation * thick + rheology.sliding).max(1e-30);
                depth[i] = thick as f32;
                sliding[i] = (speed * slides) as f32;
                east[i] = (speed * way[0]) as f32;
                south[i] = (speed * way[1]) as f32;
                level[i] = bed[cell] + thick;
            }
        });
        Ok(())
    }

    /// Carries debris along the paths; see [`super::debris::carry`].
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn carry(
        &self,
        job: &Job<'_>,
        melt_m3: impl Fn(usize) -> f64 + Sync,
        depth: &[f32],
        room: impl Fn(usize) -> f64 + Sync,
        mut volume: Vec<f64>,
    ) -> Result<Settled, NodeError> {
        let stays = |cell: usize, has: f64| {
            let drops = dropped(melt_m3(cell).max(0.0), self.discharge[cell], f64::from(depth[cell]));
            fitting(has * drops, room(cell))
        };
        self.drainage.downstream(job, &self.routes, &self.codes, &mut volume, |cell, _, own| own - stays(cell, own))?;
        let mut left_m3 = 0.0;
        for (cell, volume) in volume.iter_mut().enumerate() {
            if *volume > 0.0 {
                let stays = stays(cell, *volume);
                if !code::has_receiver(self.codes[cell]) {
                    left_m3 += *volume - stays;
                }
                *volume = stays;
            }
        }
        Ok(Settled { volume, left_m3, washed_m3: 0.0 })
    }
}
