//! Rivers that carry what they erode, and drop it where they are too weak for it.
//!
//! The shared stream-power law (Hergarten 2020): E / K_d + Q / (K_t A) = Aᵐ S, with the rate of erosion E, below 0
//! where sediment settles, and the flux of sediment Q. With G = K_d / K_t it is E = K_d Aᵐ S − G Q / A, the law of Davy
//! and Lague (2009) and Yuan et al. (2019). Their iteration is not needed: what leaves a cell is linear in the new
//! height of its receiver, so that one sweep downstream and one upstream solve a step of any length exactly, and what
//! is eroded is what arrives.
//!
//! All amounts are metres over the area a of a cell and a step. Where the donors of a cell pass on P + R y, with y the
//! change of its height and D = 1 − R,
//!
//! > y = (γ P − C (h₀ − hᵣ)) / (1 + C + γ D) and Q = P − D y, with C = K_d Aᵐ Δt / d and γ = G a / A,
//!
//! hᵣ being the new height of its receiver.
//!
//! Where the exponent n of the slope is not 1, the law's erosion C xⁿ of the drop x = h − hᵣ is replaced by its tangent
//! at a drop x₀, C x₀ⁿ⁻¹ (n x − (n − 1) x₀), which is linear again; the drops of the solution are the next x₀ (Newton's
//! method for all cells at once). Whatever the tangents are, no mass is lost.
//!
//! What differs from the paper: heights are taken relative to those before the step, which keeps the sums over large
//! basins precise; and standing water. Where a cell is under water, its donors run down to the water's surface, and
//! what they bring spreads under water, see the module `water`: deltas grow from the shores. Where the pass is cut so
//! deep that the water is gone at the end of the step, its bed and what drains to it are cut as well; this material
//! joins the rivers at the next step. No mass is lost.

mod water;

use super::{area::Area, incision::Law, links::Links};
use crate::{
    numerics::{
        math, par,
        routing::{Drainage, Grid, code},
    },
    prelude::*,
};

/// What reaches a cell: P and R of P + R y.
type Arriving = [f64; 2];

/// γ where no water is: all that arrives settles, to double precision.
const NO_WATER: f64 = 1e30;

/// The least slope at which the law is made linear.
const FLAT: f64 = 1e-4;

/// The most rounds for n other than 1. Slopes that change by less than half in a step need two or three.
const MOST_ROUNDS: u32 = 8;
/// Rounds end when no cell moves by so many metres.
const SETTLED_M: f64 = 1e-4;

/// A cell after the step.
#[derive(Clone, Copy, Debug, Default)]
pub struct Bed {
    /// Height of the ground in metres.
    pub height: f64,
    /// Height of the water over it, or of the ground where there is none.
    pub water: f64,
    /// Material that joins the rivers at the next step, in metres.
    pub loose: f64,
}

/// A step of erosion and deposition.
#[derive(Clone, Copy)]
pub struct Transport<'a> {
    /// Topology of the raster.
    pub grid: &'a Grid,
    /// Receivers.
    pub codes: &'a [u8],
    /// The order of the receivers.
    pub drainage: &'a Drainage,
    /// Links of the law.
    pub links: &'a Links<'a>,
    /// The law of each cell where n is not 1.
    pub tangents: Option<&'a [Tangent]>,
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

/// The erosion of a step as a linear function of the drop x to the receiver: `slope` x − `offset`, in metres.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tangent {
    /// C where n is 1.
    pub slope: f64,
    /// 0 where n is 1.
    pub offset: f64,
}

impl Tangent {
    /// The tangent of C xⁿ at a drop of `at` metres. Flat drops count as steep as one in ten thousand.
    #[must_use]
    pub fn new(c: f64, n: f64, at: f64, length_m: f64) -> Self {
        let at = at.max(FLAT * length_m);
        let share = c * math::pow(at, n - 1.0);
        Self { slope: n * share, offset: (n - 1.0) * share * at }
    }

    /// The erosion of a drop.
    #[inline(always)]
    fn erosion(&self, drop: f64) -> f64 {
        self.slope * drop - self.offset
    }
}

impl Transport<'_> {
    /// The cells after a step, and the flux of sediment out of each in metres over a cell and the step. `loose` is
    /// material beside the heights that joins the rivers at each cell.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn solve(&self, job: &Job<'_>, heights: &[f64], loose: &[f64]) -> Result<(Vec<Bed>, Vec<f64>), NodeError> {
        let mut arriving: Vec<Arriving> = par::map_of(loose, |&loose| [loose, 0.0]);
        self.drainage.downstream(job, self.grid, self.codes, &mut arriving, |cell, code, [load, response]| {
            let height = heights[cell];
            if let Some(depth) = self.depth(cell, height) {
                return self.pass_under_water(cell, depth, heights, [load, response]);
            }
            let receiver = self.grid.receiver(cell as u32, code) as usize;
            let (law, _) = self.law(cell, code);
            let (c, d) = (law.slope, 1.0 - response);
            let share = d / (1.0 + c + self.settling(cell) * d);
            let passed_on = ((1.0 + c) * load / d + law.erosion(height - self.surface[receiver])) * share;
            // Water does not rise with its bed.
            let follows = if self.depth(receiver, heights[receiver]).is_some() { 0.0 } else { c * share };
            [passed_on, -follows]
        })?;
        let fills = self.spread(job, heights, &mut arriving)?;
        let bed = |&height: &f64| Bed { height, water: height.max(self.sea_level_m), loose: 0.0 };
        let mut beds: Vec<Bed> = par::map_of(heights, bed);
        self.drainage.upstream(job, self.grid, self.codes, &mut beds, |cell, code, Bed { height, .. }, below| {
            let [load, response] = arriving[cell];
            let (law, length_m) = self.law(cell, code);
            let c = law.slope;
            if let Some(depth) = self.depth(cell, height) {
                let (filled, waits) = if fills[cell] { (height + depth, 0.0) } else { (height + load, response) };
                let drop = filled - below.water;
                let height = if drop > 0.0 {
                    below.water + (drop + law.offset).min((1.0 + c) * drop) / (1.0 + c)
                } else {
                    filled
                };
                return Bed { height, water: height.max(below.water), loose: filled - height + waits };
            }
            let receiver = self.grid.receiver(cell as u32, code) as usize;
            let (d, settling) = (1.0 - response, self.settling(cell));
            let share = 1.0 / (1.0 + c + settling * d);
            let (level, gone) = match self.depth(receiver, heights[receiver]) {
                Some(_) => (self.surface[receiver], (self.surface[receiver] - below.water).max(0.0)),
                None => (below.height, 0.0),
            };
            let change = (settling * load - law.erosion(height - level)) * share;
            // What the receiver's water, had it been that low from the start, would have got.
            let late = c * gone * share;
            let eroded = height + change - late;
            // What stands too steep over the receiver slides, and joins the rivers at the next step as well.
            let height = eroded.min(below.water + (self.steepest)(cell) * length_m);
            Bed { height, water: height.max(below.water), loose: d * (late + eroded - height) }
        })?;
        let flux = par::map(heights.len(), |cell| {
            let ([load, response], before, bed) = (arriving[cell], heights[cell], &beds[cell]);
            match self.depth(cell, before) {
                // the sums over the water so far; outlets keep their height, and what comes to them leaves
                Some(depth) => match (fills[cell], code::has_receiver(self.codes[cell])) {
                    (true, true) => load - response - depth,
                    (true, false) => load - response,
                    (false, true) => 0.0,
                    (false, false) => load,
                },
                None => load - (1.0 - response) * (bed.height - before) - bed.loose,
            }
        });
        Ok((beds, flux))
    }

    /// The law of a cell and the length of its link in metres.
    #[inline(always)]
    fn law(&self, cell: usize, code: u8) -> (Tangent, f64) {
        let (c, length_m) = self.links.of(cell, code);
        let law = self.tangents.map_or(Tangent { slope: c, offset: 0.0 }, |tangents| tangents[cell]);
        (law, length_m)
    }

    /// The tangents of C xⁿ at the drops of `found`, with the water of `heights`.
    fn tangents_at(&self, heights: &[f64], found: &[f64], law: &Law, n: f64) -> Vec<Tangent> {
        let tangent = |cell: usize| {
            let code = self.codes[cell];
            if !code::has_receiver(code) {
                return Tangent { slope: 0.0, offset: 0.0 };
            }
            let receiver = self.grid.receiver(cell as u32, code) as usize;
            let level = match self.depth(receiver, heights[receiver]) {
                Some(_) => self.surface[receiver],
                None => found[receiver],
            };
            let (coefficient, length_m) = self.links.of(cell, code);
            Tangent::new(law.value(coefficient), n, found[cell] - level, length_m)
        };
        par::map(heights.len(), tangent)
    }

    /// [`Self::solve`] for any exponent n, round after round from the drops as they are.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn solve_power(
        &self,
        job: &Job<'_>,
        heights: &[f64],
        loose: &[f64],
        law: &Law,
        n: f64,
    ) -> Result<(Vec<Bed>, Vec<f64>), NodeError> {
        let mut found = heights.to_vec();
        let mut rounds = 0;
        loop {
            let tangents = self.tangents_at(heights, &found, law, n);
            let (beds, flux) = Transport { tangents: Some(&tangents), ..*self }.solve(job, heights, loose)?;
            rounds += 1;
            let moves = |height: &f64, bed: &Bed| (height - bed.height).abs() >= SETTLED_M;
            if rounds == MOST_ROUNDS || !par::any_with(&found, &beds, moves) {
                return Ok((beds, flux));
            }
            par::change_with(&mut found, &beds, |height, bed| *height = bed.height);
        }
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
