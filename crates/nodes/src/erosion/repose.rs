//! Relaxation of a surface to slopes of at most its angle of repose.
//!
//! The state is what has moved, `d`, on top of heights `h` that stay as they are, so that ground on which nothing moves
//! keeps its bits and small amounts are not lost on high mountains. A sweep moves `(1 - r/|g|)₊ g` down the rise `g` per
//! cell, at two places: at every corner, where `g` is that of the plane through the four cells around it, and over every
//! face between two neighbours, where `g` is their own rise with that of the corners along the face. `r` is the rise at
//! repose, the mean over the cells concerned. Both are the same in every direction, so that cones are round; faces hold
//! what corners cannot see, such as a chequerboard, and corners what faces cannot, such as a lone diagonal step: at
//! rest, none of a cell's eight neighbours is above repose. What leaves one cell enters another in the same amount,
//! whichever of them computes it, so a sweep conserves material to rounding.
//!
//! A sweep reaches one cell far, and a scarp n cells wide takes on the order of n² of them. So sweeps start on a
//! coarse grid, and what moved there is carried to the next finer one, down to the grid itself. A closed cell has an infinite `r`: the
//! border of a walled world, masked ground, holes in the data. A coarse cell is closed if any part of it is.

use orograph_graph::{Edge, Job, NodeError};
use rayon::prelude::*;

use crate::simd::simd;

/// Rows and columns of the tiles that are skipped while nothing moves around them.
const TILE: [usize; 2] = [256, 16];

/// Share of the excess that a sweep moves: the operator's largest eigenvalue is 8, so no sweep overshoots.
pub const STEP: f32 = 0.125;

/// A grid is made coarser while its shorter side keeps at least this many cells.
const COARSEST: usize = 64;

/// The most sweeps over a grid before the next finer one takes over.
const SWEEPS: usize = 2000;

/// The most times the pyramid is climbed.
const CYCLES: usize = 8;

/// One grid of the pyramid. Rasters have a ring of one cell around them, closed or wrapped.
struct Level {
    nx: usize,
    ny: usize,
    wraps: [bool; 2],
    height: Vec<f32>,
    /// Rise at repose between neighbours, in metres; infinite where closed.
    rise: Vec<f32>,
    moved: Vec<f32>,
    next: Vec<f32>,
    /// Per tile, whether the last sweep changed it.
    changed: Vec<bool>,
}

/// A surface that slides where it is steeper than its repose.
pub struct Slump {
    levels: Vec<Level>,
    cells: [usize; 2],
    tolerance: f32,
}

/// What a sweep found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Sweep {
    changed: bool,
    /// Whether any slope exceeds its repose by more than the tolerance.
    steep: bool,
}

impl Slump {
    /// A surface of `cells` columns and rows from its heights and rises at repose between neighbours (m, infinite where
    /// nothing may move and the height means nothing), row-major. `tolerance` is the excess that counts as none, as a share of the repose.
    pub fn new(cells: [usize; 2], height: &[f32], rise: &[f32], wraps: [bool; 2], tolerance: f32) -> Self {
        let mut coarser = 0;
        while cells
            .iter()
            .zip(wraps)
            .all(|(&n, wraps)| n >> (coarser + 1) >= COARSEST && (!wraps || n.is_multiple_of(1 << (coarser + 1))))
        {
            coarser += 1;
        }
        // Closed cells fill the sides up to whole cells of the coarsest grid.
        let [nx, ny] = cells.map(|n| n.next_multiple_of(1 << coarser));
        let mut finest = Level::new(nx, ny, wraps);
        for j in 0..cells[1] {
            let to = finest.at(0, j);
            let from = j * cells[0]..(j + 1) * cells[0];
            finest.rise[to..to + cells[0]].copy_from_slice(&rise[from.clone()]);
            for ((out, &height), &rise) in finest.height[to..].iter_mut().zip(&height[from.clone()]).zip(&rise[from]) {
                *out = if rise.is_finite() { height } else { 0.0 };
            }
        }
        finest.wrap_ground();
        let mut levels = vec![finest];
        for level in 0..coarser {
            levels.push(levels[level].coarser());
        }
        Self { levels, cells, tolerance }
    }

    /// Sweeps until no slope exceeds its repose, coarse grids first.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn settle(&mut self, job: &Job<'_>) -> Result<(), NodeError> {
        let coarsest = self.levels.len() - 1;
        let sweeps = if coarsest == 0 { SWEEPS * CYCLES } else { SWEEPS };
        for cycle in 0..CYCLES {
            for level in 0..coarsest {
                let (fine, coarse) = self.levels.split_at_mut(level + 1);
                let fine = &fine[level];
                restrict(&fine.moved, fine.nx, fine.ny, &mut coarse[0].moved);
            }
            // coarser grids come closer to repose, so that the next finer one finds room for its details
            let mut tolerance = self.tolerance / (1 << coarsest) as f32;
            let before: Vec<Vec<f32>> = self.levels[1..].iter().map(|level| level.moved.clone()).collect();
            for level in (0..=coarsest).rev() {
                let mut settled = false;
                self.levels[level].wake();
                for sweep in 0..sweeps {
                    let found = self.levels[level].sweep(STEP, tolerance, job)?;
                    settled = !found.steep || !found.changed;
                    if settled {
                        break;
                    }
                    let done = (coarsest - level) as f32 + sweep as f32 / sweeps as f32;
                    job.advance(if cycle == 0 { done / (coarsest + 1) as f32 } else { 1.0 })?;
                }
                if level == 0 && settled {
                    return Ok(());
                }
                if level > 0 {
                    let (fine, coarse) = self.levels.split_at_mut(level);
                    prolong(&coarse[0], &before[level - 1], &mut fine[level - 1]);
                    tolerance *= 2.0;
                }
            }
        }
        Ok(())
    }

    /// Sweeps that many times with a given step, at most [`STEP`], or until nothing is too steep.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn slide(&mut self, sweeps: u64, step: f32, job: &Job<'_>) -> Result<(), NodeError> {
        let level = &mut self.levels[0];
        level.wake();
        for sweep in 0..sweeps {
            let found = level.sweep(step, self.tolerance, job)?;
            if !found.steep || !found.changed {
                break;
            }
            job.advance(sweep as f32 / sweeps as f32)?;
        }
        Ok(())
    }

    /// What each cell has gained, in metres, row-major.
    #[must_use]
    pub fn moved(&self) -> Vec<f32> {
        let level = &self.levels[0];
        (0..self.cells[1]).flat_map(|j| &level.moved[level.at(0, j)..][..self.cells[0]]).copied().collect()
    }
}

/// Whether opposite sides of a world are joined, along x and y.
pub fn wraps(boundary: &orograph_graph::Boundary) -> [bool; 2] {
    [[boundary.west, boundary.east], [boundary.north, boundary.south]].map(|sides| sides == [Edge::Periodic; 2])
}

impl Level {
    fn new(nx: usize, ny: usize, wraps: [bool; 2]) -> Self {
        let len = (nx + 2) * (ny + 2);
        Self {
            nx,
            ny,
            wraps,
            height: vec![0.0; len],
            rise: vec![f32::INFINITY; len],
            moved: vec![0.0; len],
            next: vec![0.0; len],
            changed: vec![true; nx.div_ceil(TILE[0]) * ny.div_ceil(TILE[1])],
        }
    }

    /// Index of a cell.
    fn at(&self, i: usize, j: usize) -> usize {
        (j + 1) * (self.nx + 2) + i + 1
    }

    /// The grid of half the resolution: means of 2 x 2 cells, over twice the distance.
    fn coarser(&self) -> Self {
        let mut coarse = Self::new(self.nx / 2, self.ny / 2, self.wraps);
        restrict(&self.height, self.nx, self.ny, &mut coarse.height);
        restrict(&self.rise, self.nx, self.ny, &mut coarse.rise);
        for rise in &mut coarse.rise {
            *rise *= 2.0;
        }
        coarse.wrap_ground();
        coarse
    }

    fn wrap_ground(&mut self) {
        wrap(&mut self.height, self.nx, self.ny, self.wraps);
        wrap(&mut self.rise, self.nx, self.ny, self.wraps);
    }

    /// Makes the next sweep look at every tile.
    fn wake(&mut self) {
        wrap(&mut self.moved, self.nx, self.ny, self.wraps);
        self.next.copy_from_slice(&self.moved);
        self.changed.fill(true);
    }

    fn sweep(&mut self, step: f32, tolerance: f32, job: &Job<'_>) -> Result<Sweep, NodeError> {
        let stride = self.nx + 2;
        let tiles = self.nx.div_ceil(TILE[0]);
        let ground =
            Ground { height: &self.height, rise: &self.rise, moved: &self.moved, stride, step, limit: 1.0 + tolerance };
        let awake = Awake { changed: &self.changed, tiles: [tiles, self.ny.div_ceil(TILE[1])], wraps: self.wraps };
        let mut changed = vec![false; self.changed.len()];
        let interior = stride..stride * (self.ny + 1);
        let found = self.next[interior]
            .par_chunks_mut(stride * TILE[1])
            .zip(changed.par_chunks_mut(tiles))
            .enumerate()
            .map(|(strip, (out, changed))| {
                job.check()?;
                let mut found = Sweep::default();
                for (tile, changed) in changed.iter_mut().enumerate() {
                    if awake.around(tile, strip) {
                        let columns = [tile * TILE[0], (tile * TILE[0] + TILE[0]).min(self.nx)];
                        let seen = slide_tile(&ground, strip * TILE[1], columns, out);
                        *changed = seen.changed;
                        found.changed |= seen.changed;
                        found.steep |= seen.steep;
                    }
                }
                Ok::<_, NodeError>(found)
            })
            .try_reduce(Sweep::default, |a, b| {
                Ok(Sweep { changed: a.changed | b.changed, steep: a.steep | b.steep })
            })?;
        self.changed = changed;
        std::mem::swap(&mut self.moved, &mut self.next);
        wrap(&mut self.moved, self.nx, self.ny, self.wraps);
        Ok(found)
    }
}

/// Which tiles the last sweep changed.
struct Awake<'a> {
    changed: &'a [bool],
    tiles: [usize; 2],
    wraps: [bool; 2],
}

impl Awake<'_> {
    /// Whether a tile or one beside it changed; otherwise a sweep would only repeat what it found before.
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

/// Copies the ring from the opposite side of the axes that wrap.
pub fn wrap(raster: &mut [f32], nx: usize, ny: usize, wraps: [bool; 2]) {
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

/// Means of 2 x 2 cells of a grid with `nx` by `ny` of them.
fn restrict(fine: &[f32], nx: usize, ny: usize, coarse: &mut [f32]) {
    let (from, to) = (nx + 2, nx / 2 + 2);
    let rows = fine[from..from * (ny + 1)].chunks_exact(2 * from);
    for (pair, out) in rows.zip(coarse[to..].chunks_exact_mut(to)) {
        let (north, south) = (pair[1..=nx].chunks_exact(2), pair[from + 1..][..nx].chunks_exact(2));
        for ((a, b), out) in north.zip(south).zip(&mut out[1..]) {
            *out = 0.25 * ((a[0] + a[1]) + (b[0] + b[1]));
        }
    }
}

/// Adds what a coarse grid has moved since `before` to the finer one.
///
/// Each coarse cell that moved gives its four parts its own gain with the gain's gradient. Where they are then too steep
/// among themselves, as at a cliff that the slide has swallowed, they are flattened about their mean and lean as the
/// coarse surface does. Both keep the mean of the four, so material is conserved cell by cell; coarse cells that did not
/// move touch nothing.
fn prolong(coarse: &Level, before: &[f32], fine: &mut Level) {
    let gain = |at: usize| coarse.moved[at] - before[at];
    let surface = |at: usize| coarse.height[at] + coarse.moved[at];
    // an eighth of the difference over two coarse cells: what a quarter of a coarse cell makes
    let lean = |of: &dyn Fn(usize) -> f32, at: usize| {
        let near = |beside: usize| if coarse.rise[beside].is_finite() { of(beside) } else { of(at) };
        let row = coarse.nx + 2;
        [0.125 * (near(at + 1) - near(at - 1)), 0.125 * (near(at + row) - near(at - row))]
    };
    let stride = fine.nx + 2;
    let Level { height, rise, moved, .. } = fine;
    moved[stride..stride * (fine.ny + 1)].par_chunks_mut(2 * stride).enumerate().for_each(|(j, rows)| {
        for i in 0..coarse.nx {
            let at = coarse.at(i, j);
            let own = gain(at);
            if own == 0.0 {
                continue;
            }
            let first = 2 * i + 1;
            let cells = [first, first + 1, first + stride, first + stride + 1];
            let above = (2 * j + 1) * stride;
            let [east, south] = lean(&gain, at);
            // where the gain ends, its gradient must not turn it into a loss
            let most = (east.abs() + south.abs()).max(f32::MIN_POSITIVE);
            let share = (own.abs() / most).min(1.0);
            let gains = tilted(share * east, share * south).map(|tilt| own + tilt);
            let [a, b, c, d] = [0, 1, 2, 3].map(|k| height[above + cells[k]] + (rows[cells[k]] + gains[k]));
            let repose = 0.25 * cells.iter().map(|&cell| rise[above + cell]).sum::<f32>();
            let (x, y) = (0.5 * ((b - a) + (d - c)), 0.5 * ((c - a) + (d - b)));
            let steepest =
                [b - a, d - c, c - a, d - b].iter().fold((x * x + y * y).sqrt(), |most, v| most.max(v.abs()));
            let mut settle = [0.0; 4];
            if steepest > repose {
                let kept = repose / steepest;
                let [east, south] = lean(&surface, at).map(|lean| lean * (1.0 - kept));
                let mean = 0.25 * ((a + b) + (c + d));
                let tilts = tilted(east, south);
                settle = [0, 1, 2, 3].map(|k| tilts[k] - (1.0 - kept * kept) * ([a, b, c, d][k] - mean));
            }
            for k in 0..4 {
                rows[cells[k]] += gains[k] + settle[k];
            }
        }
    });
}

/// The four parts of a cell on a plane through its middle: north-west, north-east, south-west, south-east.
fn tilted(east: f32, south: f32) -> [f32; 4] {
    [-east - south, east - south, south - east, east + south]
}

/// What a tile's sweep reads.
struct Ground<'a> {
    height: &'a [f32],
    rise: &'a [f32],
    moved: &'a [f32],
    stride: usize,
    step: f32,
    /// 1 plus the tolerance.
    limit: f32,
}

/// Part of one row and of the next, of height, rise and moved.
type Rows<'a> = [[&'a [f32]; 3]; 2];

impl Ground<'_> {
    /// `len` cells from index `at` on, and those to the south.
    #[inline(always)]
    fn rows(&self, at: usize, len: usize) -> Rows<'_> {
        [at, at + self.stride].map(|at| [&self.height[at..][..len], &self.rise[at..][..len], &self.moved[at..][..len]])
    }
}

/// A row of corners: the rise of the plane there, and what moves from south-east to north-west and from north-east to
/// south-west.
struct Corners {
    east: [f32; TILE[0] + 1],
    south: [f32; TILE[0] + 1],
    falling: [f32; TILE[0] + 1],
    rising: [f32; TILE[0] + 1],
}

impl Corners {
    const NONE: Self = Self {
        east: [0.0; TILE[0] + 1],
        south: [0.0; TILE[0] + 1],
        falling: [0.0; TILE[0] + 1],
        rising: [0.0; TILE[0] + 1],
    };

    /// The first `n` corners between two rows; not 0 if one is too steep.
    #[inline(always)]
    fn fill(&mut self, rows: &Rows<'_>, limit: f32, n: usize) -> u32 {
        let [[h, r, d], [hs, rs, ds]] = *rows;
        let (h, r, d) = (&h[..n + 1], &r[..n + 1], &d[..n + 1]);
        let (hs, rs, ds) = (&hs[..n + 1], &rs[..n + 1], &ds[..n + 1]);
        let (gx, gy) = (&mut self.east[..n], &mut self.south[..n]);
        let (falling, rising) = (&mut self.falling[..n], &mut self.rising[..n]);
        let mut steep = 0;
        for i in 0..n {
            let north = (h[i + 1] - h[i]) + (d[i + 1] - d[i]);
            let south = (hs[i + 1] - hs[i]) + (ds[i + 1] - ds[i]);
            let west = (hs[i] - h[i]) + (ds[i] - d[i]);
            let east = (hs[i + 1] - h[i + 1]) + (ds[i + 1] - d[i + 1]);
            let repose = 0.25 * ((r[i] + r[i + 1]) + (rs[i] + rs[i + 1]));
            // a closed corner is level: the ground beyond a wall mirrors the ground before it
            let open = repose < f32::INFINITY;
            gx[i] = if open { 0.5 * (north + south) } else { 0.0 };
            gy[i] = if open { 0.5 * (west + east) } else { 0.0 };
            let (share, over) = excess(gx[i], gy[i], repose, limit);
            falling[i] = 0.5 * share * (gx[i] + gy[i]);
            rising[i] = 0.5 * share * (gx[i] - gy[i]);
            steep |= over;
        }
        steep
    }
}

/// The share of the rise (x, y) that is above repose, and 1 if it is above `limit` times repose, else 0.
#[inline(always)]
fn excess(x: f32, y: f32, repose: f32, limit: f32) -> (f32, u32) {
    let steepness = (x * x + y * y).sqrt();
    let share = 1.0 - repose / steepness;
    (if steepness > repose { share } else { 0.0 }, u32::from(steepness > repose * limit))
}

/// What moves over the faces from a row of `n` cells to the cells south of them; not 0 if one is too steep.
#[inline(always)]
fn southward(rows: &Rows<'_>, corners: &Corners, limit: f32, n: usize, out: &mut [f32; TILE[0]]) -> u32 {
    let [h, r, d, hs, rs, ds] = {
        let [[h, r, d], [hs, rs, ds]] = *rows;
        [h, r, d, hs, rs, ds].map(|row| &row[1..n + 1])
    };
    let along = &corners.east[..n + 1];
    let out = &mut out[..n];
    let mut steep = 0;
    for i in 0..n {
        let rise = (hs[i] - h[i]) + (ds[i] - d[i]);
        let (share, over) = excess(rise, 0.5 * (along[i] + along[i + 1]), 0.5 * (r[i] + rs[i]), limit);
        out[i] = share * rise;
        steep |= over;
    }
    steep
}

/// What moves over the faces between `n + 1` cells of a row; not 0 if one is too steep.
#[inline(always)]
fn eastward(
    [h, r, d]: [&[f32]; 3],
    north: &Corners,
    south: &Corners,
    limit: f32,
    n: usize,
    out: &mut [f32; TILE[0] + 1],
) -> u32 {
    let (h, r, d) = (&h[..n + 1], &r[..n + 1], &d[..n + 1]);
    let (north, south, out) = (&north.south[..n], &south.south[..n], &mut out[..n]);
    let mut steep = 0;
    for i in 0..n {
        let rise = (h[i + 1] - h[i]) + (d[i + 1] - d[i]);
        let (share, over) = excess(rise, 0.5 * (north[i] + south[i]), 0.5 * (r[i] + r[i + 1]), limit);
        out[i] = share * rise;
        steep |= over;
    }
    steep
}

simd! {
    /// One sweep over the columns of a strip of rows that begins at row `first`; `out` is the strip, rings included.
    fn slide_tile(ground: &Ground<'_>, first: usize, columns: [usize; 2], out: &mut [f32]) -> Sweep {
        let (stride, limit) = (ground.stride, ground.limit);
        let n = columns[1] - columns[0];
        let (mut north, mut south) = (Corners::NONE, Corners::NONE);
        let (mut up, mut down, mut east) = ([0.0; TILE[0]], [0.0; TILE[0]], [0.0; TILE[0] + 1]);
        // index of the cell north-west of the strip's first
        let mut at = first * stride + columns[0];
        let rows = ground.rows(at, n + 2);
        let mut steep = north.fill(&rows, limit, n + 1);
        steep |= southward(&rows, &north, limit, n, &mut up);
        let mut changed = 0;
        for out in out.chunks_exact_mut(stride) {
            at += stride;
            let rows = ground.rows(at, n + 2);
            steep |= south.fill(&rows, limit, n + 1);
            steep |= southward(&rows, &south, limit, n, &mut down);
            steep |= eastward(rows[0], &north, &south, limit, n + 1, &mut east);
            let moved = &rows[0][2][1..n + 1];
            let out = &mut out[columns[0] + 1..][..n];
            let (up_row, down_row, east_row) = (&up[..n], &down[..n], &east[..n + 1]);
            let (northwest, northeast) = (&north.falling[..n + 1], &north.rising[..n + 1]);
            let (southeast, southwest) = (&south.falling[..n + 1], &south.rising[..n + 1]);
            for i in 0..n {
                let faces = (east_row[i + 1] - east_row[i]) + (down_row[i] - up_row[i]);
                let corners = (southeast[i + 1] - northwest[i]) + (northeast[i + 1] - southwest[i]);
                out[i] = moved[i] + ground.step * (faces + corners);
                changed |= u32::from(out[i] != moved[i]);
            }
            std::mem::swap(&mut north, &mut south);
            std::mem::swap(&mut up, &mut down);
        }
        Sweep { changed: changed > 0, steep: steep > 0 }
    }
}
