//! Going on with what a coarser level has made.

use orograph_graph::{Job, NodeError, memory::zeroed, mix};

use super::Land;
use crate::{
    erosion::stream_power::levels::{Checkpoint, Places},
    numerics::{math, par, waves::Waves},
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
                .sampler(shortest)
        });
        // rivers of a young landscape still have the courses of the initial terrain, which no grid has laid
        let made_anew = (below.time_yr / below.response_yr).min(1.0);
        let furthest = DISPLACED[nth] * (made_anew * made_anew).max(LEAST_DISPLACED);
        let per_k = below.time_yr * self.area.least_power() / self.cell_m;
        let [before, after] = below.heights.map(|heights| move |cell: usize| f64::from(heights[cell]));
        let mut heights = std::mem::take(&mut self.heights);
        let taken = par::each(heights.chunks_mut(nx), |y, heights| {
            job.check()?;
            for (x, height) in heights.iter_mut().enumerate() {
                let cell = y * nx + x;
                let own = f64::from(start[cell]);
                if self.is_base(cell) {
                    *height = own - self.tectonics.base_fallen_m(below.time_yr);
                    continue;
                }
                let place = places.of(x, y);
                let plain = places.around(place);
                let drowned = own < self.sea_level_m && plain.cubic(after) < self.sea_level_m;
                let weakness = self.bedrock.as_ref().map_or(1.0, |bedrock| bedrock.weakness_at_start(cell, own));
                let left = if drowned { 1.0 } else { math::exp(-self.rock.erodibility(cell) * weakness * per_k) };
                let amount = furthest * (1.0 - left) * (places.side_distance(place) / SIDE_CELLS).clamp(0.0, 1.0);
                let around = if amount > 0.0 {
                    let [dx, dy] = [0, 1].map(|axis| amount * displaced[axis].at(place.map(|at| at * coarse_m)));
                    places.around([place[0] + dx, place[1] + dy])
                } else {
                    plain
                };
                let detail = if left > 1e-6 { left * (own - around.cubic(before)) } else { 0.0 };
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
