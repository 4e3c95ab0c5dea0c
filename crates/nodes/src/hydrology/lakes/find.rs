//! Lakes of a filled surface, with their outlets.

use orograph_graph::{Job, NodeError};

use crate::numerics::{
    components::components,
    par,
    routing::{Depressions, Grid},
};

/// A lake.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Lake {
    /// The cell over which it spills: land at the level of the water, beside it.
    pub sill: u32,
    pub level_m: f32,
    /// Largest depth.
    pub depth_m: f32,
    pub cells: u32,
    /// Sum of the depths of its cells.
    pub depths_m: f64,
}

/// The lakes of a world.
pub(super) struct Lakes {
    /// Number of the lake at each cell, from 1; 0 on land.
    pub of: Vec<u32>,
    /// The lakes in the order of their numbers.
    pub all: Vec<Lake>,
    /// Number of hollows that are too small or too shallow.
    pub dropped: u32,
}

impl Lakes {
    /// Finds the lakes between `land` and the filled surface `level`. Adjacent wet cells, diagonals included, belong to
    /// one lake: they always have the same level. Lakes of fewer cells or less depth than `least` are dropped, and
    /// `level` is lowered to the land there.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`], or not enough memory.
    pub fn find(
        job: &Job<'_>,
        grid: &Grid,
        land: &[f32],
        level: &mut [f32],
        depressions: &Depressions<f32>,
        [least_cells, least_m]: [f64; 2],
    ) -> Result<Self, NodeError> {
        let found = components(job, true, |cell| level[cell] > land[cell])?;
        let (mut of, mut all) = (found.of, vec![Lake::default(); found.cells.len()]);
        for (row, numbers) in of.chunks(grid.nx).enumerate() {
            job.check()?;
            for (column, &number) in numbers.iter().enumerate() {
                if number > 0 {
                    let (cell, lake) = (row * grid.nx + column, &mut all[number as usize - 1]);
                    let depth_m = level[cell] - land[cell];
                    lake.level_m = level[cell];
                    lake.depth_m = lake.depth_m.max(depth_m);
                    lake.cells += 1;
                    lake.depths_m += f64::from(depth_m);
                }
            }
        }
        for (pit, exit) in depressions.basins(grid) {
            let number = of[pit as usize];
            // one basin of each lake has an exit that leads out of its water
            if number > 0 && exit.far.is_none_or(|far| of[far as usize] != number) {
                let lake = &mut all[number as usize - 1];
                let near_is_sill = land[exit.near as usize] >= lake.level_m;
                lake.sill = exit.far.filter(|_| !near_is_sill).unwrap_or(exit.near);
            }
        }
        let stays = |lake: &Lake| f64::from(lake.cells) >= least_cells && f64::from(lake.depth_m) >= least_m;
        let mut numbers = vec![0];
        let mut count = 0;
        for lake in &all {
            count += u32::from(stays(lake));
            numbers.push(if stays(lake) { count } else { 0 });
        }
        let dropped = all.len() as u32 - count;
        if dropped > 0 {
            par::all(level.chunks_mut(grid.nx).zip(of.chunks_mut(grid.nx)).zip(land.chunks(grid.nx)), |_, row| {
                let ((level, of), land) = row;
                for ((level, of), land) in level.iter_mut().zip(of).zip(land) {
                    *of = numbers[*of as usize];
                    if *of == 0 {
                        *level = *land;
                    }
                }
            });
            all.retain(stays);
        }
        Ok(Self { of, all, dropped })
    }

    /// Returns the lake at a cell. Returns None on land.
    pub fn at(&self, cell: usize) -> Option<&Lake> {
        self.all.get((self.of[cell] as usize).checked_sub(1)?)
    }
}
