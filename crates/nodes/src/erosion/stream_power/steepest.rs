//! The steepest slope at which terrain stands.
//!
//! It is `repose`, which may differ from place to place, times a factor g (1 − 2 W) + 1 for gullies: pore water
//! carries part of the weight of saturated ground, so that ground fails at a smaller slope where water gathers, tan φ
//! (1 − w W) with the saturated share W of the soil (Montgomery and Dietrich 1994). Hollows of steep slopes then
//! stand less steep than the spurs between them, drain more for it, and become gullies. W = A / (A + Aₛ) is smooth
//! here, and Aₛ is a share of A₀ that varies as A₀ᵐ does.
//!
//! Gullies prefer no direction of the grid: A is blurred over the neighbouring cells, and counts times the length of the
//! link to the receiver in cells, for along a diagonal there are fewer cells to drain through a cell, and fewer cells of
//! a gully.

use orograph_graph::{Job, NodeError, memory::zeroed};

use super::area::Area;
use crate::numerics::{par, routing::Grid};

/// The area at which half of the ground is saturated, as a share of A₀.
const SATURATED: f64 = 0.02;
/// More water than so many times what soaks half of the ground makes no wider hollow.
const MOST: f32 = 8.0;
/// Rows of a strip.
const STRIP_ROWS: usize = 64;
/// The weights of neighbours along a row and a column.
const WEIGHTS: [f32; 5] = [1.0 / 16.0, 4.0 / 16.0, 6.0 / 16.0, 4.0 / 16.0, 1.0 / 16.0];
/// Neighbours to either side.
const REACH: usize = WEIGHTS.len() / 2;

/// The steepest drop over a distance of 1.
pub struct Steepest {
    repose: Repose,
    /// The share g by which spurs stand steeper and saturated hollows less steep.
    gullies: f64,
    /// The factor of each cell; empty where there are no gullies.
    factors: Vec<f32>,
}

/// What stands where nothing is wetter than elsewhere.
pub enum Repose {
    Everywhere(f64),
    Each(Vec<f32>),
}

impl Steepest {
    /// Slopes without gullies until [`Self::soak`].
    #[must_use]
    pub const fn new(repose: Repose, gullies: f64) -> Self {
        Self { repose, gullies, factors: Vec::new() }
    }

    /// Returns true if slopes are limited anywhere.
    #[must_use]
    pub const fn is_limited(&self) -> bool {
        !matches!(self.repose, Repose::Everywhere(f64::INFINITY))
    }

    /// `repose` where each cell has its own.
    pub const fn each(&mut self) -> Option<&mut Vec<f32>> {
        match &mut self.repose {
            Repose::Each(slopes) => Some(slopes),
            Repose::Everywhere(_) => None,
        }
    }

    /// The steepest drop of a cell.
    #[must_use]
    #[inline(always)]
    pub fn at(&self, cell: usize) -> f64 {
        let slope = match &self.repose {
            Repose::Everywhere(slope) => *slope,
            Repose::Each(slopes) => f64::from(slopes[cell]),
        };
        self.factors.get(cell).map_or(slope, |factor| slope * f64::from(*factor))
    }

    /// The steepest drops over `length_m` of cells in a row, from the first on.
    pub fn drops(&self, first: usize, length_m: f64, drops_m: &mut [f64]) {
        let cells = first..first + drops_m.len();
        match &self.repose {
            Repose::Everywhere(slope) => drops_m.fill(slope * length_m),
            Repose::Each(slopes) => {
                let slopes = &slopes[cells.clone()];
                drops_m.iter_mut().zip(slopes).for_each(|(drop_m, slope)| *drop_m = f64::from(*slope) * length_m);
            }
        }
        if let Some(factors) = self.factors.get(cells) {
            drops_m.iter_mut().zip(factors).for_each(|(drop_m, factor)| *drop_m *= f64::from(*factor));
        }
    }

    /// The mean of `repose` in all cells where slopes are limited; 0 if they are nowhere.
    #[must_use]
    pub fn mean(&self) -> f64 {
        match &self.repose {
            Repose::Everywhere(slope) => *slope,
            Repose::Each(slopes) => {
                let finite = slopes.iter().map(|slope| f64::from(*slope)).filter(|slope| slope.is_finite());
                let (sum, count) = finite.fold((0.0, 0_u32), |(sum, count), slope| (sum + slope, count + 1));
                if count > 0 { sum / f64::from(count) } else { 0.0 }
            }
        }
    }

    /// Makes slopes less steep where the water of the last routing gathers.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn soak(&mut self, job: &Job<'_>, grid: &Grid, codes: &[u8], area: &Area<'_>) -> Result<(), NodeError> {
        let saturated_m2 = SATURATED * area.headwater_m2();
        if self.gullies <= 0.0 || saturated_m2 <= 0.0 || !self.is_limited() {
            return Ok(());
        }
        if self.factors.is_empty() {
            self.factors = zeroed(grid.nx * grid.ny)?;
        }
        let (nx, gullies, saturated) = (grid.nx, self.gullies as f32, area.saturated(saturated_m2));
        let strips = self.factors.chunks_mut(STRIP_ROWS * nx);
        let room = || (vec![0.0; nx + 2 * REACH], vec![0.0; WEIGHTS.len() * nx]);
        par::each_with(strips, room, |(padded, blurred), strip, factors| {
            job.check()?;
            let first = strip * STRIP_ROWS;
            let rows = factors.len() / nx;
            // row k of the strip and of its neighbours lies in place k modulo the number of weights
            for k in 0..rows + 2 * REACH {
                let y = row_beside(grid, first, k as isize - REACH as isize);
                area.wetness(saturated_m2, MOST, codes, y * nx..(y + 1) * nx, &mut padded[REACH..REACH + nx]);
                continue_sides(grid, padded);
                let place = k % WEIGHTS.len();
                blur(padded, &mut blurred[place * nx..(place + 1) * nx]);
                let Some(row) = k.checked_sub(2 * REACH) else { continue };
                let row_of = |at: usize| {
                    let place = (row + at) % WEIGHTS.len();
                    &blurred[place * nx..(place + 1) * nx]
                };
                let factors = &mut factors[row * nx..(row + 1) * nx];
                let [a, b, c, d, e] = [0, 1, 2, 3, 4].map(row_of);
                for x in 0..nx {
                    let near = WEIGHTS[1] * (b[x] + d[x]);
                    let wetness = WEIGHTS[0] * (a[x] + e[x]) + near + WEIGHTS[2] * c[x];
                    factors[x] = 1.0 + gullies * (1.0 - 2.0 * saturated(wetness));
                }
            }
            Ok(())
        })
    }
}

/// The row so many rows south of another one; at a side that is not periodic, the last one.
fn row_beside(grid: &Grid, row: usize, south: isize) -> usize {
    let ny = grid.ny as isize;
    let y = row as isize + south;
    let y = if grid.row_above(0).is_some() { y.rem_euclid(ny) } else { y.clamp(0, ny - 1) };
    y as usize
}

/// Continues a row beyond its ends.
fn continue_sides(grid: &Grid, padded: &mut [f32]) {
    let nx = grid.nx;
    for beyond in 0..REACH {
        let [west, east] = if grid.column_before(0).is_some() {
            [(nx * REACH + beyond - REACH) % nx, beyond % nx]
        } else {
            [0, nx - 1]
        };
        padded[beyond] = padded[REACH + west];
        padded[REACH + nx + beyond] = padded[REACH + east];
    }
}

/// Blurs a row that is continued to both sides.
fn blur(padded: &[f32], out: &mut [f32]) {
    let n = out.len();
    let from = |at: usize| &padded[at..at + n];
    let [a, b, c, d, e] = [0, 1, 2, 3, 4].map(from);
    for x in 0..n {
        out[x] = WEIGHTS[0] * (a[x] + e[x]) + WEIGHTS[1] * (b[x] + d[x]) + WEIGHTS[2] * c[x];
    }
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Boundary, Edge, Window, World, mix};

    use super::*;
    use crate::{
        erosion::stream_power::{
            area::{Heads, Scheme},
            incision::Law,
        },
        prelude::*,
        testing,
    };

    const SIDE: usize = 150;
    const OPEN: Boundary = Boundary::all(Edge::Open);
    const ROUND: Boundary = Boundary { west: Edge::Periodic, east: Edge::Periodic, ..OPEN };
    const ROUND_SOUTH: Boundary = Boundary { north: Edge::Periodic, south: Edge::Periodic, ..OPEN };

    /// The steepest drops where so many cells of 10 m drain through each cell, with A₀ = 10⁴ m² and g = 0.4.
    fn saturated(boundary: Boundary, drained: impl Fn(usize, usize) -> u32) -> Vec<f64> {
        let world = World { boundary, ..testing::world(SIDE as u32, SIDE as u32, 10.0) };
        let cells = (0..SIDE * SIDE).map(|cell| drained(cell % SIDE, cell / SIDE)).collect();
        let heads = Heads { critical_m2: 0.0, headwater_m2: 1e4, m: 0.5 };
        let area = Area::new(&Law::new(1.0), SIDE * SIDE, Lane::Constant(1.0), 100.0, heads, Scheme::SingleGrid);
        let mut steepest = Steepest::new(Repose::Everywhere(2.0), 0.4);
        testing::with_job(Window::whole(world), |job| {
            let grid = Grid::new(&job.window()).expect("a grid");
            steepest.soak(job, &grid, &[0; SIDE * SIDE], &area.with_drained(cells)).expect("not cancelled");
        });
        let mut drops = vec![0.0; SIDE];
        (0..SIDE)
            .flat_map(|y| {
                steepest.drops(y * SIDE, 1.0, &mut drops);
                assert!((0..SIDE).all(|x| drops[x] == steepest.at(y * SIDE + x)));
                drops.clone()
            })
            .collect()
    }

    /// Where the same drains everywhere, slopes stand alike up to the sides.
    #[test]
    fn dry_ground_stands_steeper_and_saturated_ground_less_steep() {
        // 2 (1 + 0.4 (1 − 2 W)) with A / (A + 200 m²) = 1/3, 1/2, 5/6; 1e-6: in single precision
        for (drained, expected) in [(1, 2.0 + 0.8 / 3.0), (2, 2.0), (10, 2.0 - 1.6 / 3.0)] {
            for boundary in [OPEN, ROUND, ROUND_SOUTH] {
                let found = saturated(boundary, |_, _| drained);
                assert!(found.iter().all(|drop| (drop - expected).abs() < 1e-6), "{drained} {} {expected}", found[0]);
            }
        }
    }

    /// Rows and columns count alike, and so do all cells along periodic sides, across strips.
    #[test]
    fn no_direction_and_no_cell_is_preferred() {
        let drained = |x: usize, y: usize| 1 + mix((x % SIDE + 1000 * (y % SIDE)) as u32) % 50;
        let [found, open] = [ROUND, OPEN].map(|boundary| saturated(boundary, drained));
        let turned = saturated(ROUND_SOUTH, |x, y| drained(y, x));
        let moved = saturated(ROUND, |x, y| drained(x + 77, y));
        let moved_south = saturated(ROUND_SOUTH, |x, y| drained(y + 77, x));
        for (x, y) in (0..SIDE * SIDE).map(|cell| (cell % SIDE, cell / SIDE)) {
            let here = found[y * SIDE + x];
            // 1e-6: sums in another order, in single precision
            assert!((turned[x * SIDE + y] - here).abs() < 1e-6, "{x} {y}");
            let from = (x + SIDE - 77) % SIDE;
            assert_eq!(moved[y * SIDE + from], here, "{x} {y}");
            assert_eq!(moved_south[from * SIDE + y], turned[x * SIDE + y], "{x} {y}");
            let is_inner = (2..SIDE - 2).contains(&x) && (2..SIDE - 2).contains(&y);
            assert!(!is_inner || open[y * SIDE + x] == here, "{x} {y}");
        }
    }

    #[test]
    fn slopes_without_limit_or_gullies_stay() {
        let world = testing::world(4, 4, 10.0);
        let heads = Heads { critical_m2: 0.0, headwater_m2: 1e4, m: 0.5 };
        for (slope, gullies, headwater_m2) in [(f64::INFINITY, 0.4, 1e4), (1.0, 0.0, 1e4), (1.0, 0.4, 0.0)] {
            let heads = Heads { headwater_m2, ..heads };
            let area = Area::new(&Law::new(1.0), 16, Lane::Constant(1.0), 100.0, heads, Scheme::SingleGrid);
            let mut steepest = Steepest::new(Repose::Everywhere(slope), gullies);
            testing::with_job(Window::whole(world), |job| {
                let grid = Grid::new(&job.window()).expect("a grid");
                steepest.soak(job, &grid, &[0; 16], &area.with_drained(vec![9; 16])).expect("not cancelled");
            });
            assert!(steepest.factors.is_empty() && steepest.at(3) == slope);
        }
    }
}
