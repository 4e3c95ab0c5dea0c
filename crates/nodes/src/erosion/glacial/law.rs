//! Erosion of the bed: abrasion, plucking, the cross-section law, and walls that fail.

use orograph_graph::memory::{OutOfMemory, zeroed};

use super::{
    Law, Params,
    blur::{blurred, reach},
    grid::Grid,
    ice::{Ice, THIN_M},
};
use crate::numerics::{math, par};

/// The largest factor of the cross-section law.
const MOST: f64 = 2.0;
/// The smallest.
const LEAST: f64 = 0.05;
/// Standard deviation over which a failing wall fails.
const RIB_M: f64 = 90.0;
/// Area to which the second law refers, in m².
const REFERENCE_AREA_M2: f64 = 1e6;
/// Longest standard deviation of means over the glacier's width.
const WIDEST_M: f64 = 1000.0;
/// Thickness of the thinnest glacier that has a width of its own: thinner ice erodes as a part of wider ice, or little.
const THINNEST_M: f64 = 150.0;
/// Thickness from which ice erodes fully: thinner ice is cold, or parts from its bed.
const FULL_M: f64 = 60.0;

/// How the bed of a cell wears down.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Rate {
    /// Lowering in m/yr, if it were all rock of erodibility 1 and the section a trough.
    pub base: f32,
    /// The factor of the cross-section law.
    pub section: f32,
    /// The most that `base` may lower it in a step, in metres: with more, the section's factor would overshoot, and
    /// neighbours would take turns at being deep.
    pub most: f32,
}

/// How the bed wears down. `area` is the ice drainage area in m², for the law
/// that reads it; `bed` and `surface` are levels of each cell.
pub(super) fn rates(
    grid: &Grid,
    params: &Params,
    ice: &Ice,
    bed: &(dyn Fn(usize) -> f64 + Sync),
    area: Option<&[f64]>,
) -> Result<Vec<Rate>, OutOfMemory> {
    let nx = grid.nx;
    // thickness of the glacier around each cell
    let mut whole = orograph_graph::memory::copied(&ice.depth)?;
    reach(grid, &mut whole);
    let has = |cell: usize| f64::from(ice.depth[cell]) > THIN_M;

    // sliding over the glacier's width: stress that shallow ice does not pass on sideways
    let mut level: Vec<f32> = zeroed(grid.len())?;
    par::all(level.chunks_mut(nx), |j, row| {
        row.iter_mut().enumerate().for_each(|(i, level)| *level = f32::from(u8::from(has(j * nx + i))));
    });
    let wide = |cell: usize| f64::from(whole[cell]).clamp(THINNEST_M, WIDEST_M);
    // ice bridges shorter steps: the fall of the bed that it feels is that over its thickness
    let mut ground: Vec<f32> = zeroed(grid.len())?;
    par::all(ground.chunks_mut(nx), |j, row| {
        row.iter_mut().enumerate().for_each(|(i, level)| *level = bed(j * nx + i) as f32);
    });
    let [mut speed, share, broad] = blurred(grid, [&ice.sliding, &level, &ground], &wide, WIDEST_M)?;
    par::change_with(&mut speed, &share, |speed, share| *speed /= share.max(0.05));
    drop((share, level));

    // the mean level of the bed within half the glacier's thickness, and the mean thickness too, so that thicker ice in
    // a groove does not by itself deepen the groove; the direction of flow, smoothed over the same width
    let near = |cell: usize| (0.5 * f64::from(whole[cell]).max(THINNEST_M)).min(0.5 * WIDEST_M);
    let [east, south] = &ice.velocity;
    let [around, thickness, east, south] = blurred(grid, [&ground, &ice.depth, east, south], &near, 0.5 * WIDEST_M)?;
    drop(ground);
    let mut rates = orograph_graph::memory::filled(grid.len(), Rate::default())?;
    par::all(rates.chunks_mut(nx), |j, rates| {
        for (i, rate) in rates.iter_mut().enumerate() {
            let cell = j * nx + i;
            if !has(cell) {
                continue;
            }
            let depth = f64::from(thickness[cell]);
            let thickest = f64::from(whole[cell]).max(depth);
            let sliding = f64::from(speed[cell]);
            let section = (1.0
                - params.cross_section * (f64::from(around[cell]) - bed(cell)) / thickest.max(THINNEST_M))
            .clamp(LEAST, MOST);
            let thin = (depth / thickest).sqrt() * (depth / FULL_M).min(1.0);
            // how the bed falls along the flow: positive downwards
            let flow = [f64::from(east[cell]), f64::from(south[cell])];
            let fast = math::hypot(flow[0], flow[1]);
            let [west, east, north, south] = grid.beside(i, j).map(|at| f64::from(broad[at.unwrap_or(cell)]));
            let fall = if fast > 0.0 {
                let tilt = [(west - east) / (2.0 * grid.cell_m[0]), (north - south) / (2.0 * grid.cell_m[1])];
                (tilt[0] * flow[0] + tilt[1] * flow[1]) / fast
            } else {
                0.0
            };
            let adverse = (2.0 + fall.min(0.0) / params.reverse_slope).clamp(0.0, 1.0);
            let area = match (params.law, area) {
                (Law::Area, Some(area)) => math::pow(area[cell].max(1.0) / REFERENCE_AREA_M2, params.area_exponent),
                _ => 1.0,
            };
            let abrasion = params.abrasion * power(sliding, params.exponent) * area;
            let plucking = params.plucking * sliding * fall.clamp(0.0, 1.0);
            let most = thickest.max(THINNEST_M) / params.cross_section.max(1e-3);
            *rate = Rate {
                base: ((abrasion + plucking) * thin * adverse) as f32,
                section: section as f32,
                most: most as f32,
            };
        }
    });
    Ok(rates)
}

/// x^l, without a logarithm for the usual exponents.
#[inline]
fn power(x: f64, l: f64) -> f64 {
    if l == 1.0 {
        x
    } else if l == 2.0 {
        x * x
    } else {
        math::pow(x, l)
    }
}

/// How far each cell fails in a step: a third of what is steeper than the `tangent` of the cell above a neighbour for
/// which `active` is true, spread along the wall, because a wall does not fail in ribs as wide as a cell.
pub(super) fn failures(
    grid: &Grid,
    tangent: &(dyn Fn(usize) -> f64 + Sync),
    bed: &[f64],
    active: &[bool],
) -> Result<Vec<f32>, OutOfMemory> {
    let nx = grid.nx;
    let mut fallen: Vec<f32> = zeroed(grid.len())?;
    par::all(fallen.chunks_mut(nx), |j, fallen| {
        // rows without ice around them
        let rows = [(j + grid.ny - 1) % grid.ny, j, (j + 1) % grid.ny];
        if !rows.into_iter().any(|j| active[j * nx..][..nx].contains(&true)) {
            return;
        }
        for (i, fallen) in fallen.iter_mut().enumerate() {
            let mut worst = 0.0;
            let steepest = tangent(j * nx + i);
            for (way, other) in grid.beside(i, j).into_iter().enumerate() {
                let Some(other) = other.filter(|&other| active[other]) else { continue };
                let excess = bed[j * nx + i] - bed[other] - steepest * grid.cell_m[way / 2];
                worst = if excess > worst { excess } else { worst };
            }
            *fallen = (worst / 3.0) as f32;
        }
    });
    if !par::any(&fallen, |fallen| *fallen > 0.0) {
        return Ok(fallen);
    }
    let [spread] = blurred(grid, [&fallen], &|_| RIB_M, RIB_M)?;
    Ok(spread)
}

/// The lowest neighbour of a cell; the cell if there is none that is lower.
pub(super) fn below(grid: &Grid, bed: &[f64], cell: usize) -> usize {
    let beside = grid.beside(cell % grid.nx, cell / grid.nx).into_iter().flatten();
    beside.fold(cell, |lowest, other| if bed[other] < bed[lowest] { other } else { lowest })
}
