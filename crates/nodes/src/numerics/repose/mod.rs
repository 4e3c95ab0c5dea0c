//! Relaxes a surface until no slope exceeds its angle of repose.
//!
//! The state is the gain `d` of each cell, in addition to heights `h` that stay unchanged. Ground on which nothing
//! moves therefore keeps its bits, and small gains are not lost on high mountains. A sweep moves material at corners
//! and over faces. Across every corner it moves `(1 - r/|g|)₊ g`, where `g` is the gradient, in metres per cell, of the
//! plane through the four cells and `r` the mean of their rises at repose. Over every face between two neighbours it
//! moves half of the excess of their rise over both `r` and the rise measured at the corners beside the face. Corners
//! measure slopes isotropically, so that cones are round; faces damp patterns that corners cannot see, such as a
//! chequerboard. Both cells of a flow compute the same amount, so a sweep conserves material to rounding.
//!
//! Where only a layer on top is loose, every flow has a donor, and a sweep takes at most a fraction of the donor's
//! layer, less across the slope than along it. This limit needs no sum over the donor's other flows, so a flow depends
//! only on the adjacent cells, and thin films run straight down a wall. Such flows are multiples of a small quantum, so
//! that layers add up without rounding.
//!
//! A sweep carries material by one cell, and a scarp n cells wide needs on the order of n² sweeps. Sweeps therefore
//! start on a coarse grid, whose gains are interpolated to the next finer one, down to the full resolution. A closed
//! cell has an infinite `r`: the border of a walled world, masked ground, voids. A coarse cell is closed if any of its
//! cells is.

mod cap;
pub(crate) mod device;
mod pace;
mod pyramid;
#[cfg(test)]
mod reference;
mod sweep;
#[cfg(test)]
mod tests;

use orograph_graph::{
    Edge, Job, NodeError,
    memory::{OutOfMemory, filled, with_capacity, zeroed},
};

pub use cap::capped;
pub use pace::{beside, relaxed};
use pyramid::{prolong, restrict};
use sweep::{Ground, Sweep, TILE, WIDE};

use super::{math, par};
use crate::prelude::Lane;

/// Fraction of the excess that a sweep moves: the largest eigenvalue of the corner and face operators is 4, so no sweep
/// overshoots.
const STEP: f32 = 0.25;

/// The quantum of flows, as a fraction of the smallest rise at repose. Single precision represents 2^24 multiples of
/// it.
const QUANTUM: f32 = 1.0 / 65_536.0;

/// The coarsest grid has at least this many cells on its shorter side.
const COARSEST: usize = 64;

/// Maximum number of sweeps over a grid before the next finer one, for a surface that is to come to rest.
pub const SWEEPS: usize = 2000;

/// Maximum number of cycles through the pyramid.
const CYCLES: usize = 8;

/// One grid of the pyramid. Rasters have a halo of one cell, closed or wrapped, and end with room for a tile's row.
struct Level {
    nx: usize,
    ny: usize,
    wraps: [bool; 2],
    height: Vec<f32>,
    /// Rise at repose between neighbours, in metres; infinite where closed.
    rise: Vec<f32>,
    /// Initial thickness of the loose layer; empty if everything is loose.
    loose: Vec<f32>,
    moved: Vec<f32>,
    next: Vec<f32>,
    /// Flows of a loose layer are multiples of this, in metres.
    quantum: f32,
    /// True for tiles that the last sweep changed.
    changed: Vec<bool>,
    /// The rise at repose of tiles in which it is the same everywhere.
    even: Vec<Option<f32>>,
}

/// A surface that may slide. Rasters are row-major, without a halo.
#[derive(Clone, Copy)]
pub struct Land<'a> {
    /// Columns and rows.
    pub cells: [usize; 2],
    /// True if opposite sides are joined, along x and y.
    pub wraps: [bool; 2],
    /// Elevation in metres; ignored in closed cells.
    pub height: &'a [f32],
    /// Rise at repose between neighbours, in metres; infinite in closed cells.
    pub rise: &'a [f32],
    /// Thickness of the loose layer in metres, 0 or more; if None, everything is loose.
    pub loose: Option<&'a [f32]>,
}

/// A surface that slides where it is steeper than repose.
pub struct Slump {
    levels: Vec<Level>,
    cells: [usize; 2],
    tolerance: f32,
}

impl Slump {
    /// Creates the pyramid of a surface. `tolerance` is the excess over repose that is ignored, as a fraction of
    /// repose.
    ///
    /// # Errors
    /// [`OutOfMemory`].
    pub fn new(land: &Land<'_>, tolerance: f32) -> Result<Self, OutOfMemory> {
        let Land { cells, wraps, .. } = *land;
        let coarser = coarser(cells, wraps);
        // closed cells extend the sides to a multiple of the coarsest cells
        let [nx, ny] = cells.map(|n| n.next_multiple_of(1 << coarser));
        let mut levels = vec![Level::new([nx, ny], wraps, land.loose.is_some())?];
        for level in 0..coarser {
            let finer = &levels[level];
            levels.push(Level::new([finer.nx / 2, finer.ny / 2], wraps, land.loose.is_some())?);
        }
        let finest = &mut levels[0];
        for (j, row) in land.rise.chunks_exact(cells[0]).enumerate() {
            let to = finest.at(0, j);
            finest.rise[to..][..cells[0]].copy_from_slice(row);
        }
        finest.quantum = quantum(least(land.rise));
        wrap(&mut finest.rise, nx, ny, wraps);
        for level in 0..coarser {
            let (fine, coarse) = levels.split_at_mut(level + 1);
            coarse[0].coarsen_rise(&fine[level]);
        }
        levels.iter_mut().for_each(Level::find_even_tiles);
        let mut slump = Self { levels, cells, tolerance };
        slump.load(land.height, land.loose);
        Ok(slump)
    }

    /// Starts again on the same cells with other heights and another loose layer.
    pub fn load(&mut self, height: &[f32], loose: Option<&[f32]>) {
        let columns = self.cells[0];
        let finest = &mut self.levels[0];
        finest.moved.fill(0.0);
        let stride = finest.nx + 2;
        let rises = finest.rise[stride..].chunks_exact(stride);
        let copy = |from: &[f32], to: &mut [f32]| {
            let rows = from.chunks_exact(columns).zip(to[stride..].chunks_exact_mut(stride)).zip(rises.clone());
            par::all(rows, |_, ((from, to), rise)| {
                for i in 0..columns {
                    to[i + 1] = if rise[i + 1] < f32::INFINITY { from[i] } else { 0.0 };
                }
            });
        };
        copy(height, &mut finest.height);
        if let Some(loose) = loose {
            copy(loose, &mut finest.loose);
        }
        finest.wrap_ground();
        for level in 1..self.levels.len() {
            let (fine, coarse) = self.levels.split_at_mut(level);
            coarse[0].coarsen_ground(&fine[level - 1]);
        }
    }

    /// Sweeps, coarse grids first, until no slope exceeds repose. Returns true if that state was reached. `sweeps` is
    /// the maximum over one grid: [`SWEEPS`] if the surface is to come to rest. `share` is the start and end of this
    /// part of the job's progress.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn settle(&mut self, sweeps: usize, share: [f32; 2], job: &Job<'_>) -> Result<bool, NodeError> {
        let coarsest = self.levels.len() - 1;
        // coarse grids do not resolve the ledges and hollows that hold a layer, and would remobilise it
        let cycles = if self.levels[0].loose.is_empty() { CYCLES } else { 1 };
        let sweeps = if coarsest == 0 { sweeps * CYCLES } else { sweeps };
        for cycle in 0..cycles {
            for level in 0..coarsest {
                let (fine, coarse) = self.levels.split_at_mut(level + 1);
                let fine = &fine[level];
                let coarse = &mut coarse[0];
                restrict(&fine.moved, fine.nx, fine.ny, &mut coarse.moved);
                if !coarse.loose.is_empty() {
                    coarse
                        .moved
                        .iter_mut()
                        .for_each(|moved| *moved = (*moved / coarse.quantum).floor() * coarse.quantum);
                }
            }
            // a tighter tolerance on coarser grids leaves room for the detail of the finer ones
            let mut tolerance = self.tolerance / (1 << coarsest) as f32;
            let before: Vec<Vec<f32>> = self.levels[1..].iter().map(|level| level.moved.clone()).collect();
            for level in (0..=coarsest).rev() {
                let mut found = Sweep { changed: true, steep: true };
                self.levels[level].wake();
                for sweep in 0..sweeps {
                    found = self.levels[level].sweep(tolerance, job)?;
                    if !found.steep || !found.changed {
                        break;
                    }
                    let done = (coarsest - level) as f32 + sweep as f32 / sweeps as f32;
                    let done = if cycle == 0 { done / (coarsest + 1) as f32 } else { 1.0 };
                    job.advance(share[0] + (share[1] - share[0]) * done)?;
                }
                if level == 0 && !(found.steep && found.changed) {
                    return Ok(!found.steep);
                }
                if level > 0 {
                    let (fine, coarse) = self.levels.split_at_mut(level);
                    prolong(&coarse[0], &before[level - 1], &mut fine[level - 1]);
                    tolerance *= 2.0;
                }
            }
        }
        Ok(false)
    }

    /// Returns the gain of each cell in metres, row-major. The gains sum to zero: rounding over thousands of sweeps, up
    /// to 2e-4 of the moved volume, is compensated in proportion by all cells that gained.
    ///
    /// # Errors
    /// [`OutOfMemory`].
    pub fn moved(&self) -> Result<Vec<f32>, OutOfMemory> {
        let (level, [nx, ny]) = (&self.levels[0], self.cells);
        let mut moved = with_capacity(nx * ny)?;
        (0..ny).for_each(|j| moved.extend_from_slice(&level.moved[level.at(0, j)..][..nx]));
        // in lanes, whose sums do not depend on threads
        let (mut gains, mut losses) = ([0.0; 8], [0.0; 8]);
        for part in moved.chunks(8) {
            for ((gained, lost), &moved) in gains.iter_mut().zip(&mut losses).zip(part) {
                let moved = f64::from(moved);
                *gained += moved.max(0.0);
                *lost -= moved.min(0.0);
            }
        }
        let [gained, lost]: [f64; 2] = [gains.iter().sum(), losses.iter().sum()];
        if gained > 0.0 && gained != lost {
            let share = lost / gained;
            par::change(&mut moved, |moved| {
                if *moved > 0.0 {
                    *moved = (f64::from(*moved) * share) as f32;
                }
            });
        }
        Ok(moved)
    }
}

/// The number of coarser grids of a raster.
fn coarser(cells: [usize; 2], wraps: [bool; 2]) -> usize {
    let mut coarser = 0;
    while cells
        .iter()
        .zip(wraps)
        .all(|(&n, wraps)| n >> (coarser + 1) >= COARSEST && (!wraps || n.is_multiple_of(1 << (coarser + 1))))
    {
        coarser += 1;
    }
    coarser
}

/// The least rise at repose of a raster.
pub(crate) fn least(rise: &[f32]) -> f32 {
    rise.iter().copied().fold(f32::MAX, f32::min)
}

/// The quantum of flows on terrain with that least rise at repose: a power of two, so that its multiples scale and add
/// exactly.
fn quantum(least: f32) -> f32 {
    f32::from_bits(least.max(f32::MIN_POSITIVE * 1e9).to_bits() & 0xff80_0000) * QUANTUM
}

/// Returns true if opposite sides of a world are joined, along x and y.
pub fn wraps(boundary: &orograph_graph::Boundary) -> [bool; 2] {
    [[boundary.west, boundary.east], [boundary.north, boundary.south]].map(|sides| sides == [Edge::Periodic; 2])
}

impl Level {
    fn new([nx, ny]: [usize; 2], wraps: [bool; 2], layered: bool) -> Result<Self, OutOfMemory> {
        // rows of tiles are read whole, also where the last tile is narrower
        let len = (nx + 2) * (ny + 2) + WIDE;
        Ok(Self {
            nx,
            ny,
            wraps,
            height: zeroed(len)?,
            rise: filled(len, f32::INFINITY)?,
            loose: zeroed(if layered { len } else { 0 })?,
            moved: zeroed(len)?,
            next: zeroed(len)?,
            quantum: 0.0,
            changed: vec![true; nx.div_ceil(TILE[0]) * ny.div_ceil(TILE[1])],
            even: vec![None; nx.div_ceil(TILE[0]) * ny.div_ceil(TILE[1])],
        })
    }

    /// Finds the tiles with one rise at repose, also in their halo.
    fn find_even_tiles(&mut self) {
        let stride = self.nx + 2;
        let tiles = self.nx.div_ceil(TILE[0]);
        let rise = &self.rise;
        par::all(self.even.chunks_mut(tiles), |strip, even| {
            let first = strip * TILE[1];
            let rows = first..(first + TILE[1]).min(self.ny) + 2;
            for (tile, even) in even.iter_mut().enumerate() {
                let columns = tile * TILE[0]..(tile * TILE[0] + TILE[0]).min(self.nx) + 2;
                let repose = rise[first * stride + columns.start];
                let same = |row| rise[row * stride..][columns.clone()].iter().all(|rise| *rise == repose);
                // four of them have a finite sum
                *even = (repose < HIGHEST && rows.clone().all(same)).then_some(repose);
            }
        });
    }

    /// Returns the index of a cell.
    fn at(&self, i: usize, j: usize) -> usize {
        (j + 1) * (self.nx + 2) + i + 1
    }

    /// Sets the rise at repose to that of a grid of twice the resolution, over twice the distance.
    fn coarsen_rise(&mut self, fine: &Self) {
        restrict(&fine.rise, fine.nx, fine.ny, &mut self.rise);
        for rise in &mut self.rise {
            *rise *= 2.0;
        }
        self.quantum = 2.0 * fine.quantum;
        wrap(&mut self.rise, self.nx, self.ny, self.wraps);
    }

    /// Sets heights and loose layer to the means of 2 x 2 cells of a grid of twice the resolution.
    fn coarsen_ground(&mut self, fine: &Self) {
        self.moved.fill(0.0);
        restrict(&fine.height, fine.nx, fine.ny, &mut self.height);
        if !self.loose.is_empty() {
            restrict(&fine.loose, fine.nx, fine.ny, &mut self.loose);
        }
        self.wrap_ground();
    }

    fn wrap_ground(&mut self) {
        wrap(&mut self.height, self.nx, self.ny, self.wraps);
        if !self.loose.is_empty() {
            wrap(&mut self.loose, self.nx, self.ny, self.wraps);
        }
    }

    /// Marks every tile as changed.
    fn wake(&mut self) {
        wrap(&mut self.moved, self.nx, self.ny, self.wraps);
        self.next.copy_from_slice(&self.moved);
        self.changed.fill(true);
    }

    fn sweep(&mut self, tolerance: f32, job: &Job<'_>) -> Result<Sweep, NodeError> {
        let stride = self.nx + 2;
        let tiles = self.nx.div_ceil(TILE[0]);
        let ground = Ground {
            height: &self.height,
            rise: &self.rise,
            loose: &self.loose,
            moved: &self.moved,
            stride,
            step: STEP,
            tolerance,
            quantum: self.quantum / STEP,
            even: None,
        };
        let awake = Awake { changed: &self.changed, tiles: [tiles, self.ny.div_ceil(TILE[1])], wraps: self.wraps };
        let mut changed = vec![false; self.changed.len()];
        let interior = stride..stride * (self.ny + 1);
        let strips = self.next[interior].chunks_mut(stride * TILE[1]).zip(changed.chunks_mut(tiles));
        let found = par::collect(strips, |strip, (out, changed)| {
            job.check()?;
            let mut found = Sweep::default();
            for (tile, changed) in changed.iter_mut().enumerate() {
                if awake.around(tile, strip) {
                    let columns = [tile * TILE[0], (tile * TILE[0] + TILE[0]).min(self.nx)];
                    let ground = Ground { even: self.even[strip * tiles + tile], ..ground };
                    let seen = sweep::tile(&ground, strip * TILE[1], columns, out);
                    *changed = seen.changed;
                    found.changed |= seen.changed;
                    found.steep |= seen.steep;
                }
            }
            Ok::<_, NodeError>(found)
        })?;
        let both = |a: Sweep, b: Sweep| Sweep { changed: a.changed | b.changed, steep: a.steep | b.steep };
        let found = found.into_iter().fold(Sweep::default(), both);
        self.changed = changed;
        std::mem::swap(&mut self.moved, &mut self.next);
        wrap(&mut self.moved, self.nx, self.ny, self.wraps);
        Ok(found)
    }
}

/// The tiles that the last sweep changed.
struct Awake<'a> {
    changed: &'a [bool],
    tiles: [usize; 2],
    wraps: [bool; 2],
}

impl Awake<'_> {
    /// Returns true if a tile or one of its neighbours changed; a sweep of any other tile would repeat its last result.
    fn around(&self, tile: usize, strip: usize) -> bool {
        let near = |at: usize, axis: usize| {
            let n = self.tiles[axis];
            let (before, after) = if self.wraps[axis] {
                ((at + n - 1) % n, (at + 1) % n)
            } else {
                (at.saturating_sub(1), (at + 1).min(n - 1))
            };
            [before, at, after]
        };
        near(strip, 1).iter().any(|j| near(tile, 0).iter().any(|i| self.changed[j * self.tiles[0] + i]))
    }
}

/// Copies the halo from the opposite side along the axes that wrap.
fn wrap(raster: &mut [f32], nx: usize, ny: usize, wraps: [bool; 2]) {
    let stride = nx + 2;
    if wraps[0] {
        for row in raster.chunks_exact_mut(stride) {
            row[0] = row[nx];
            row[nx + 1] = row[1];
        }
    }
    if wraps[1] {
        raster.copy_within(ny * stride..(ny + 1) * stride, 0);
        raster.copy_within(stride..2 * stride, (ny + 1) * stride);
    }
}

/// Heights from this value on, in metres, count as voids: their squares would overflow.
pub(crate) const HIGHEST: f32 = 1e15;

/// The tangent of an angle of repose in degrees.
pub(crate) fn tangent(degrees: f32) -> f32 {
    math::f32::tan(degrees.clamp(1.0, 89.0).to_radians())
}

/// Returns the rise between neighbours at an angle, in metres; infinite where the mask or a void prevents movement.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn rises(job: &Job<'_>, height: &[f32], angle: Lane<'_>, mask: Lane<'_>) -> Result<Vec<f32>, NodeError> {
    let cell_m = job.cell_m() as f32;
    let constant = angle.constant().map(tangent);
    let nx = job.window().nx();
    let mut rise = zeroed(height.len())?;
    par::rows_within(job, [0.0, 0.0], &mut rise, |j, row| {
        for (i, rise) in row.iter_mut().enumerate() {
            let at = j * nx + i;
            let rise_m = constant.unwrap_or_else(|| tangent(angle.at(at))) * cell_m / mask.at(at).clamp(0.0, 1.0);
            *rise = if rise_m.is_finite() && height[at].abs() < HIGHEST { rise_m } else { f32::INFINITY };
        }
    })?;
    Ok(rise)
}
