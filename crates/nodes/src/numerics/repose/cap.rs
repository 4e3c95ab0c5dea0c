//! Stable rock: the highest surface at or below the terrain that is nowhere steeper than a given slope.
//!
//! `h'(x) = min over y of (h(y) + S |x − y|)`, the viscosity solution of `|∇h'| = S` below the obstacle `h`. Each cell
//! is limited by the plane wave fronts through every adjacent pair of its eight neighbours. This is exact for straight
//! fronts at any azimuth, so that the result is isotropic (J. N. Tsitsiklis, 1995, IEEE Trans. Autom. Control 40; there
//! in Dijkstra's order, here by fast sweeping of blocks in alternating directions, as in H. Zhao, 2005, Math. Comp.
//! 74). Blocks that changed are swept again, and so are their neighbours. A cell depends only on lower ones, so the
//! result does not depend on the order.
//!
//! In layers of rock the surface climbs from the neighbours of a cell through one layer after the other, at the slope
//! of each.

use orograph_graph::NodeError;

use super::{Land, pace::beside};
use crate::numerics::{beds::Ground, par};
use crate::prelude::Job;

/// Cells per side of a block.
const BLOCK: usize = 64;

/// Cells per side of a block with its halo.
const RINGED: usize = BLOCK + 2;

/// Returns the highest surface that rises by at most `rise` between neighbours (m) where that is finite, and is the
/// terrain elsewhere. Closed cells neither limit others nor are lowered. In layers of rock, `rise` is for a slope of
/// 45°.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn capped(land: &Land<'_>, layers: Option<&Ground<'_>>, job: &Job<'_>) -> Result<Vec<f32>, NodeError> {
    let [nx, ny] = land.cells;
    let blocks = [nx.div_ceil(BLOCK), ny.div_ceil(BLOCK)];
    let mut surface: Vec<f32> =
        land.height.iter().zip(land.rise).map(|(h, r)| if r.is_finite() { *h } else { f32::INFINITY }).collect();
    let mut awake = vec![true; blocks[0] * blocks[1]];
    while awake.contains(&true) {
        let lowered = par::collect((0..awake.len()).filter(|&block| awake[block]), |_, block| {
            job.check()?;
            let cells = relaxed(land, layers, &surface, [block % blocks[0], block / blocks[0]]);
            Ok::<_, NodeError>(cells.map(|cells| (block, cells)))
        })?;
        awake.fill(false);
        for (block, cells) in lowered.into_iter().flatten() {
            let [bi, bj] = [block % blocks[0], block / blocks[0]];
            for (j, row) in cells.chunks_exact(RINGED).enumerate().skip(1).take(BLOCK.min(ny - bj * BLOCK)) {
                let wide = BLOCK.min(nx - bi * BLOCK);
                surface[(bj * BLOCK + j - 1) * nx + bi * BLOCK..][..wide].copy_from_slice(&row[1..=wide]);
            }
            for j in beside(bj, blocks[1], land.wraps[1]) {
                for i in beside(bi, blocks[0], land.wraps[0]) {
                    awake[j * blocks[0] + i] = true;
                }
            }
        }
    }
    for (surface, height) in surface.iter_mut().zip(land.height) {
        if surface.is_infinite() {
            *surface = *height;
        }
    }
    Ok(surface)
}

/// Lowers a block as far as its fixed halo allows. Returns None if no cell was lowered.
fn relaxed(land: &Land<'_>, layers: Option<&Ground<'_>>, surface: &[f32], [bi, bj]: [usize; 2]) -> Option<Vec<f32>> {
    let [nx, ny] = land.cells;
    let (wide, high) = (BLOCK.min(nx - bi * BLOCK), BLOCK.min(ny - bj * BLOCK));
    let mut cells = vec![f32::INFINITY; RINGED * RINGED];
    // the terrain's row or column for one of the block
    let place = |first: usize, k: usize, n: usize, wraps: bool| match (first + k).checked_sub(1) {
        Some(at) if at < n => Some(at),
        Some(at) => wraps.then_some(at - n),
        None => wraps.then_some(n - 1),
    };
    for j in 0..high + 2 {
        let Some(row) = place(bj * BLOCK, j, ny, land.wraps[1]) else { continue };
        let to = &mut cells[j * RINGED..][..wide + 2];
        to[1..=wide].copy_from_slice(&surface[row * nx + bi * BLOCK..][..wide]);
        for k in [0, wide + 1] {
            if let Some(column) = place(bi * BLOCK, k, nx, land.wraps[0]) {
                to[k] = surface[row * nx + column];
            }
        }
    }
    let mut lowered = false;
    for sweep in 0.. {
        let mut again = false;
        for j in 0..high {
            let j = if sweep & 2 == 0 { j } else { high - 1 - j };
            let rises = &land.rise[(bj * BLOCK + j) * nx + bi * BLOCK..][..wide];
            for i in 0..wide {
                let i = if sweep & 1 == 0 { i } else { wide - 1 - i };
                let at = (j + 1) * RINGED + i + 1;
                if rises[i].is_finite() {
                    let most = match layers {
                        Some(layers) => {
                            allowed_in(layers, &cells, at, rises[i], (bj * BLOCK + j) * nx + bi * BLOCK + i)
                        }
                        None => allowed(&cells, at, rises[i]),
                    };
                    if most < cells[at] {
                        cells[at] = most;
                        again = true;
                    }
                }
            }
        }
        if !again {
            break;
        }
        lowered = true;
    }
    lowered.then_some(cells)
}

/// Returns the greatest height of a cell in layers of rock, whose number in the terrain is `cell`, that its neighbours
/// allow: the surface climbs from the lowest of them through one layer after the other, at the slope of each.
fn allowed_in(layers: &Ground<'_>, cells: &[f32], at: usize, rise: f32, cell: usize) -> f32 {
    let height = cells[at];
    let row = |k: usize| cells[k - 1].min(cells[k]).min(cells[k + 1]);
    let lowest = row(at - RINGED).min(cells[at - 1].min(cells[at + 1])).min(row(at + RINGED));
    if lowest >= height {
        return height;
    }
    let (mut from, mut rest) = (lowest, 1.0);
    let mut bed = layers.at(cell, f64::from(lowest));
    loop {
        let climb = allowed(cells, at, layers.beds.tangents[bed.layer] as f32 * rise) - lowest;
        let (to, top) = (from + rest * climb, layers.top_m(cell, bed) as f32);
        if to <= top || top >= height {
            return to.min(height);
        }
        rest -= (top - from) / climb;
        (from, bed) = (from.max(top), layers.beds.above(bed));
    }
}

/// Returns the greatest height of a cell that its neighbours allow.
#[inline(always)]
fn allowed(cells: &[f32], at: usize, rise: f32) -> f32 {
    let row = |k: usize| -> [f32; 3] { [cells[k - 1], cells[k], cells[k + 1]] };
    let ([a, b, c], [d, _, e], [f, g, h]) = (row(at - RINGED), row(at), row(at + RINGED));
    let mut most = a.min(c).min(f).min(h) + std::f32::consts::SQRT_2 * rise;
    // between a face neighbour and the lower of the two corner cells beside it
    for (near, far) in [(b, a.min(c)), (d, a.min(f)), (e, c.min(h)), (g, f.min(h))] {
        let drop = (near - far).max(0.0).min(std::f32::consts::FRAC_1_SQRT_2 * rise);
        most = most.min(near + (rise * rise - drop * drop).sqrt());
    }
    most
}
