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

use super::steepest::Steepest;
use crate::numerics::{
    par,
    routing::{Grid, Outlet},
    simd::simd,
};

/// Rows of a strip. Part of the definition of the result.
const STRIP_ROWS: usize = 64;
/// Rows on each side of the seam of two strips that settle once more on rough ground, where the seam would show.
const SEAM_ROWS: usize = 32;

/// Cells of a row that are looked at together.
const GROUP: usize = 8;

/// The least slope that a cell gives way to, as a fraction of the steepest one. On even ground cells stand at 0.7 of it
/// or more.
const LEAST: f64 = 0.25;

/// The height that knolls and hollows have in balance: `slope` times the ground of each cell in metres.
#[derive(Clone, Copy)]
pub struct KnollHeights<'a> {
    pub slope: f64,
    /// Empty on even ground.
    pub ground: &'a [f32],
}

impl KnollHeights<'_> {
    #[inline(always)]
    fn at(&self, cell: usize) -> f64 {
        self.ground.get(cell).map_or(0.0, |ground| self.slope * f64::from(*ground))
    }
}

/// Lowers what is steeper above the knolls than `steepest` allows. Cells at base level stay.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn settle(
    job: &Job<'_>,
    grid: &Grid,
    heights: &mut [f64],
    cell_m: f64,
    steepest: &Steepest,
    knolls: KnollHeights<'_>,
) -> Result<(), NodeError> {
    let slides = Slides { job, grid, cell_m, steepest, knolls };
    slides.within(&strips(grid), heights)?;
    if knolls.ground.is_empty() {
        return Ok(());
    }
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

struct Slides<'a> {
    job: &'a Job<'a>,
    grid: &'a Grid,
    cell_m: f64,
    steepest: &'a Steepest,
    knolls: KnollHeights<'a>,
}

impl Slides<'_> {
    /// Settles bands of rows, each with the other bands as they are at the beginning.
    fn within(&self, bands: &[Range<usize>], heights: &mut [f64]) -> Result<(), NodeError> {
        let Self { job, grid, cell_m, steepest, knolls } = self;
        let nx = grid.nx;
        let even = vec![0.0; nx];
        // even where there is no row
        let ground = |y: Option<usize>| match y {
            Some(y) if !knolls.ground.is_empty() => &knolls.ground[y * nx..(y + 1) * nx],
            _ => &even[..],
        };
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
        let room = || (vec![0.0; nx], vec![0_u8; nx]);
        par::each_with(parts, room, |(limits_m, steep), _, (first, heights, beside)| {
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
                    steepest.drops(y * nx, *cell_m, limits_m);
                    let ground =
                        GroundRows { above: ground(row_above), here: ground(Some(y)), below: ground(row_below) };
                    mark_steep([above, here, below], ground, knolls.slope, limits_m, steep);
                    // Returns true if the cell gave way.
                    let mut relax = |x: usize| {
                        let border = grid.is_border_row(y) || x == 0 || x + 1 == nx;
                        if border && grid.outlet(x, y) == Outlet::Base {
                            return false;
                        }
                        let cell = y * nx + x;
                        let over = |height: f64, y: Option<usize>, x: Option<usize>| match (y, x) {
                            (Some(y), Some(x)) => height - knolls.at(y * nx + x),
                            _ => f64::INFINITY,
                        };
                        let side = |x: Option<usize>| over(x.map_or(f64::INFINITY, |x| here[x]), Some(y), x);
                        let (west, east) = (side(grid.column_before(x)), side(grid.column_after(x)));
                        let (north, south) = (over(above[x], row_above, Some(x)), over(below[x], row_below, Some(x)));
                        let (a, b) = (lower(west, east), lower(north, south));
                        let own = knolls.at(cell);
                        let limit_m = limits_m[x];
                        let gives_way = is_steep(here[x] - own, a, b, limit_m);
                        if gives_way {
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
                        gives_way
                    };
                    // Cells that stood when the row began give way only beside one that has.
                    let mut gave_way = false;
                    for group in 0..nx.div_ceil(GROUP) {
                        let group = if falling { nx.div_ceil(GROUP) - 1 - group } else { group };
                        let cells = group * GROUP..((group + 1) * GROUP).min(nx);
                        if !gave_way && steep[cells.clone()].iter().fold(0, |any, steep| any | steep) == 0 {
                            continue;
                        }
                        for x in cells.clone() {
                            let x = if falling { cells.start + cells.end - 1 - x } else { x };
                            gave_way = (steep[x] != 0 || gave_way) && relax(x);
                        }
                    }
                }
            }
            Ok(())
        })
    }
}

#[inline(always)]
fn lower(one: f64, other: f64) -> f64 {
    if one < other { one } else { other }
}

/// Whether a cell gives way, above its lower neighbours along a row, `a`, and along a column, `b`.
#[inline(always)]
fn is_steep(height: f64, a: f64, b: f64, limit_m: f64) -> bool {
    let (over_a, over_b) = ((height - a).max(0.0), (height - b).max(0.0));
    over_a * over_a + over_b * over_b > limit_m * limit_m
}

/// The ground of a row and of its neighbours.
struct GroundRows<'a> {
    above: &'a [f32],
    here: &'a [f32],
    below: &'a [f32],
}

simd! {
    /// Marks the cells of a row that are steeper than the limit, and those at its ends, beside which a row may go on.
    fn mark_steep(
        heights: [&[f64]; 3],
        ground: GroundRows<'_>,
        slope: f64,
        limits_m: &[f64],
        steep: &mut [u8],
    ) {
        let n = steep.len();
        let [above, here, below] = heights;
        let (above, here, below, limits_m) = (&above[..n], &here[..n], &below[..n], &limits_m[..n]);
        let (ground_above, ground, ground_below) = (&ground.above[..n], &ground.here[..n], &ground.below[..n]);
        steep[0] = 1;
        steep[n - 1] = 1;
        for x in 1..n.max(1) - 1 {
            let west = here[x - 1] - slope * f64::from(ground[x - 1]);
            let east = here[x + 1] - slope * f64::from(ground[x + 1]);
            let north = above[x] - slope * f64::from(ground_above[x]);
            let south = below[x] - slope * f64::from(ground_below[x]);
            let own = here[x] - slope * f64::from(ground[x]);
            steep[x] = u8::from(is_steep(own, lower(west, east), lower(north, south), limits_m[x]));
        }
    }
}
