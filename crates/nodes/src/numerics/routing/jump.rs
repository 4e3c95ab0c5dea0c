//! Transfers water from the pit of a depression to the far side of its pass.
//!
//! Directions do not change. The amount that collects in a pit is added to the first cell beyond the pass, from the
//! innermost basin outwards, and everything is accumulated a second time: twice the work, whatever the number of
//! depressions.

use orograph_graph::{Job, NodeError};

use super::{Depressions, Drainage, Elevation, Grid, basins::OUTSIDE, drainage::Amount};

impl<T: Elevation> Depressions<T> {
    /// Accumulates `amounts` downstream along `codes` as [`Drainage::accumulate`] does, and continues the amount of
    /// each pit from the far side of its pass.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn accumulate_jumping<A: Amount>(
        &self,
        job: &Job<'_>,
        grid: &Grid,
        codes: &[u8],
        amounts: &mut Vec<A>,
    ) -> Result<(), NodeError> {
        let mut drainage = Drainage::default();
        let mut own = amounts.clone();
        drainage.accumulate(job, grid, codes, amounts)?;
        if self.pits.is_empty() {
            return Ok(());
        }
        let mut gathered: Vec<A> = self.pits.iter().map(|pit| amounts[*pit as usize]).collect();
        let exits = self.exits(grid);
        for basin in self.outside_in(&exits).into_iter().rev() {
            let exit = &exits[basin as usize - 1];
            let water = gathered[basin as usize - 1];
            if let Some(far) = exit.far {
                own[far as usize] = own[far as usize].plus(water);
            }
            let beyond = self.beyond(exit);
            if beyond != OUTSIDE {
                gathered[beyond as usize - 1] = gathered[beyond as usize - 1].plus(water);
            }
        }
        drainage.accumulate(job, grid, codes, &mut own)?;
        *amounts = own;
        Ok(())
    }

    /// Returns the pits whose water continues beyond a pass within the world.
    pub fn jumps(&self, grid: &Grid) -> impl Iterator<Item = u32> {
        self.exits(grid).into_iter().zip(&self.pits).filter(|(exit, _)| exit.far.is_some()).map(|(_, pit)| *pit)
    }
}
