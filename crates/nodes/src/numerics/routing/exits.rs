//! Exits of basins, and the order of the tree of basins.

use super::{Depressions, Elevation, Grid, basins::OUTSIDE};

/// The link through which a basin drains.
#[derive(Clone, Copy, Debug)]
pub struct Exit {
    /// The last cell inside the basin.
    pub near: u32,
    /// The direction from there; None if it leads out of the world.
    pub to: Option<usize>,
    /// The first cell beyond; None if it leads out of the world.
    pub far: Option<u32>,
}

impl<T: Elevation> Depressions<T> {
    /// Returns the bottom and the exit of each basin, without the outside.
    pub fn basins(&self, grid: &Grid) -> impl Iterator<Item = (u32, Exit)> {
        self.pits.iter().copied().zip(self.exits(grid))
    }

    /// Returns the exit of each basin, without the outside.
    pub(super) fn exits(&self, grid: &Grid) -> Vec<Exit> {
        let exit = |(basin, link)| {
            // a link of the spanning tree joins two cells of the raster
            let (near, to) = self.pass(grid, basin, link).unwrap_or((link >> 3, None));
            Exit { near, to, far: to.and_then(|to| grid.neighbour(near, to)) }
        };
        self.spills.iter().enumerate().skip(1).map(|(basin, spill)| exit((basin, spill.link))).collect()
    }

    /// Returns the basin that an exit leads to, which may be [`OUTSIDE`].
    pub(super) fn beyond(&self, exit: &Exit) -> u32 {
        exit.far.map_or(OUTSIDE, |far| self.labels[far as usize])
    }

    /// Returns all basins except the outside, each after the one that its exit leads to.
    pub(super) fn outside_in(&self, exits: &[Exit]) -> Vec<u32> {
        let mut order = Vec::with_capacity(exits.len());
        let mut listed = vec![false; exits.len() + 1];
        listed[OUTSIDE as usize] = true;
        let mut way = Vec::new();
        for basin in 1..=exits.len() as u32 {
            let mut at = basin;
            while !listed[at as usize] {
                listed[at as usize] = true;
                way.push(at);
                at = self.beyond(&exits[at as usize - 1]);
            }
            order.extend(way.drain(..).rev());
        }
        order
    }
}
