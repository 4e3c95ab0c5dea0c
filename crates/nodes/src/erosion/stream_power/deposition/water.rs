//! What rivers bring into standing water spreads there.
//!
//! A body of water whose room is smaller than what arrives fills up and passes on the rest; the sums of both are
//! carried along its receivers to where it overflows. In any other body all settles: the load at each mouth spreads by
//! the equation of a plume that settles as it mixes, q − ℓ² ∇²q = load, in a few rounds that leave what no longer fits
//! below the water's surface to the next. So mouths fill first, and rivers build deltas that advance on all sides. What
//! fits nowhere near waits for the next step, and what comes to an outlet leaves the world.
//!
//! Yuan et al. (2019) let sediment diffuse over the floor of the sea in the same way; here only what settles moves, so
//! that drowned land keeps its form.

use orograph_graph::{Boundary, Edge, World};

use super::{Arriving, Transport};
use crate::{
    numerics::{
        hillslope::Hillslope,
        par,
        routing::{code::has_receiver, donors},
    },
    prelude::*,
};

/// How far what arrives spreads, ℓ, in metres.
const SPREADS_M: f64 = 500.0;
/// Steps by which it does, so that it spreads in circles.
const SWEEPS: u32 = 2;
/// Rounds.
const ROUNDS: u32 = 4;

impl Transport<'_> {
    /// Returns true if two cells are under the same water.
    #[inline(always)]
    fn is_joined(&self, cell: usize, other: usize, heights: &[f64]) -> bool {
        self.surface[cell] == self.surface[other] && self.depth(other, heights[other]).is_some()
    }

    /// The receiver of a cell under water if that is under the same water.
    #[inline(always)]
    fn onwards(&self, cell: usize, heights: &[f64]) -> Option<usize> {
        let code = self.codes[cell];
        let receiver = has_receiver(code).then(|| self.grid.receiver(cell as u32, code) as usize);
        receiver.filter(|&receiver| self.is_joined(cell, receiver, heights))
    }

    /// What a cell under `depth` of water passes on: the sums of the load and of the room so far, and at the end of the
    /// water what did not find room.
    pub(super) fn pass_under_water(
        &self,
        cell: usize,
        depth: f64,
        heights: &[f64],
        [load, room]: Arriving,
    ) -> Arriving {
        let room = room + depth;
        if self.onwards(cell, heights).is_some() { [load, room] } else { [(load - room).max(0.0), 0.0] }
    }

    /// Spreads what arrives in water that has room for it: there `arriving` becomes what settles and what waits.
    /// Returns true for cells under water that fills up, whose `arriving` stays.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub(super) fn spread(
        &self,
        job: &Job<'_>,
        heights: &[f64],
        arriving: &mut [Arriving],
    ) -> Result<Vec<bool>, NodeError> {
        let depth = |cell: usize| self.depth(cell, heights[cell]);
        // the sea leaves the world at many places: the load of one river does not fill it
        let is_lake = |cell: usize| self.surface[cell] > self.sea_level_m;
        let is_full = |cell: usize| {
            depth(cell).is_some_and(|depth| is_lake(cell) && arriving[cell][0] >= arriving[cell][1] + depth)
        };
        let mut fills: Vec<bool> = par::map(heights.len(), is_full);
        self.drainage.upstream(job, self.grid, self.codes, &mut fills, |cell, _, own, below| {
            if depth(cell).is_some() && self.onwards(cell, heights).is_some() { below } else { own }
        })?;
        // may be below 0 where the law's tangent is: rivers of little slope that take up what they carry later
        let entering = |cell: usize| {
            if depth(cell).is_none() || fills[cell] {
                return f64::NAN;
            }
            let joined = donors::of(self.grid, self.codes, cell as u32).map(|(_, from)| from as usize);
            let joined = joined.filter(|&from| depth(from).is_some() && self.is_joined(from, cell, heights));
            let joined = joined.map(|from| arriving[from][0]);
            arriving[cell][0] - joined.sum::<f64>()
        };
        let mut loads: Vec<f64> = par::map(heights.len(), entering);
        let settles = |cell: usize| depth(cell).is_some() && !fills[cell];
        par::change_at(arriving, |cell, arriving| {
            if settles(cell) {
                *arriving = [0.0; 2];
            }
        });
        if !par::any(&loads, |load| load.abs() > 0.0) {
            return Ok(fills);
        }
        let square = SPREADS_M * SPREADS_M / f64::from(SWEEPS);
        let plume = Hillslope::new(&closed(job.window()), Lane::Constant(square as f32), 0.0);
        for round in 0..ROUNDS {
            plume.creep(job, &mut loads, 1.0, round..round + SWEEPS, &|_| false, None)?;
            let nx = self.grid.nx;
            par::all(loads.chunks_mut(nx).zip(arriving.chunks_mut(nx)), |y, (loads, arriving)| {
                for (cell, (load, arriving)) in (y * nx..).zip(loads.iter_mut().zip(arriving)) {
                    if let Some(depth) = depth(cell).filter(|_| !fills[cell]) {
                        let leaves = !has_receiver(self.codes[cell]);
                        let fits = if leaves { *load } else { load.min(depth - arriving[0]).max(0.0) };
                        arriving[0] += fits;
                        *load -= fits;
                    }
                }
            });
        }
        par::change_at(arriving, |cell, arriving| {
            if settles(cell) {
                arriving[1] = loads[cell];
            }
        });
        Ok(fills)
    }
}

/// The window in a world whose sides let nothing out.
fn closed(window: Window) -> Window {
    let side = |edge: Edge| if edge == Edge::Periodic { edge } else { Edge::Wall };
    let Boundary { west, east, north, south } = window.world.boundary;
    let boundary = Boundary { west: side(west), east: side(east), north: side(north), south: side(south) };
    Window { world: World { boundary, ..window.world }, ..window }
}
