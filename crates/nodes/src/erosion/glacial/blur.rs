//! Means over a radius that varies from cell to cell.
//!
//! The raster is smoothed in levels, each by the weights 1/4, 1/2, 1/4 with twice the spacing of the level before (the
//! à trous scheme of Holschneider et al. 1989), so that the variance grows by half of 4^k cells² per level. A cell
//! takes the value between the two levels on either side of its own variance.

use orograph_graph::memory::{OutOfMemory, zeroed};

use super::grid::Grid;
use crate::numerics::par;

/// Rows of a part of a parallel loop. Does not affect the result.
const ROWS: usize = 16;
/// Most levels: a standard deviation of 26 cells.
const LEVELS: u32 = 6;

/// Returns the rasters, each cell smoothed with its own standard deviation, `sigma_m` in metres; beyond sides that
/// are not joined they are mirrored. Sums are kept where `sigma_m` is the same everywhere.
pub(super) fn blurred<const N: usize>(
    grid: &Grid,
    rasters: [&[f32]; N],
    sigma_m: &(dyn Fn(usize) -> f64 + Sync),
    most_m: f64,
) -> Result<[Vec<f32>; N], OutOfMemory> {
    let cell_m = (grid.cell_m[0] * grid.cell_m[1]).sqrt();
    // filled by the loops, which run on all cores
    let rasters_of_zeros = || -> Result<[Vec<f32>; N], OutOfMemory> {
        let mut all = [const { Vec::new() }; N];
        all.iter_mut().try_for_each(|raster| zeroed(grid.len()).map(|zeros| *raster = zeros))?;
        Ok(all)
    };
    let (mut out, mut before, mut level) = (rasters_of_zeros()?, rasters_of_zeros()?, rasters_of_zeros()?);
    let mut wanted: Vec<f32> = zeroed(grid.len())?;
    par::all(wanted.chunks_mut(1 << 13), |part, wanted| {
        for (k, wanted) in wanted.iter_mut().enumerate() {
            let sigma = sigma_m((part << 13) + k) / cell_m;
            *wanted = (sigma * sigma) as f32;
        }
    });
    let size = grid.nx * ROWS;
    let mut variance = 0.0_f32;
    for k in 0..LEVELS {
        if f64::from(variance) * cell_m * cell_m >= most_m * most_m {
            break;
        }
        let from = variance;
        variance += 0.5 * (1_u32 << (2 * k)) as f32;
        let (least, last) = (1.0 / (variance - from), k + 1 == LEVELS);
        // parts of all rasters together: a loop over one small raster takes less time than it takes to begin
        let of_before = before.iter().zip(rasters).map(|(before, raster)| if k == 0 { raster } else { before });
        let smoothed = of_before.zip(&mut level).zip(&mut out).flat_map(|((before, level), out)| {
            let parts = level.chunks_mut(size).zip(out.chunks_mut(size)).enumerate();
            parts.map(move |(part, (level, out))| (before, part, level, out))
        });
        par::all(smoothed, |_, (before, part, level, out)| {
            smooth(grid, before, level, part * ROWS, 1 << k);
            let place = part * size;
            for (((out, level), before), wanted) in
                out.iter_mut().zip(level.iter()).zip(&before[place..]).zip(&wanted[place..])
            {
                let t = (wanted - from) * least;
                let between = before + if t < 1.0 { t } else { 1.0 } * (level - before);
                let so_far = if k == 0 { *before } else { *out };
                *out = if t > 0.0 && (t < 1.0 || last) { between } else { so_far };
                *out = if t >= 1.0 { *level } else { *out };
            }
        });
        std::mem::swap(&mut before, &mut level);
    }
    Ok(out)
}

/// Smooths by 1/4, 1/2, 1/4 with a spacing in cells, in both directions: the rows from the row `first` on.
fn smooth(grid: &Grid, from: &[f32], to: &mut [f32], first: usize, spacing: usize) {
    let (nx, ny) = (grid.nx, grid.ny);
    let (column, row) = (beyond(nx, grid.wraps(0)), beyond(ny, grid.wraps(1)));
    let mut sums = vec![0.0_f32; nx];
    for (k, to) in to.chunks_mut(nx).enumerate() {
        let line = |j: isize| &from[row(j) * nx..][..nx];
        let (at, spacing) = ((first + k) as isize, spacing as isize);
        let (north, here, south) = (line(at - spacing), line(at), line(at + spacing));
        for (((sum, here), north), south) in sums.iter_mut().zip(here).zip(north).zip(south) {
            *sum = 0.5 * here + 0.25 * (north + south);
        }
        let spaced = (spacing as usize).min(nx);
        let end = nx.saturating_sub(spaced).max(spaced);
        for i in (0..spaced).chain(end..nx) {
            let (west, east) = (column(i as isize - spacing), column(i as isize + spacing));
            to[i] = 0.5 * sums[i] + 0.25 * (sums[west] + sums[east]);
        }
        if end > spaced {
            let count = end - spaced;
            let (west, here, east) = (&sums[..count], &sums[spaced..][..count], &sums[2 * spaced..][..count]);
            for (((to, west), here), east) in to[spaced..end].iter_mut().zip(west).zip(here).zip(east) {
                *to = 0.5 * here + 0.25 * (west + east);
            }
        }
    }
}

/// The place of a cell beyond an end: its mirror image, or on the other side of a line that wraps.
fn beyond(count: usize, wraps: bool) -> impl Fn(isize) -> usize + Sync {
    let count = count as isize;
    move |at| {
        let at = at.rem_euclid(if wraps { count } else { 2 * count });
        (if at < count { at } else { 2 * count - 1 - at }) as usize
    }
}

/// The largest of `depth` minus half the distance, over all cells: the thickness of the glacier that a cell is part of.
/// By two passes of a chamfer mask (Borgefors 1986), twice where sides are joined.
pub(super) fn reach(grid: &Grid, depth: &mut [f32]) {
    let (nx, ny, wrap_x, wrap_y) = (grid.nx, grid.ny, grid.wraps(0), grid.wraps(1));
    let [dx, dy] = grid.cell_m.map(|cell_m| 0.5 * cell_m as f32);
    let corner = (dx * dx + dy * dy).sqrt();
    let rounds = if wrap_x || wrap_y { 2 } else { 1 };
    for pass in 0..2 * rounds {
        let back = pass % 2 == 0;
        for k in 0..ny {
            let j = if back { k } else { ny - 1 - k };
            let beside = match back {
                true if j > 0 => Some(j - 1),
                true => wrap_y.then_some(ny - 1),
                false if j + 1 < ny => Some(j + 1),
                false => wrap_y.then_some(0),
            };
            let ends = [depth[j * nx], depth[(j + 1) * nx - 1]];
            if let Some(beside) = beside.filter(|beside| *beside != j) {
                let (one, other) = depth.split_at_mut(j.max(beside) * nx);
                let (row, beside) = if beside < j {
                    (&mut other[..nx], &one[beside * nx..][..nx])
                } else {
                    (&mut one[j * nx..][..nx], &other[..nx])
                };
                across(row, beside, dy, corner, wrap_x);
            }
            let row = &mut depth[j * nx..][..nx];
            let before = wrap_x.then_some(ends[usize::from(back)] - dx);
            if back {
                along(row.iter_mut(), before, dx);
            } else {
                along(row.iter_mut().rev(), before, dx);
            }
        }
    }
}

/// Raises the cells of a row to what those of the row beside it reach.
fn across(row: &mut [f32], beside: &[f32], dy: f32, corner: f32, wraps: bool) {
    let last = row.len() - 1;
    for (depth, beside) in row.iter_mut().zip(beside) {
        *depth = depth.max(beside - dy);
    }
    for (depth, west) in row[1..].iter_mut().zip(beside) {
        *depth = depth.max(west - corner);
    }
    for (depth, east) in row.iter_mut().zip(&beside[1..]) {
        *depth = depth.max(east - corner);
    }
    if wraps {
        row[0] = row[0].max(beside[last] - corner);
        row[last] = row[last].max(beside[0] - corner);
    }
}

/// Raises each cell to what the one before it reaches, the first one to `before`.
fn along<'a>(row: impl Iterator<Item = &'a mut f32>, before: Option<f32>, dx: f32) {
    let mut before = before.unwrap_or(f32::NEG_INFINITY);
    for depth in row {
        *depth = depth.max(before);
        before = *depth - dx;
    }
}
