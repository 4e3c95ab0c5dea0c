//! Going on with what a coarser level has made.

use orograph_graph::{Job, NodeError, memory::zeroed, mix};

use super::Land;
use crate::{
    erosion::stream_power::levels::{Checkpoint, Places},
    numerics::{
        math, par,
        waves::{Sampler, Waves},
    },
};

/// How far the land is displaced from the coarsest level to the second, and on all levels beyond: the standard deviation,
/// in coarse cells.
const DISPLACED: [f64; 2] = [1.2, 0.25];
/// The longest and the shortest wavelength of that displacement in coarse cells. The long waves turn ridges and valleys
/// that the coarsest level has laid along its rows, columns and diagonals, the short ones bend the stretches from cell to
/// cell.
const DISPLACEMENT_WAVES: [[f64; 2]; 2] = [[24.0, 3.0], [6.0, 1.5]];
/// The spectral slope at which waves of every length bend a line by the same angle.
const DISPLACEMENT_SLOPE: f64 = 4.0;
/// The least part of it, in young landscapes.
const LEAST_DISPLACED: f64 = 0.4;
/// Displacement fades over so many coarse cells at the sides.
const SIDE_CELLS: f64 = 6.0;

impl Land<'_> {
    /// The time in which the land answers a change: how long a wave of erosion, which travels at n K Aᵐ Sⁿ⁻¹, takes
    /// from the outlets to the nearest 95 % of the cells, on the network of the last step. In years; infinite where
    /// rock does not erode.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn response_yr(&self, job: &Job<'_>, step_yr: f64) -> Result<f64, NodeError> {
        let links = self.links(step_yr);
        let mut times_yr = zeroed(self.heights.len())?;
        self.drainage.upstream(job, &self.grid, &self.codes, &mut times_yr, |cell, code, _, below| {
            let receiver = self.grid.receiver(cell as u32, code) as usize;
            let drop = self.heights[cell] - self.heights[receiver];
            if drop.is_nan() || drop <= 0.0 {
                return below;
            }
            // In a step the law leaves x of a drop b, and (b − x) / x is its speed over n times the step by the length.
            let left = self.law.left(links.of(cell, code).0, drop);
            below + step_yr * left / (self.n * (drop - left))
        })?;
        let most = (times_yr.len() - 1) * 19 / 20;
        let (_, &mut response_yr, _) = times_yr.select_nth_unstable_by(most, f64::total_cmp);
        Ok(response_yr)
    }

    /// What is left of detail of the initial terrain: the share exp(−K w `per_k`), in rock of the weakness w.
    #[must_use]
    pub(super) fn detail_left(&self, cell: usize, weakness: f64, per_k: f64) -> f64 {
        math::exp(-self.rock.erodibility(cell) * weakness * per_k)
    }

    /// Years that have passed.
    #[must_use]
    pub const fn time_yr(&self) -> f64 {
        self.time_yr
    }

    /// Cells of the rim of `inland` sides through which rivers leave, in rising order.
    #[must_use]
    pub fn gates(&self) -> &[u32] {
        &self.gates
    }

    /// What joins the rivers at the next step and what lies on the rock, in metres. Returns None without deposition, or
    /// where the thickness is not followed.
    #[must_use]
    pub fn loose(&self) -> Option<(&[f64], &[f32])> {
        let sediment = self.sediment.as_ref()?;
        Some((&sediment.debris, sediment.thickness.as_deref()?))
    }

    /// Goes on from a coarser level: its land, interpolated at displaced places, and of the detail of the start what the
    /// law has left of bumps as small as a cell. Where all of it is left nothing is displaced, and where the run is
    /// short compared with the response time, less is. Cells at base level have moved with it.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn take_over(
        &mut self,
        job: &Job<'_>,
        level: u32,
        start: &[f32],
        below: &Checkpoint<'_>,
        places: &Places,
    ) -> Result<(), NodeError> {
        let nx = self.grid.nx;
        let coarse_m = below.frame.outer.cell_m();
        let nth = usize::from(level > 1);
        let displaced = [0, 1].map(|axis| {
            let [longest, shortest] = DISPLACEMENT_WAVES[nth].map(|cells| cells * coarse_m);
            let seed = mix(job.seed() ^ mix(0xD15C_0000 + 2 * level + axis));
            Waves { longest_m: longest, spectral_slope: DISPLACEMENT_SLOPE, stretch: 1.0, grain: 0.6, seed }
                .sampler(shortest, job.world())
        });
        // rivers of a young landscape still have the courses of the initial terrain, which no grid has laid
        let made_anew = (below.time_yr / below.response_yr).min(1.0);
        let furthest = DISPLACED[nth] * (made_anew * made_anew).max(LEAST_DISPLACED);
        let per_k = below.time_yr * self.area.least_power() / self.cell_m;
        let [before, after] = below.heights.map(|heights| move |cell: usize| f64::from(heights[cell]));
        let mut heights = std::mem::take(&mut self.heights);
        let taken = par::each_with(heights.chunks_mut(nx), Shifts::default, |shifts, y, heights| {
            job.check()?;
            let own = |x: usize| f64::from(start[y * nx + x]);
            // how much each cell is displaced, and what is left of the detail of the start
            shifts.clear();
            for x in 0..nx {
                let (cell, place) = (y * nx + x, places.of(x, y));
                let drowned = || own(x) < self.sea_level_m && places.around(place).cubic(after) < self.sea_level_m;
                let left = if self.is_base(cell) || drowned() {
                    1.0
                } else {
                    let weakness = self.bedrock.as_ref().map_or(1.0, |bedrock| bedrock.weakness_at_start(cell, own(x)));
                    self.detail_left(cell, weakness, per_k)
                };
                let amount = furthest * (1.0 - left) * (places.side_distance(place) / SIDE_CELLS).clamp(0.0, 1.0);
                shifts.push(place.map(|at| at * coarse_m), amount, left);
            }
            shifts.draw(&displaced);
            for (x, height) in heights.iter_mut().enumerate() {
                if self.is_base(y * nx + x) {
                    *height = own(x) - self.tectonics.base_fallen_m(below.time_yr);
                    continue;
                }
                let ([dx, dy], left) = shifts.of(x);
                let place = places.of(x, y);
                let around = places.around([place[0] + dx, place[1] + dy]);
                let detail = if left > 1e-6 { left * (own(x) - around.cubic(before)) } else { 0.0 };
                *height = around.cubic(after) + detail;
            }
            Ok::<(), NodeError>(())
        });
        self.heights = heights;
        taken?;
        if let (Some(own), Some(loose)) = (&mut self.sediment, below.loose) {
            let (cells, under) = (self.heights.len(), |cell: usize| places.cell(cell % nx, cell / nx));
            own.debris = par::map(cells, |cell| f64::from(loose.debris[under(cell)]));
            if own.thickness.is_some() {
                own.thickness = Some(par::map(cells, |cell| loose.thickness[under(cell)]));
            }
        }
        self.time_yr = below.time_yr;
        Ok(())
    }

    /// Draws out the rough ground along the slopes of the land as it is.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn make_ribs(&mut self, job: &Job<'_>) -> Result<(), NodeError> {
        self.ground.lie_along(job, &self.heights)
    }
}

/// The displacements of a row of cells, and what is left of its detail.
#[derive(Default)]
struct Shifts {
    /// Coordinates of the cells in metres.
    places_m: [Vec<f64>; 2],
    /// The standard deviation of each cell's displacement.
    amounts: Vec<f64>,
    /// The share of the detail of the start that is left.
    left: Vec<f64>,
    /// The displacements along both axes.
    by: [Vec<f64>; 2],
}

impl Shifts {
    fn clear(&mut self) {
        self.places_m.iter_mut().for_each(Vec::clear);
        self.amounts.clear();
        self.left.clear();
    }

    fn push(&mut self, [x_m, y_m]: [f64; 2], amount: f64, left: f64) {
        self.places_m[0].push(x_m);
        self.places_m[1].push(y_m);
        self.amounts.push(amount);
        self.left.push(left);
    }

    /// Displaces the cells by waves along each axis.
    fn draw(&mut self, waves: &[Sampler; 2]) {
        let [xs, ys] = &self.places_m;
        let is_displaced = self.amounts.iter().any(|amount| *amount > 0.0);
        for (by, waves) in self.by.iter_mut().zip(waves) {
            by.clear();
            by.resize(self.amounts.len(), 0.0);
            if is_displaced {
                waves.fill([xs, ys], by);
                by.iter_mut().zip(&self.amounts).for_each(|(by, amount)| *by *= amount);
            }
        }
    }

    /// The displacement of a cell, and the share of its detail that is left.
    fn of(&self, x: usize) -> ([f64; 2], f64) {
        ([self.by[0][x], self.by[1][x]], self.left[x])
    }
}
