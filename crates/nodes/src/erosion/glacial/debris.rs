//! Debris: carried with the ice, dropped where it melts, at rest at its angle of repose.

use orograph_graph::{
    Job, NodeError,
    memory::{OutOfMemory, zeroed},
};

use super::{grid::Grid, sheet::Sheet};
use crate::numerics::par;

/// What debris has become, in m³ of each cell.
pub(super) struct Settled {
    /// Volume that came to rest.
    pub volume: Vec<f64>,
    /// Volume that left the world with ice.
    pub left_m3: f64,
    /// Volume that meltwater took away, because there was no room for it.
    pub washed_m3: f64,
}

/// Thickness of ice below which what melts out on it slides off.
const THIN_M: f64 = 50.0;
/// The part of what melts out that is lodged at the bed of thick ice; the rest is carried on the ice to its margin.
const LODGED: f64 = 0.05;

/// Cells whose neighbours are looked up in parallel before they are visited in order.
const CHUNK: usize = 1 << 14;

/// The part of the debris that a cell drops: ice that melts drops what is in it, ice that flows on takes it along.
/// Thick ice drops little of it at its bed.
#[inline]
pub(super) fn dropped(melt: f64, flow: f64, depth_m: f64) -> f64 {
    if flow <= 0.0 {
        return 1.0;
    }
    melt / (melt + flow) * (1.0 - depth_m / THIN_M).max(LODGED)
}

/// The part of what is dropped that comes to rest: all of it where there is much `room`, never more than there is.
#[inline]
pub(super) fn fitting(dropped: f64, room: f64) -> f64 {
    if dropped > 0.0 && room > 0.0 { dropped * room / (dropped + room) } else { 0.0 }
}

/// Carries `volume` with the fluxes of a sheet down its surface. Of the debris that reaches a cell the part [`dropped`]
/// comes to rest, as far as there is `room` for it, in m³. `melt` is in m/yr.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub(super) fn carry(
    job: &Job<'_>,
    sheet: &Sheet,
    melt: impl Fn(usize) -> f64 + Sync,
    room: impl Fn(usize) -> f64 + Sync,
    mut volume: Vec<f64>,
) -> Result<Settled, NodeError> {
    let grid = sheet.grid;
    let order = downward(sheet, |cell| volume[cell] > 0.0);
    let mut settled = Settled { volume: zeroed(grid.len())?, left_m3: 0.0, washed_m3: 0.0 };
    let look_up = |fate: &mut (Way, f64, f64), place: &(u64, u32)| {
        let cell = place.1 as usize;
        let way = Way::of(sheet, *place);
        let drops = dropped(grid.area_m2() * melt(cell).max(0.0), way.flow(), sheet.depth(cell));
        *fate = (way, drops, room(cell));
    };
    let mut fates = vec![Default::default(); CHUNK.min(order.len())];
    for chunk in order.chunks(CHUNK) {
        job.check()?;
        // neighbours in this order are far apart in memory: all cores look them up, and one adds up what arrives
        par::change_with(&mut fates, chunk, look_up);
        for (&(_, cell), (way, drops, room)) in chunk.iter().zip(&fates) {
            let cell = cell as usize;
            let has = volume[cell];
            if has <= 0.0 {
                continue;
            }
            volume[cell] = 0.0;
            let flow = way.flow();
            let stays = fitting(has * drops, *room);
            settled.volume[cell] += stays;
            let rest = has - stays;
            if flow <= 0.0 {
                settled.washed_m3 += rest;
            }
            for (goes, to) in way.goes.into_iter().zip(way.beside) {
                if goes > 0.0 {
                    match volume.get_mut(to as usize) {
                        Some(volume) => *volume += rest * goes / flow,
                        None => settled.left_m3 += rest * goes / flow,
                    }
                }
            }
        }
    }
    // what has reached cells without ice that are not in the order
    for (cell, volume) in volume.iter().enumerate().filter(|(_, volume)| **volume > 0.0) {
        let stays = fitting(*volume, room(cell));
        settled.volume[cell] += stays;
        settled.washed_m3 += volume - stays;
    }
    Ok(settled)
}

/// Cells with ice, and others that count, from the highest surface down; equal ones by their number.
fn downward(sheet: &Sheet, counts: impl Fn(usize) -> bool + Sync) -> Vec<(u64, u32)> {
    let grid = sheet.grid;
    let row = |_, j: usize| -> Vec<(u64, u32)> {
        let row = |raster| grid.row(raster, 0, j as isize, grid.nx);
        let cells = row(&sheet.thickness).iter().zip(row(&sheet.surface)).enumerate();
        let found = cells.filter_map(|(i, (depth, level))| {
            let cell = j * grid.nx + i;
            (*depth > 0.0 || counts(cell)).then(|| (falling(*level), cell as u32))
        });
        found.collect()
    };
    let mut order = par::collect_all(0..grid.ny, row).concat();
    par::sort_keys(&mut order);
    order
}

/// Beyond the world.
const OUTSIDE: u32 = u32::MAX;

/// Where the ice of a cell goes.
#[derive(Clone, Copy, Default)]
struct Way {
    /// What flows to the four neighbours, in m³/yr. Nothing goes back to cells that are earlier in the order.
    goes: [f64; 4],
    beside: [u32; 4],
}

impl Way {
    fn of(sheet: &Sheet, (rank, cell): (u64, u32)) -> Self {
        let grid = sheet.grid;
        let (nx, [dx, dy]) = (grid.nx, grid.cell_m);
        let (i, j) = (cell as usize % nx, cell as usize / nx);
        let through = [
            -sheet.east[j * (nx + 1) + i] * dy,
            sheet.east[j * (nx + 1) + i + 1] * dy,
            -sheet.south[j * nx + i] * dx,
            sheet.south[(j + 1) * nx + i] * dx,
        ];
        let beside = grid.beside(i, j);
        let goes = [0, 1, 2, 3].map(|way| match beside[way] {
            Some(to) if through[way] > 0.0 && (falling(sheet.level(to)), to) <= (rank, cell as usize) => 0.0,
            _ => through[way].max(0.0),
        });
        Self { goes, beside: beside.map(|to| to.map_or(OUTSIDE, |to| to as u32)) }
    }

    /// What flows from the cell in all, in m³/yr.
    fn flow(&self) -> f64 {
        self.goes.iter().sum()
    }
}

/// The area in m² that drains through each cell with the ice, of cells that `gain`.
///
/// # Errors
/// Not enough memory.
pub(super) fn drained(sheet: &Sheet, gain: impl Fn(usize) -> bool) -> Result<Vec<f64>, OutOfMemory> {
    let grid = sheet.grid;
    let mut area: Vec<f64> = zeroed(grid.len())?;
    let order = downward(sheet, |_| false);
    let mut ways = vec![Way::default(); CHUNK.min(order.len())];
    for chunk in order.chunks(CHUNK) {
        par::change_with(&mut ways, chunk, |way, place| *way = Way::of(sheet, *place));
        for (&(_, cell), way) in chunk.iter().zip(&ways) {
            let cell = cell as usize;
            if gain(cell) {
                area[cell] += grid.area_m2();
            }
            let flow = way.flow();
            for (goes, to) in way.goes.into_iter().zip(way.beside) {
                if goes > 0.0 && to != OUTSIDE {
                    area[to as usize] += area[cell] * goes / flow;
                }
            }
        }
    }
    Ok(area)
}

/// A number that falls as the level rises.
fn falling(level: f64) -> u64 {
    let bits = level.to_bits();
    if bits >> 63 == 1 { bits } else { !(bits | 1 << 63) }
}

/// Till thinner than this does not slide.
const STICKS_M: f64 = 0.1;

/// Lets till that is steeper than `tangent` slide to lower neighbours, `sweeps` times. Nothing is lost.
///
/// # Errors
/// Not enough memory.
pub(super) fn slump(
    grid: &Grid,
    rock: &[f64],
    till: &mut Vec<f64>,
    tangent: f64,
    sweeps: usize,
) -> Result<(), NodeError> {
    let nx = grid.nx;
    let most = grid.cell_m.map(|cell_m| tangent * cell_m);
    let mut share: Vec<f64> = zeroed(grid.len())?;
    let mut next: Vec<f64> = zeroed(grid.len())?;
    for _ in 0..sweeps {
        let excess = |till: &[f64], from: usize, to: usize, way: usize| {
            (rock[from] + till[from] - rock[to] - till[to] - most[way / 2]).max(0.0)
        };
        // the factor of each cell's excesses: a fifth, or what there is
        let before: &[f64] = till;
        par::all(share.chunks_mut(nx), |j, share| {
            for (i, share) in share.iter_mut().enumerate() {
                let cell = j * nx + i;
                *share = 0.0;
                if before[cell] > STICKS_M {
                    let beside = grid.beside(i, j).into_iter().enumerate();
                    let sum: f64 = beside.filter_map(|(way, to)| Some(excess(before, cell, to?, way))).sum();
                    *share = if sum > 0.0 { (before[cell] / sum).min(0.2) } else { 0.0 };
                }
            }
        });
        let share: &[f64] = &share;
        if !par::any(share, |share| *share > 0.0) {
            break;
        }
        // rows whose till moves
        let moves = par::map(grid.ny, |j| share[j * nx..][..nx].iter().any(|share| *share > 0.0));
        par::all(next.chunks_mut(nx), |j, next| {
            let beside = [(j + grid.ny - 1) % grid.ny, j, (j + 1) % grid.ny];
            if !beside.into_iter().any(|j| moves[j]) {
                next.copy_from_slice(&before[j * nx..][..nx]);
                return;
            }
            for (i, next) in next.iter_mut().enumerate() {
                let cell = j * nx + i;
                let mut gains = 0.0;
                for (way, other) in grid.beside(i, j).into_iter().enumerate() {
                    let Some(other) = other else { continue };
                    if share[other] > 0.0 {
                        gains += share[other] * excess(before, other, cell, way);
                    }
                    if share[cell] > 0.0 {
                        gains -= share[cell] * excess(before, cell, other, way);
                    }
                }
                *next = (before[cell] + gains).max(0.0);
            }
        });
        std::mem::swap(till, &mut next);
    }
    Ok(())
}
