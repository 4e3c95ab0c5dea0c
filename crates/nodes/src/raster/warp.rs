//! Warps a raster of one coordinate system onto the cells of a world in another.
//!
//! The raster is first brought, along its own axes, to cells as large as those of the world, or left as it is where its
//! cells are larger; means preserve the volume ([`Resampler`](super::Resampler)). The cells of the world are then
//! interpolated from that grid by the Catmull-Rom cubic, clamped to the four samples around a position, so that no new
//! summits or pits appear.
//!
//! Positions are converted exactly at every eighth cell along both axes and interpolated in between: at 45 degrees and
//! cells of a kilometre this is off by a thousandth of a cell. The converted positions are rounded to 2⁻¹⁰ cells of the
//! raster, far above the last bits in which the trigonometric functions of systems differ, so that the terrain is the
//! same on every machine. Where interpolated positions would be off by more than a twentieth of a cell, which happens
//! at poles and at the meridian at which the columns of a raster of the whole globe begin, the raster is refused.

use std::ops::Range;

use orograph_graph::{GeoPlace, NodeError, Window};

use super::{Cell, GridAxis, Head, Projection, SystemError};
use crate::numerics::{math::catmull_rom, par};

/// Cells of the world between converted positions.
const SPACING: u32 = 8;
/// Positions are multiples of its inverse, in cells of the raster.
const GRAIN: f64 = 1024.0;
/// The largest error of interpolated positions, in cells of the world.
const MOST_OFF: f64 = 0.05;
/// Web Mercator, and longitude and latitude of WGS84.
const MERCATOR: u32 = 3857;
const WGS84: u32 = 4326;

/// Why a raster cannot be warped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum WarpError {
    /// A coordinate system cannot be used.
    #[error(transparent)]
    System(#[from] SystemError),
    /// The raster does not say where it is.
    #[error("the raster has no position")]
    NoPlace,
    /// The raster does not say in which system its position is.
    #[error("the raster names no coordinate system")]
    NoSystem,
    /// A part of the world has no position in a system.
    #[error("a part of the world lies outside of the domain of EPSG:{0}")]
    OutOfDomain(u32),
    /// The coordinates of the world are not metres.
    #[error("EPSG:{0} is not in metres")]
    NotMetric(u32),
    /// Rows and columns of the raster are strongly curved in the world.
    #[error("the world reaches a pole or the meridian at which the raster begins")]
    Curved,
    /// They have no cell in common.
    #[error("it lies outside of the world")]
    Apart,
}

/// Conversion of positions in a world to those in a raster.
struct Conversion {
    world: Projection,
    raster: Projection,
    place: GeoPlace,
    cell_m: f64,
    /// Outer north-west corner of the raster, and its cells, in its own coordinates.
    origin: [f64; 2],
    cell: [f64; 2],
    size: [usize; 2],
}

impl Conversion {
    fn new(head: &Head, place: GeoPlace, cell_m: f64) -> Result<Self, WarpError> {
        let (Some(origin), Some(cell)) = (head.origin, head.cell) else { return Err(WarpError::NoPlace) };
        let (epsg, cell) = match cell {
            Cell::Metres(cell) => (head.epsg.ok_or(WarpError::NoSystem)?, cell.map(|side| side / head.unit_m)),
            Cell::Degrees(cell) => (head.epsg.unwrap_or(WGS84), cell),
            Cell::Mercator(cell) => (MERCATOR, cell),
        };
        let (world, raster) = (Projection::of(place.epsg)?, Projection::of(epsg)?);
        if world.is_geographic() || world.unit_m() != 1.0 {
            return Err(WarpError::NotMetric(place.epsg));
        }
        Ok(Self { world, raster, place, cell_m, origin, cell, size: [head.columns, head.rows] })
    }

    /// Column and row of the raster, from its north-west corner, at a position in the world, in cells from its own.
    fn of(&self, [i, j]: [f64; 2]) -> Result<[f64; 2], WarpError> {
        let [x, y] = self.place.corner_m;
        let degrees = self.world.degrees([x + i * self.cell_m, y - j * self.cell_m]);
        let degrees = degrees.ok_or(WarpError::OutOfDomain(self.world.epsg()))?;
        let [mut east, north] = self.raster.position(degrees).ok_or(WarpError::OutOfDomain(self.raster.epsg()))?;
        if self.raster.is_geographic() {
            // the same meridian, in the turn of the raster's middle
            let middle = self.origin[0] + 0.5 * self.cell[0] * self.size[0] as f64;
            east -= 360.0 * ((east - middle) / 360.0).round();
        }
        let [column, row] = [(east - self.origin[0]) / self.cell[0], (self.origin[1] - north) / self.cell[1]];
        Ok([column, row].map(rounded))
    }
}

fn rounded(cells: f64) -> f64 {
    (cells * GRAIN).round() / GRAIN
}

/// The positions of the cells of a window in a raster.
pub struct Warp {
    window: Window,
    /// The raster along its own axes with cells of the world's size.
    pub(crate) axes: [GridAxis; 2],
    /// The part of that grid which the window needs: first column and row.
    pub(crate) origin: [u32; 2],
    /// Its columns and rows.
    pub(crate) cells: [u32; 2],
    /// Column and row of the raster at the centres of every eighth cell.
    lattice: Vec<[f64; 2]>,
    /// Columns of the lattice.
    across: usize,
    /// What is worth knowing about the conversion, each a sentence without a full stop.
    pub(crate) remarks: Vec<String>,
}

impl Warp {
    /// Returns the warp of a raster onto a window of a world at a place.
    ///
    /// # Errors
    /// See [`WarpError`].
    pub fn new(head: &Head, place: GeoPlace, window: &Window) -> Result<Self, WarpError> {
        let conversion = Conversion::new(head, place, window.cell_m())?;
        let steps = steps(&conversion, window)?;
        let axes = [0, 1].map(|axis| GridAxis { source: conversion.size[axis], offset: 0.0, step: steps[axis] });
        let nodes = [0, 1].map(|axis| {
            let first = window.origin[axis] / SPACING;
            first..(window.origin[axis] + window.cells[axis]).div_ceil(SPACING) + 1
        });
        let across = nodes[0].len();
        let row = |b: u32| -> Result<Vec<[f64; 2]>, WarpError> {
            let at = |node: u32| f64::from(node * SPACING) + 0.5;
            nodes[0].clone().map(|a| conversion.of([at(a), at(b)])).collect()
        };
        let lattice = par::collect(nodes[1].clone(), |_, b| row(b))?.concat();
        let is_straight = |b: usize, a: usize| -> Result<bool, WarpError> {
            let corner = b * across + a;
            let corners = [corner, corner + 1, corner + across, corner + across + 1].map(|at| lattice[at]);
            let [i, j] = [(0, a), (1, b)].map(|(axis, at)| f64::from((nodes[axis].start + at as u32) * SPACING));
            let half = 0.5 * f64::from(SPACING) + 0.5;
            let middle = conversion.of([i + half, j + half])?;
            let off = |k: usize| middle[k] - 0.25 * corners.iter().map(|at| at[k]).sum::<f64>();
            Ok((0..2).all(|k| off(k).abs() <= MOST_OFF * steps[k]))
        };
        let rows_are_straight = par::collect(0..nodes[1].len() - 1, |_, b| {
            (0..across - 1).try_fold(true, |all, a| Ok::<_, WarpError>(all && is_straight(b, a)?))
        })?;
        if rows_are_straight.contains(&false) {
            return Err(WarpError::Curved);
        }
        let needed = [0, 1].map(|axis| needed(&lattice, axis, &axes[axis]));
        let [columns, rows] = needed.clone().map(|part| (part.end - part.start) as u32);
        let apart = |axis: usize| {
            let size = conversion.size[axis] as f64;
            lattice.iter().all(|at| at[axis] <= 0.0) || lattice.iter().all(|at| at[axis] >= size)
        };
        if window.is_whole() && (apart(0) || apart(1)) {
            return Err(WarpError::Apart);
        }
        let origin = needed.map(|part| part.start as u32);
        let remarks = remarks(&conversion);
        Ok(Self { window: *window, axes, origin, cells: [columns, rows], lattice, across, remarks })
    }

    /// Bytes that a warp keeps, with the part of the grid that it needs.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let grid = size_of::<f32>() as u64 * u64::from(self.cells[0]) * u64::from(self.cells[1]);
        size_of_val(&self.lattice[..]) as u64 + grid
    }

    /// Interpolates the cells of the window from the needed part of the grid. Cells whose centre is outside of the
    /// raster get `beyond` or, if it is `None`, the nearest value at the edge. `check` is called once per row.
    ///
    /// # Errors
    /// The error of `check`.
    pub fn sample(
        &self,
        grid: &[f32],
        beyond: Option<f32>,
        out: &mut [f32],
        check: &(dyn Fn() -> Result<(), NodeError> + Sync),
    ) -> Result<(), NodeError> {
        let nx = self.window.nx();
        par::each(out.chunks_exact_mut(nx), |j, row| {
            for (i, out) in row.iter_mut().enumerate() {
                let at = self.position(i, j);
                let is_inside = [0, 1].into_iter().all(|k| (0.0..=self.axes[k].source as f64).contains(&at[k]));
                *out = match beyond.filter(|_| !is_inside) {
                    Some(level) => level,
                    None => self.interpolated(grid, at),
                };
            }
            check()
        })
    }

    /// Column and row of the raster at the centre of a cell of the window.
    fn position(&self, i: usize, j: usize) -> [f64; 2] {
        let spacing = SPACING as usize;
        let from = [0, 1].map(|axis| self.window.origin[axis] as usize);
        let along = |at: usize, axis: usize| {
            let at = at + from[axis];
            (at / spacing - from[axis] / spacing, (at % spacing) as f64 / spacing as f64)
        };
        let ((a, u), (b, v)) = (along(i, 0), along(j, 1));
        let corner = b * self.across + a;
        let [upper, lower] = [corner, corner + self.across].map(|at| [self.lattice[at], self.lattice[at + 1]]);
        [0, 1].map(|k| {
            let ends = [upper, lower].map(|[west, east]| west[k] + u * (east[k] - west[k]));
            ends[0] + v * (ends[1] - ends[0])
        })
    }

    /// The value of the grid at a column and row of the raster.
    fn interpolated(&self, grid: &[f32], at: [f64; 2]) -> f32 {
        let columns = self.cells[0] as usize;
        let taps = [0, 1].map(|axis| {
            let last = self.axes[axis].cells() as f64 - 1.0;
            let at = (at[axis] / self.axes[axis].step - 0.5).clamp(0.0, last);
            let left = at.floor();
            let cell = |k: f64| ((left + k).clamp(0.0, last) - f64::from(self.origin[axis])) as usize;
            ([cell(-1.0), cell(0.0), cell(1.0), cell(2.0)], at - left)
        });
        let [(across, t), (down, u)] = taps;
        let weights = [catmull_rom(t), catmull_rom(u)];
        let mut sum = 0.0;
        for (row, weight) in down.into_iter().zip(weights[1]) {
            let row = &grid[row * columns..][..columns];
            let along: f64 = across.into_iter().zip(weights[0]).map(|(at, w)| f64::from(row[at]) * w).sum();
            sum += weight * along;
        }
        let near = [(1, 1), (2, 1), (1, 2), (2, 2)].map(|(i, j)| grid[down[j] * columns + across[i]]);
        let [least, most] = near.iter().fold([f32::MAX, f32::MIN], |[lo, hi], v| [lo.min(*v), hi.max(*v)]);
        (sum as f32).clamp(least, most)
    }
}

/// Cells of the raster in a cell of the world along both axes of the raster, at the middle of the world, and one where
/// those of the raster are larger.
fn steps(conversion: &Conversion, window: &Window) -> Result<[f64; 2], WarpError> {
    let [nx, ny] = window.world.cells.map(f64::from);
    // a whole lattice cell apart, so that rounding hardly changes the length
    let half = 0.5 * f64::from(SPACING);
    let at = |i: f64, j: f64| conversion.of([0.5 * nx + i, 0.5 * ny + j]);
    let (east, west, south, north) = (at(half, 0.0)?, at(-half, 0.0)?, at(0.0, half)?, at(0.0, -half)?);
    Ok([0, 1].map(|k| {
        let [along, across] = [east[k] - west[k], south[k] - north[k]];
        rounded((along * along + across * across).sqrt() / f64::from(SPACING)).max(1.0)
    }))
}

/// The cells of the grid along an axis that positions of the lattice need.
fn needed(lattice: &[[f64; 2]], axis: usize, grid: &GridAxis) -> Range<usize> {
    let count = grid.cells();
    let [low, high] =
        lattice.iter().fold([f64::MAX, f64::MIN], |[low, high], at| [low.min(at[axis]), high.max(at[axis])]);
    let cell = |at: f64, margin: f64| (at / grid.step - 0.5 + margin).clamp(0.0, count as f64 - 1.0) as usize;
    cell(low.floor(), -2.0)..cell(high.ceil(), 3.0) + 1
}

/// What is worth knowing about a conversion.
fn remarks(conversion: &Conversion) -> Vec<String> {
    let Conversion { world, raster, .. } = conversion;
    let shifted = [world, raster].into_iter().filter(|system| system.is_shifted() && world.epsg() != raster.epsg());
    let shift = |system: &Projection| {
        format!("the datum of EPSG:{} is shifted by parameters that are good to some metres", system.epsg())
    };
    shifted.map(shift).collect()
}
