//! Rivers that carry what they erode, and drop it where they are too weak for it.
//!
//! The shared stream-power law (Hergarten 2020): E / K_d + Q / (K_t A) = Aᵐ S, with the rate of erosion E, below 0 where
//! sediment settles, and the flux of sediment Q. With G = K_d / K_t it is E = K_d Aᵐ S − G Q / A, the law of Davy and
//! Lague (2009) and Yuan et al. (2019). Their iteration is not needed: what leaves a cell is linear in the new height of
//! its receiver, so that one sweep downstream and one upstream solve a step of any length exactly, and what is eroded is
//! what arrives.
//!
//! All amounts are metres over the area a of a cell and a step. Where the donors of a cell pass on P + R y, with y the
//! change of its height and D = 1 − R,
//!
//! > y = (γ P − C (h₀ − hᵣ)) / (1 + C + γ D) and Q = P − D y, with C = K_d Aᵐ Δt / d and γ = G a / A,
//!
//! hᵣ being the new height of its receiver.
//!
//! What differs from the paper: heights are taken relative to those before the step, which keeps the sums over large
//! basins precise; and standing water. Where a cell is under water, its donors run down to the water's surface, and
//! what they bring fills the cell up to that surface before anything is passed on: deltas grow from the shores. Where
//! the pass is cut so deep that the water is gone at the end of the step, its bed and what drains to it are cut as well;
//! this material joins the rivers at the next step. No mass is lost.

use rayon::prelude::*;

use super::{area::Area, links::Links};
use crate::{
    hydrology::engine::{Drainage, Grid},
    prelude::*,
};

/// What reaches a cell: P and R of P + R y.
type Arriving = [f64; 2];

/// γ where no water is: all that arrives settles, to double precision.
const NO_WATER: f64 = 1e30;

/// A cell after the step.
#[derive(Clone, Copy, Debug)]
pub struct Bed {
    /// Height of the ground in metres.
    pub height: f64,
    /// Height of the water over it, or of the ground where there is none.
    pub water: f64,
    /// Material that joins the rivers at the next step, in metres.
    pub loose: f64,
}

/// A step of erosion and deposition.
pub struct Transport<'a> {
    /// Topology of the raster.
    pub grid: &'a Grid,
    /// Receivers.
    pub codes: &'a [u8],
    /// The order of the receivers.
    pub drainage: &'a Drainage,
    /// Links of the law with n = 1.
    pub links: Links<'a>,
    /// Drainage areas.
    pub area: &'a Area<'a>,
    /// Area of a cell in m².
    pub cell_m2: f64,
    /// The coefficient G.
    pub deposition: Lane<'a>,
    /// The steepest drop per metre at a cell.
    pub steepest: &'a (dyn Fn(usize) -> f64 + Sync),
    /// Level of the sea in metres.
    pub sea_level_m: f64,
    /// Surface of the land and of all water on it before the step.
    pub surface: &'a [f64],
}

impl Transport<'_> {
    /// The cells after a step, and the flux of sediment out of each in metres over a cell and the step. `loose` is
    /// material beside the heights that joins the rivers at each cell.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn solve(&self, job: &Job<'_>, heights: &[f64], loose: &[f64]) -> Result<(Vec<Bed>, Vec<f64>), NodeError> {
        let mut arriving: Vec<Arriving> = loose.par_iter().map(|&loose| [loose, 0.0]).collect();
        self.drainage.downstream(job, self.grid, self.codes, &mut arriving, |cell, code, [load, response]| {
            let height = heights[cell];
            if let Some(depth) = self.depth(cell, height) {
                return [load - load.min(depth), 0.0];
            }
            let receiver = self.grid.receiver(cell as u32, code) as usize;
            let (c, _) = self.links.of(cell, code);
            let d = 1.0 - response;
            let share = d / (1.0 + c + self.settling(cell) * d);
            let passed_on = ((1.0 + c) * load / d + c * (height - self.surface[receiver])) * share;
            // Water does not rise with its bed.
            let follows = if self.depth(receiver, heights[receiver]).is_some() { 0.0 } else { c * share };
            [passed_on, -follows]
        })?;
        let bed = |&height: &f64| Bed { height, water: height.max(self.sea_level_m), loose: 0.0 };
        let mut beds: Vec<Bed> = heights.par_iter().map(bed).collect();
        self.drainage.upstream(job, self.grid, self.codes, &mut beds, |cell, code, Bed { height, .. }, below| {
            let [load, response] = arriving[cell];
            let (c, length_m) = self.links.of(cell, code);
            if let Some(depth) = self.depth(cell, height) {
                let filled = height + load.min(depth);
                let height =
                    if filled > below.water { below.water + (filled - below.water) / (1.0 + c) } else { filled };
                return Bed { height, water: height.max(below.water), loose: filled - height };
            }
            let receiver = self.grid.receiver(cell as u32, code) as usize;
            let (d, settling) = (1.0 - response, self.settling(cell));
            let share = 1.0 / (1.0 + c + settling * d);
            let (level, gone) = match self.depth(receiver, heights[receiver]) {
                Some(_) => (self.surface[receiver], (self.surface[receiver] - below.water).max(0.0)),
                None => (below.height, 0.0),
            };
            let change = (settling * load - c * (height - level)) * share;
            // What the receiver's water, had it been that low from the start, would have got.
            let late = c * gone * share;
            let eroded = height + change - late;
            // What stands too steep over the receiver slides, and joins the rivers at the next step as well.
            let height = eroded.min(below.water + (self.steepest)(cell) * length_m);
            Bed { height, water: height.max(below.water), loose: d * (late + eroded - height) }
        })?;
        let cells = arriving.par_iter().zip(heights).zip(&beds);
        let flux =
            cells.map(|(([load, response], before), bed)| load - (1.0 - response) * (bed.height - before) - bed.loose);
        let flux = flux.collect();
        Ok((beds, flux))
    }

    /// Depth of the water over a cell of a height, where there is any.
    #[inline(always)]
    fn depth(&self, cell: usize, height: f64) -> Option<f64> {
        let depth = self.surface[cell] - height;
        (depth > 0.0).then_some(depth)
    }

    /// γ of a cell.
    #[inline(always)]
    fn settling(&self, cell: usize) -> f64 {
        let deposition = f64::from(self.deposition.at(cell)).max(0.0);
        if deposition > 0.0 { (deposition * self.cell_m2 / self.area.m2(cell)).min(NO_WATER) } else { 0.0 }
    }
}

#[cfg(test)]
mod tests;
