//! Erosion of the bed: abrasion, plucking, the cross-section law, and walls that fail.

use orograph_graph::memory::{OutOfMemory, zeroed};

use super::{
    Law, Params,
    blur::{blurred, reach},
    grid::Grid,
    ice::{Ice, THIN_M},
};
use crate::numerics::{math, par};

/// Exponent of the share of the glacier's thickness.
const THICKNESS_EXPONENT: f64 = 0.4;
/// The largest factor of the cross-section law.
const MOST: f64 = 2.0;
/// The smallest.
const LEAST: f64 = 0.05;
/// Area to which the second law refers, in m².
const REFERENCE_AREA_M2: f64 = 1e6;
/// Longest standard deviation of means over the glacier's width.
const WIDEST_M: f64 = 1000.0;
/// Thickness of the thinnest glacier that has a width of its own: thinner ice erodes as a part of wider ice, or little.
const THINNEST_M: f64 = 150.0;
/// Thickness from which ice erodes fully: thinner ice is cold, or parts from its bed.
const FULL_M: f64 = 60.0;

/// Lowering of the bed in m/yr, if it were all rock of erodibility 1. `area` is the ice drainage area in m², for the law
/// that reads it; `bed` and `surface` are levels of each cell.
pub(super) fn rates(
    grid: &Grid,
    params: &Params,
    ice: &Ice,
    bed: &(dyn Fn(usize) -> f64 + Sync),
    area: Option<&[f64]>,
) -> Result<Vec<f32>, OutOfMemory> {
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
    let mut speed = blurred(grid, &ice.sliding, &wide, WIDEST_M)?;
    let share = blurred(grid, &level, &wide, WIDEST_M)?;
    par::change_with(&mut speed, &share, |speed, share| *speed /= share.max(0.05));
    drop(share);

    // the mean level of the bed within half the glacier's thickness
    par::all(level.chunks_mut(nx), |j, row| {
        row.iter_mut().enumerate().for_each(|(i, level)| *level = bed(j * nx + i) as f32);
    });
    let near = |cell: usize| (0.5 * f64::from(whole[cell]).max(THINNEST_M)).min(0.5 * WIDEST_M);
    let around = blurred(grid, &level, &near, 0.5 * WIDEST_M)?;
    // ice bridges shorter steps: the fall of the bed that it feels is that over its thickness
    let broad = blurred(grid, &level, &wide, WIDEST_M)?;

    let mut rates = level;
    par::all(rates.chunks_mut(nx), |j, rates| {
        for (i, rate) in rates.iter_mut().enumerate() {
            let cell = j * nx + i;
            if !has(cell) {
                *rate = 0.0;
                continue;
            }
            let depth = f64::from(ice.depth[cell]);
            let thickest = f64::from(whole[cell]).max(depth);
            let sliding = f64::from(speed[cell]);
            let section = (1.0
                - params.cross_section * (f64::from(around[cell]) - bed(cell)) / thickest.max(THINNEST_M))
            .clamp(LEAST, MOST);
            let thin = math::pow(depth / thickest, THICKNESS_EXPONENT) * (depth / FULL_M).min(1.0);
            // how the bed falls along the flow: positive downwards
            let flow = [f64::from(ice.velocity[0][cell]), f64::from(ice.velocity[1][cell])];
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
            let abrasion = params.abrasion * math::pow(sliding, params.exponent) * area;
            let plucking = params.plucking * sliding * fall.clamp(0.0, 1.0);
            *rate = ((abrasion + plucking) * thin * section * adverse) as f32;
        }
    });
    Ok(rates)
}

/// How far walls above the ice fail in a step: a third of what is steeper than `tangent`, above neighbours for which
/// `active` is true. Each entry is a cell, the neighbour that it falls to, and the thickness.
pub(super) fn failures(grid: &Grid, tangent: f64, bed: &[f64], active: &[bool]) -> Vec<(u32, u32, f32)> {
    let (nx, most) = (grid.nx, grid.cell_m.map(|cell_m| tangent * cell_m));
    let rows = par::collect_all(0..grid.ny, |_, j| {
        let mut found = Vec::new();
        for i in 0..nx {
            let cell = j * nx + i;
            let mut worst = (0.0, cell);
            for (way, other) in grid.beside(i, j).into_iter().enumerate() {
                let Some(other) = other else { continue };
                let excess = bed[cell] - bed[other] - most[way / 2];
                if excess > worst.0 && active[other] {
                    worst = (excess, other);
                }
            }
            if worst.0 > 0.0 {
                found.push((cell as u32, worst.1 as u32, (worst.0 / 3.0) as f32));
            }
        }
        found
    });
    rows.into_iter().flatten().collect()
}
