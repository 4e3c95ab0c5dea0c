//! Slopes that give way where a river undercuts land that drains elsewhere.
//!
//! A cell gives way to the height h at which the upwind gradient of its lower neighbours a (west or east) and b (north
//! or south) is the steepest that stands: max(h − a, 0)² + max(h − b, 0)² = (S d)², the first-order scheme of the
//! eikonal equation |∇h| = S (Rouy and Tourin 1992). It is the same in every direction. One sweep with rows and columns
//! rising and one with both falling carry a slide across a strip of rows; strips are independent of each other, and
//! what is left for the next strip moves at the next step.
//!
//! On rough ground, the slope is that of h minus the height that knolls and hollows have in balance, so that the limit
//! does not depend on the direction of flow. With a limit by the direction of flow, cells that drain along a row
//! or a column stood as walls beside others. A cell does not give way to less than a fraction of the slope.

use std::ops::Range;

use orograph_graph::{Job, NodeError};

use crate::numerics::{
    par,
    routing::{Grid, Outlet},
};

/// Rows of a strip. Part of the definition of the result.
const STRIP_ROWS: usize = 64;
/// Rows on each side of the seam of two strips that settle once more on rough ground, where the seam would show.
const SEAM_ROWS: usize = 32;

/// The least slope that a cell gives way to, as a fraction of the steepest one. On even ground cells stand at 0.7 of it
/// or more.
const LEAST: f64 = 0.25;

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
    Slides { job, grid, cell_m, steepest, knoll: |_| 0.0 }.within(&strips(grid), heights)
}

/// The same above the height of the `knoll` of each cell in metres.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn settle_on_knolls(
    job: &Job<'_>,
    grid: &Grid,
    heights: &mut [f64],
    cell_m: f64,
    steepest: impl Fn(usize) -> f64 + Sync,
    knoll: impl Fn(usize) -> f64 + Sync,
) -> Result<(), NodeError> {
    let slides = Slides { job, grid, cell_m, steepest, knoll };
    slides.within(&strips(grid), heights)?;
    slides.within(&seams(grid), heights)
}

/// All rows, in strips.
fn strips(grid: &Grid) -> Vec<Range<usize>> {
    (0..grid.ny).step_by(STRIP_ROWS).map(|first| first..(first + STRIP_ROWS).min(grid.ny)).collect()
}

/// The rows around the seams of strips.
fn seams(grid: &Grid) -> Vec<Range<usize>> {
    let inner = (STRIP_ROWS..grid.ny).step_by(STRIP_ROWS);
    let mut seams: Vec<_> = inner.map(|seam| seam - SEAM_ROWS..(seam + SEAM_ROWS).min(grid.ny)).collect();
    let last = seams.last().map_or(0, |seam| seam.end);
    // Across a periodic side, where there is a seam as well.
    if grid.row_above(0).is_some() && grid.ny > 2 * SEAM_ROWS {
        seams.insert(0, 0..SEAM_ROWS);
        seams.extend((last < grid.ny).then(|| (grid.ny - SEAM_ROWS).max(last)..grid.ny));
    }
    seams
}

struct Slides<'a, S, K> {
    job: &'a Job<'a>,
    grid: &'a Grid,
    cell_m: f64,
    steepest: S,
    knoll: K,
}

impl<S: Fn(usize) -> f64 + Sync, K: Fn(usize) -> f64 + Sync> Slides<'_, S, K> {
    /// Settles bands of rows, each with the other bands as they are at the beginning.
    fn within(&self, bands: &[Range<usize>], heights: &mut [f64]) -> Result<(), NodeError> {
        let Self { job, grid, cell_m, steepest, knoll } = self;
        let nx = grid.nx;
        let copy = |y: Option<usize>| match y {
            Some(y) => heights[y * nx..(y + 1) * nx].to_vec(),
            None => vec![f64::INFINITY; nx],
        };
        let around = |band: &Range<usize>| [copy(grid.row_above(band.start)), copy(grid.row_below(band.end - 1))];
        let beside: Vec<[Vec<f64>; 2]> = bands.iter().map(around).collect();
        let (mut rest, mut done) = (heights, 0);
        let mut parts = Vec::with_capacity(bands.len());
        for (band, beside) in bands.iter().zip(&beside) {
            let (part, after) = std::mem::take(&mut rest)[(band.start - done) * nx..].split_at_mut(band.len() * nx);
            parts.push((band.start, part, beside));
            (rest, done) = (after, band.end);
        }
        par::each(parts, |_, (first, heights, beside)| {
            let rows = heights.len() / nx;
            for falling in [false, true] {
                for row in 0..rows {
                    job.check()?;
                    let row = if falling { rows - 1 - row } else { row };
                    let y = first + row;
                    let (before, rest) = heights.split_at_mut(row * nx);
                    let (here, after) = rest.split_at_mut(nx);
                    let above = if row == 0 { &beside[0][..] } else { &before[(row - 1) * nx..] };
                    let below = if row + 1 == rows { &beside[1][..] } else { &after[..nx] };
                    let (row_above, row_below) = (grid.row_above(y), grid.row_below(y));
                    let mut relax = |x: usize| {
                        let border = grid.is_border_row(y) || x == 0 || x + 1 == nx;
                        if border && grid.outlet(x, y) == Outlet::Base {
                            return;
                        }
                        let cell = y * nx + x;
                        let over = |height: f64, y: Option<usize>, x: Option<usize>| match (y, x) {
                            (Some(y), Some(x)) => height - knoll(y * nx + x),
                            _ => f64::INFINITY,
                        };
                        let side = |x: Option<usize>| over(x.map_or(f64::INFINITY, |x| here[x]), Some(y), x);
                        let (west, east) = (side(grid.column_before(x)), side(grid.column_after(x)));
                        let (north, south) = (over(above[x], row_above, Some(x)), over(below[x], row_below, Some(x)));
                        let a = if west < east { west } else { east };
                        let b = if north < south { north } else { south };
                        let own = knoll(cell);
                        let height = here[x] - own;
                        let (over_a, over_b) = ((height - a).max(0.0), (height - b).max(0.0));
                        let limit_m = steepest(cell) * *cell_m;
                        if over_a * over_a + over_b * over_b > limit_m * limit_m {
                            let difference = (a - b).abs();
                            let stands = if difference < limit_m {
                                0.5 * (a + b + (2.0 * limit_m * limit_m - difference * difference).sqrt())
                            } else {
                                a.min(b) + limit_m
                            };
                            let beside = |x: Option<usize>| x.map_or(f64::INFINITY, |x| here[x]);
                            let lowest = beside(grid.column_before(x)).min(beside(grid.column_after(x)));
                            let lowest = lowest.min(above[x]).min(below[x]);
                            here[x] = here[x].min((stands + own).max(lowest + LEAST * limit_m));
                        }
                    };
                    if falling { (0..nx).rev().for_each(&mut relax) } else { (0..nx).for_each(&mut relax) }
                }
            }
            Ok(())
        })
    }
}
