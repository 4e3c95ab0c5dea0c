//! The neighbours that drain into a cell.

use orograph_graph::{Job, NodeError};

use super::{
    Grid,
    code::{LINK, opposite},
};
use crate::numerics::{par, simd::simd};

/// The bit of each direction: as weights they make [`sums`] the set of a cell's donors.
pub const BITS: [u8; 8] = [1, 2, 4, 8, 16, 32, 64, 128];

simd! {
    /// The inner cells of a row; `around` are the codes of the neighbours.
    fn sums_row(around: [&[u8]; 8], weights: [u8; 8], sums: &mut [u8]) {
        let len = sums.len();
        let around = around.map(|row| &row[..len]);
        for x in 0..len {
            let mut sum = 0;
            for (direction, neighbours) in around.iter().enumerate() {
                sum += if neighbours[x] & LINK == opposite(direction) as u8 { weights[direction] } else { 0 };
            }
            sums[x] = sum;
        }
    }
}

/// The direction and the cell of each neighbour that drains into a cell.
pub fn of(grid: &Grid, codes: &[u8], cell: u32) -> impl Iterator<Item = (usize, u32)> {
    let beside = move |direction| Some((direction, grid.beside(cell, codes[cell as usize], direction)?));
    let comes = |&(direction, donor): &(usize, u32)| codes[donor as usize] & LINK == opposite(direction) as u8;
    (0..8).filter_map(beside).filter(comes)
}

/// Sums the `weights` of the directions of a cell's donors: with 1 each, the number of donors.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn sums(job: &Job<'_>, grid: &Grid, codes: &[u8], weights: [u8; 8], sums: &mut [u8]) -> Result<(), NodeError> {
    let nx = grid.nx;
    par::each(sums.chunks_mut(nx), |y, sums| {
        job.check()?;
        let sum = |x: usize| -> u8 { of(grid, codes, (y * nx + x) as u32).map(|(way, _)| weights[way]).sum() };
        if grid.is_border_row(y) || nx < 3 {
            (0..nx).for_each(|x| sums[x] = sum(x));
            return Ok(());
        }
        let row = |y: usize, x: usize| &codes[y * nx + x..y * nx + x + nx - 2];
        let around = [
            row(y, 2),
            row(y - 1, 2),
            row(y - 1, 1),
            row(y - 1, 0),
            row(y, 0),
            row(y + 1, 0),
            row(y + 1, 1),
            row(y + 1, 2),
        ];
        sums_row(around, weights, &mut sums[1..nx - 1]);
        sums[0] = sum(0);
        sums[nx - 1] = sum(nx - 1);
        Ok(())
    })
}
