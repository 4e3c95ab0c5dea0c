//! Slopes that give way where a river undercuts land that drains elsewhere.
//!
//! A cell gives way to the height h at which the upwind gradient of its lower neighbours a (west or east) and b (north
//! or south) is the steepest that stands: max(h − a, 0)² + max(h − b, 0)² = (S d)², the first-order scheme of the
//! eikonal equation |∇h| = S (Rouy and Tourin 1992). It is the same in every direction. One sweep with rows and columns
//! rising and one with both falling carry a slide across a strip of rows; strips are independent of each other, and
//! what is left for the next strip moves at the next step.

use orograph_graph::{Job, NodeError};

use crate::numerics::{
    par,
    routing::{Grid, Outlet},
};

/// Rows of a strip. Part of the definition of the result.
const STRIP_ROWS: usize = 64;

/// Lowers what is steeper than `steepest`, the largest drop per metre at each cell. Cells at base level stay.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn settle(
    job: &Job<'_>,
    grid: &Grid,
    heights: &mut [f64],
    cell_m: f64,
    steepest: impl Fn(usize) -> f64 + Sync,
) -> Result<(), NodeError> {
    let nx = grid.nx;
    let copy = |heights: &[f64], y: Option<usize>| match y {
        Some(y) => heights[y * nx..(y + 1) * nx].to_vec(),
        None => vec![f64::INFINITY; nx],
    };
    let beside: Vec<[Vec<f64>; 2]> = (0..grid.ny)
        .step_by(STRIP_ROWS)
        .map(|first| {
            let last = (first + STRIP_ROWS).min(grid.ny) - 1;
            [copy(heights, grid.row_above(first)), copy(heights, grid.row_below(last))]
        })
        .collect();
    par::each(heights.chunks_mut(STRIP_ROWS * nx).zip(&beside), |strip, (heights, beside)| {
        let rows = heights.len() / nx;
        for falling in [false, true] {
            for row in 0..rows {
                job.check()?;
                let row = if falling { rows - 1 - row } else { row };
                let y = strip * STRIP_ROWS + row;
                let (before, rest) = heights.split_at_mut(row * nx);
                let (here, after) = rest.split_at_mut(nx);
                let above = if row == 0 { &beside[0][..] } else { &before[(row - 1) * nx..] };
                let below = if row + 1 == rows { &beside[1][..] } else { &after[..nx] };
                let mut relax = |x: usize| {
                    let border = grid.is_border_row(y) || x == 0 || x + 1 == nx;
                    if border && grid.outlet(x, y) == Outlet::Base {
                        return;
                    }
                    let side = |x: Option<usize>| x.map_or(f64::INFINITY, |x| here[x]);
                    let (west, east) = (side(grid.column_before(x)), side(grid.column_after(x)));
                    let a = if west < east { west } else { east };
                    let b = if above[x] < below[x] { above[x] } else { below[x] };
                    let height = here[x];
                    let (over_a, over_b) = ((height - a).max(0.0), (height - b).max(0.0));
                    let limit_m = steepest(y * nx + x) * cell_m;
                    if over_a * over_a + over_b * over_b > limit_m * limit_m {
                        let difference = (a - b).abs();
                        let stands = if difference < limit_m {
                            0.5 * (a + b + (2.0 * limit_m * limit_m - difference * difference).sqrt())
                        } else {
                            a.min(b) + limit_m
                        };
                        here[x] = height.min(stands);
                    }
                };
                if falling { (0..nx).rev().for_each(&mut relax) } else { (0..nx).for_each(&mut relax) }
            }
        }
        Ok(())
    })
}
