//! Going on with what happened on coarser cells.

use orograph_graph::{Field, Job, NodeError};

use super::Land;
use crate::erosion::stream_power::coarse::Coarse;

impl Land<'_> {
    /// The time in which the land answers a change: how long a wave of erosion, which travels at n K Aᵐ Sⁿ⁻¹, takes from
    /// the outlets to the nearest 95 % of the cells, on the network of the last step. In years; infinite where rock does
    /// not erode.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn response_yr(&self, job: &Job<'_>, step_yr: f64) -> Result<f64, NodeError> {
        let links = self.links(step_yr);
        let mut times_yr = vec![0.0; self.heights.len()];
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

    /// Goes on from what `below`, the land on coarser cells, has become. The starts are those of the run.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn take_over(
        &mut self,
        job: &Job<'_>,
        coarse: &Coarse,
        [start, coarse_start]: [&Field; 2],
        below: Land<'_>,
    ) -> Result<(), NodeError> {
        self.time_yr = below.time_yr;
        if let (Some(own), Some(below)) = (&mut self.sediment, &below.sediment) {
            own.debris = coarse.spread(&below.debris);
            own.thickness = below.thickness.as_ref().map(|thickness| coarse.spread(thickness));
        }
        self.heights = coarse.corrected(job, start.samples(), coarse_start.samples(), below.heights)?;
        Ok(())
    }
}
