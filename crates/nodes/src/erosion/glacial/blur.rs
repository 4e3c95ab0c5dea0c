//! Means over a radius that varies from cell to cell.
//!
//! The raster is smoothed in levels, each by the weights 1/4, 1/2, 1/4 with twice the spacing of the level before (the
//! à trous scheme of Holschneider et al. 1989), so that the variance grows by half of 4^k cells² per level. A cell
//! takes the value between the two levels on either side of its own variance.

use orograph_graph::memory::{OutOfMemory, copied, zeroed};

use super::grid::Grid;
use crate::numerics::par;

/// Most levels: a standard deviation of 26 cells.
const LEVELS: u32 = 6;

/// Returns the raster, each cell smoothed with its own standard deviation, `sigma_m` in metres; beyond sides that
/// are not joined it is mirrored. Sums are kept where `sigma_m` is the same everywhere.
pub(super) fn blurred(
    grid: &Grid,
    raster: &[f32],
    sigma_m: &(dyn Fn(usize) -> f64 + Sync),
    most_m: f64,
) -> Result<Vec<f32>, OutOfMemory> {
    let cell_m = (grid.cell_m[0] * grid.cell_m[1]).sqrt();
    let mut out = copied(raster)?;
    let mut before = copied(raster)?;
    let mut level: Vec<f32> = zeroed(raster.len())?;
    let mut wanted: Vec<f32> = zeroed(raster.len())?;
    par::all(wanted.chunks_mut(1 << 13), |part, wanted| {
        for (k, wanted) in wanted.iter_mut().enumerate() {
            let sigma = sigma_m((part << 13) + k) / cell_m;
            *wanted = (sigma * sigma) as f32;
        }
    });
    let mut variance = 0.0_f32;
    for k in 0..LEVELS {
        if f64::from(variance) * cell_m * cell_m >= most_m * most_m {
            break;
        }
        let from = variance;
        variance += 0.5 * (1_u32 << (2 * k)) as f32;
        smooth(grid, &before, &mut level, 1 << k);
        let (least, last) = (1.0 / (variance - from), k + 1 == LEVELS);
        let size = grid.nx * 8;
        let parts = out.chunks_mut(size).zip(level.chunks(size)).zip(before.chunks(size)).zip(wanted.chunks(size));
        par::all(parts, |_, (((out, level), before), wanted)| {
            for (((out, level), before), wanted) in out.iter_mut().zip(level).zip(before).zip(wanted) {
                let t = (wanted - from) * least;
                let between = before + if t < 1.0 { t } else { 1.0 } * (level - before);
                *out = if t > 0.0 && (t < 1.0 || last) { between } else { *out };
                *out = if t >= 1.0 { *level } else { *out };
            }
        });
        std::mem::swap(&mut before, &mut level);
    }
    Ok(out)
}

/// Smooths by 1/4, 1/2, 1/4 with a spacing in cells, in both directions.
fn smooth(grid: &Grid, from: &[f32], to: &mut [f32], spacing: usize) {
    let (nx, ny) = (grid.nx, grid.ny);
    let (column, row) = (beyond(nx, grid.wraps(0)), beyond(ny, grid.wraps(1)));
    par::all(to.chunks_mut(nx * 8), |part, rows| {
        rows.chunks_mut(nx).enumerate().for_each(|(k, to)| {
            let j = part * 8 + k;
            let line = |j: isize| &from[row(j) * nx..][..nx];
            let (at, spacing) = (j as isize, spacing as isize);
            let (north, here, south) = (line(at - spacing), line(at), line(at + spacing));
            let sums: Vec<f32> = (0..nx).map(|i| 0.5 * here[i] + 0.25 * (north[i] + south[i])).collect();
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
        })
    });
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
    let along = |at: usize, back: bool, count: usize, wraps: bool| match back {
        true if at > 0 => Some(at - 1),
        true => wraps.then_some(count - 1),
        false if at + 1 < count => Some(at + 1),
        false => wraps.then_some(0),
    };
    let rounds = if wrap_x || wrap_y { 2 } else { 1 };
    for pass in 0..2 * rounds {
        let back = pass % 2 == 0;
        for k in 0..ny {
            let j = if back { k } else { ny - 1 - k };
            let beside = along(j, back, ny, wrap_y);
            for k in 0..nx {
                let i = if back { k } else { nx - 1 - k };
                let (one, other) = (along(i, back, nx, wrap_x), along(i, !back, nx, wrap_x));
                let mut most = depth[j * nx + i];
                if let Some(i) = one {
                    most = most.max(depth[j * nx + i] - dx);
                }
                if let Some(j) = beside {
                    most = most.max(depth[j * nx + i] - dy);
                    for i in [one, other].into_iter().flatten() {
                        most = most.max(depth[j * nx + i] - corner);
                    }
                }
                depth[j * nx + i] = most;
            }
        }
    }
}
