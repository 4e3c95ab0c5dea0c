//! Order statistics of the neighbourhood of each cell, such as the median: exact, at a cost that grows little with
//! the radius.
//!
//! Neighbourhoods of up to about twenty cells are sorted by a sorting network (K. E. Batcher, 1968, "Sorting networks
//! and their applications", in the form of D. E. Knuth's algorithm M), sixteen or more places at once.
//!
//! For larger ones the terrain is processed in blocks, and each block sorts the values within its reach once. From one
//! row of a block to the next, only the boundary of the neighbourhood changes, so the number of neighbours below a
//! position of that order can be updated, for many columns at once; a few steps along the order then lead to the
//! requested rank. The result is exactly one of the values of the terrain and does not depend on the blocks (B. Weiss,
//! 2025, "Fast isotropic median filtering"). Differences from the source: steps are runs of the order, not single
//! values; runs of equal values are skipped; and a block is traversed along its contours rather than across.
//! Neighbourhoods are not squares, which leave square marks: above 3.6 cells they are circles of four rectangles
//! (`circle`), with the circle's area and an edge that deviates by at most 8 % of the radius.
//!
//! The boundary and the number of steps grow with the radius, but dozens of cells are processed together: from 4 to 64
//! cells, 256 times the area, the cost is three times as much. It comes from sorting the overlap of blocks twice, and
//! from the steps on steep terrain. The worst case is a median that jumps from cell to cell, as on stripes with cliffs
//! between them; `docs/performance.md` has the times.

mod block;
mod circle;
mod network;
mod sweep;
#[cfg(test)]
mod tests;

use orograph_graph::{Job, NodeError, Window, memory::zeroed};

use self::{
    block::Block,
    circle::{Circle, Steps},
};
use super::{
    coarse::{Between, Coarse},
    lines::Ends,
    par,
};

/// Maximum radius in cells; for larger radii the terrain is averaged over coarser cells, of which a radius has this
/// many.
const MOST: f64 = 128.0;

/// Radius in cells from which neighbourhoods are ranked in blocks.
const LARGE: f64 = 3.0;

/// Bytes of a block per cell.
const BLOCK_BYTES: f64 = 30.0;

/// Extension of terrain beyond the sides of a world that is not periodic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Beyond {
    /// Mirrored, which adds no other values.
    Mirrored,
    /// Point-reflected at the outermost cells, so that slopes continue.
    Straight,
}

/// Returns the distance around a cell in metres that is read.
#[must_use]
pub fn reach_m(radius_m: f64, cell_m: f64) -> f64 {
    if radius_m < cell_m { 0.0 } else { 1.2 * radius_m + 3.0 * cell_m }
}

/// Returns, for each cell, the value within a radius that exceeds a fraction `share` of the values: 0 is the minimum, 1
/// the maximum, a half the median. `progress` is the part of the job's progress.
///
/// A periodic world wraps around. A radius below one cell changes nothing.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn rank(
    job: &Job<'_>,
    progress: [f32; 2],
    samples: &[f32],
    radius_m: f64,
    share: f64,
    beyond: Beyond,
) -> Result<Vec<f32>, NodeError> {
    let window = job.window();
    let ends = [0, 1].map(|axis| Ends::of(&window, axis));
    let radius = radius_m / job.cell_m();
    if radius < 1.0 {
        return Ok(samples.to_vec());
    }
    if radius <= MOST {
        let cells = [window.nx(), window.ny()];
        return Padded::new(samples, cells, ends, beyond, radius).rank(job, progress, share);
    }
    let coarse = Coarse::new(&window, radius / MOST);
    let means = coarse.means(job, samples)?;
    let [x, y] = coarse.steps();
    let radius = (2.0 * radius / (x + y)).clamp(1.0, MOST);
    let ranked = Padded::new(&means, coarse.cells(), ends, beyond, radius).rank(job, progress, share)?;
    coarse.spread(job, [progress[1]; 2], &ranked, Between::Cubic)
}

/// Returns the bytes that [`rank`] needs, including its result.
#[must_use]
pub fn bytes(window: &Window, radius_m: f64) -> u64 {
    let radius = radius_m / window.cell_m();
    let cells = [window.nx() as f64, window.ny() as f64];
    let all = 4.0 * cells[0] * cells[1];
    if radius < 1.0 {
        return all as u64;
    }
    let coarser = (radius / MOST).max(1.0);
    let margin = 2.0 * radius / coarser;
    let [nx, ny] = cells.map(|cells| (cells / coarser).ceil());
    let coarse = if coarser > 1.0 { 4.0 * nx * ny } else { 0.0 };
    // a block of a large circle with its halo, for one thread: sorted values, twice, with their cells and runs
    let side = (3.0 * radius / coarser).max(64.0);
    let [width, height] = [nx, ny].map(|cells| cells / (cells / side).round().max(1.0) + margin);
    let block = if radius >= LARGE { BLOCK_BYTES * width * height } else { 0.0 };
    // the raster with its halo; the blocks; then the result that is assembled from them
    let ranked = 4.0 * (nx + margin) * (ny + margin) + 4.0 * nx * ny + (4.0 * nx * ny).max(block);
    (ranked + coarse).max(2.0 * coarse + all) as u64
}

/// A raster with a halo for the neighbourhoods of its outermost cells.
struct Padded {
    samples: Vec<f32>,
    /// Columns of `samples`, including the halo.
    width: usize,
    /// Width of the halo.
    margin: usize,
    /// Columns and rows of the raster.
    cells: [usize; 2],
    circle: Circle,
}

impl Padded {
    fn new(samples: &[f32], cells: [usize; 2], ends: [Ends; 2], beyond: Beyond, radius: f64) -> Self {
        let circle = Circle::new(radius);
        let margin = circle.reach();
        let [nx, ny] = cells;
        let width = nx + 2 * margin;
        // the cell at a place, and the cell at which it is reflected
        let source = |at: usize, axis: usize| {
            let (at, last) = (at as i64 - margin as i64, cells[axis] as i64 - 1);
            if beyond == Beyond::Mirrored || ends[axis] == Ends::Wrap || (0..=last).contains(&at) {
                return (ends[axis].index(at, cells[axis]), None);
            }
            let edge = if at < 0 { 0 } else { last };
            ((2 * edge - at).clamp(0, last) as usize, Some(edge as usize))
        };
        let columns: Vec<_> = (0..width).map(|i| source(i, 0)).collect();
        let turned = |here: f32, edge: f32| edge + (edge - here);
        let along = |row: usize, out: &mut [f32]| {
            let row = &samples[row * nx..][..nx];
            for (out, &(i, edge)) in out.iter_mut().zip(&columns) {
                *out = edge.map_or(row[i], |edge| turned(row[i], row[edge]));
            }
        };
        let mut padded = vec![0.0; width * (ny + 2 * margin)];
        par::all(padded.chunks_mut(width * 16), |part, rows| {
            let mut spare = vec![0.0; width];
            for (j, out) in (part * 16..).zip(rows.chunks_mut(width)) {
                let (row, edge) = source(j, 1);
                along(row, out);
                if let Some(edge) = edge {
                    along(edge, &mut spare);
                    out.iter_mut().zip(&spare).for_each(|(out, edge)| *out = turned(*out, *edge));
                }
            }
        });
        Self { samples: padded, width, margin, cells, circle }
    }

    fn rank(&self, job: &Job<'_>, progress: [f32; 2], share: f64) -> Result<Vec<f32>, NodeError> {
        let rank = (share * (self.circle.count() - 1) as f64).round() as usize;
        job.advance(progress[0])?;
        let out = match &self.circle {
            Circle::Cells(cells) => network::sorted(job, self, cells, rank)?,
            Circle::Steps(steps) => self.swept(job, steps, rank as u16)?,
        };
        job.advance(progress[1])?;
        Ok(out)
    }

    /// Returns the value of a rank, block by block.
    fn swept(&self, job: &Job<'_>, steps: &Steps, rank: u16) -> Result<Vec<f32>, NodeError> {
        let [nx, ny] = self.cells;
        // blocks of nearly equal size: larger ones have a smaller fraction of halo, smaller ones have fewer steps from
        // row to row
        let side = (3 * steps.reach()).max(64);
        let sides = self.cells.map(|cells| cells.div_ceil((cells as f64 / side as f64).round().max(1.0) as usize));
        let corners: Vec<[usize; 2]> =
            (0..ny).step_by(sides[1]).flat_map(|y| (0..nx).step_by(sides[0]).map(move |x| [x, y])).collect();
        let found = par::collect_with(&corners, Block::default, |block, _, &[x, y]| {
            job.check()?;
            let cells = [sides[0].min(nx - x), sides[1].min(ny - y)];
            block.load(self, [x, y], cells, steps);
            Ok::<_, NodeError>(sweep::ranked(block, cells, steps, rank))
        })?;
        let mut out = zeroed(nx * ny)?;
        for ([x, y], values) in corners.into_iter().zip(&found) {
            let width = sides[0].min(nx - x);
            for (j, row) in values.chunks_exact(width).enumerate() {
                out[(y + j) * nx + x..][..width].copy_from_slice(row);
            }
        }
        Ok(out)
    }
}
