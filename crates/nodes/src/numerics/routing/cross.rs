//! Routes water across the surface of lakes.
//!
//! From a lake's outlet inwards, every cell at or below the water level gets the shortest path over water. Steps across
//! a side count 5 and across a corner 7, which is within 1 % of the diagonal's length (Borgefors 1986, "Distance
//! transformations in digital images"). Distances are small integers, so that eight bucket queues hold all active cells
//! (Dial 1969) and nothing is sorted: O(N). Flats are lakes of zero depth and are routed in the same way.

use orograph_graph::{Job, NodeError, memory::filled};

use super::{
    Depressions, Elevation, Grid,
    basins::OUTSIDE,
    code::{BORDER, OUTLET, TURNED, is_diagonal, opposite},
};

const SIDE: u32 = 5;
const CORNER: u32 = 7;
/// More than the largest step.
const QUEUES: u32 = 8;

impl<T: Elevation> Depressions<T> {
    /// Gives every cell that is not above its basin's level the receiver on the shortest path over the level surface
    /// to the outlet of the lake. `heights` are those that the basins were found on.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn cross(&self, job: &Job<'_>, grid: &Grid, heights: &[T], codes: &mut [u8]) -> Result<(), NodeError> {
        if self.spills.is_empty() {
            return Ok(());
        }
        let level = |cell: u32| {
            let label = self.labels[cell as usize];
            let level = self.spills[label as usize].level;
            (label != OUTSIDE && heights[cell as usize] <= level).then_some(level)
        };
        let mut distance = filled(grid.cells(), u32::MAX)?;
        let mut queues: [Vec<u32>; QUEUES as usize] = Default::default();
        for exit in self.exits(grid) {
            // A path that continues over the same water is not an outlet.
            if exit.far.is_some_and(|far| level(far).is_some() && level(far) == level(exit.near)) {
                continue;
            }
            let near = exit.near as usize;
            distance[near] = 0;
            codes[near] = codes[near] & BORDER | exit.to.map_or(OUTLET, |to| to as u8 | TURNED);
            queues[0].push(exit.near);
        }
        let (mut reached, mut visited) = (0, 0_u32);
        while queues.iter().any(|queue| !queue.is_empty()) {
            for cell in std::mem::take(&mut queues[(reached % QUEUES) as usize]) {
                if distance[cell as usize] != reached {
                    continue;
                }
                visited += 1;
                if visited.is_multiple_of(8192) {
                    job.check()?;
                }
                let (code, here) = (codes[cell as usize], level(cell));
                for direction in 0..8 {
                    let Some(next) = grid.beside(cell, code, direction) else { continue };
                    let there = reached + if is_diagonal(direction) { CORNER } else { SIDE };
                    if there < distance[next as usize] && here.is_some() && level(next) == here {
                        distance[next as usize] = there;
                        codes[next as usize] = codes[next as usize] & BORDER | opposite(direction) as u8 | TURNED;
                        queues[(there % QUEUES) as usize].push(next);
                    }
                }
            }
            reached += 1;
        }
        Ok(())
    }
}
