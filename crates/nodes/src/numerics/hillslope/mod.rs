//! Creep of hillslopes: the diffusion of heights, ∂h/∂t = ∇·(D ∇h).
//!
//! Culling (1960) for the equation; Roering, Kirchner and Dietrich (1999) for ground that moves the more readily the
//! closer its slope |∇h| is to a critical one S: D / (1 − (|∇h| / S)²), with (|∇h| / S)² at most 0.95.
//!
//! A step is made along all rows and then along all columns, or the other way round (locally one-dimensional splitting;
//! Yanenko 1971), each by an implicit solution, see the module `bundle`. What leaves a cell enters another, and no
//! height leaves the range of those around it, whatever the step is. With even diffusivity the two directions commute,
//! so that a point spreads in circles as soon as c = D Δt / d² of a step is not large. Stabilised explicit steps
//! (Meyer, Balsara and Aslam 2014) overshoot beside cells that keep their height; multigrid costs ten times as much.

mod bundle;
mod even;
#[cfg(test)]
mod reference;
#[cfg(test)]
mod tests;

use std::ops::Range;

use orograph_graph::{Boundary, Edge};

use self::bundle::{Along, Bundle, Ground, Hold, LANES, diffusivity};
pub use self::bundle::{EXPLICIT, GIVEN_M, HIGHEST_M, MOST_MOBILE, STEEPEST};
use super::{par, repose::wraps};
use crate::prelude::*;

/// What creeps, and how.
#[derive(Debug)]
pub struct Hillslope<'a> {
    nx: usize,
    ny: usize,
    cell_m: f64,
    boundary: Boundary,
    diffusivity: Lane<'a>,
    /// D where less is given, in m²/yr.
    least: f64,
    critical_slope: f64,
    /// Whether the land has risen before each step, except cells that keep their height.
    risen: bool,
}

/// Some lines side by side: slices of rows, from the north.
type Lines<'a> = Vec<&'a mut [f64]>;

impl<'a> Hillslope<'a> {
    /// The whole of a window. `diffusivity` is D in m²/yr, at most 1e6; what is below 0 or no number counts as 0.
    /// `critical_slope` is S in m/m; 0 is without, which is linear diffusion.
    #[must_use]
    pub fn new(window: &Window, diffusivity: Lane<'a>, critical_slope: f64) -> Self {
        let critical_slope = if critical_slope > 0.0 { critical_slope } else { f64::INFINITY };
        let boundary = window.world.boundary;
        Self {
            nx: window.nx(),
            ny: window.ny(),
            cell_m: window.cell_m(),
            boundary,
            diffusivity,
            least: 0.0,
            critical_slope,
            risen: false,
        }
    }

    /// The same for land that has risen before each step. Otherwise cells beside those that keep their height lose a
    /// quarter of their uplift in long steps, and a steady hill is U d² / 4 D too low.
    #[must_use]
    pub fn risen(self) -> Self {
        Self { risen: true, ..self }
    }

    /// The same with at least `least` m²/yr everywhere.
    #[must_use]
    pub fn at_least(self, least: f64) -> Self {
        Self { least: least.clamp(0.0, 1e6), ..self }
    }

    /// The largest D Δt / d² of a cell on level ground over `step_yr`.
    #[must_use]
    pub fn mobility(&self, step_yr: f64) -> f64 {
        let given = match self.diffusivity {
            Lane::Constant(d) => diffusivity(d),
            Lane::Samples(samples) => {
                let most = |_, part: &[f32]| part.iter().map(|&d| diffusivity(d)).fold(0.0, f64::max);
                par::collect_all(samples.chunks(1 << 14), most).into_iter().fold(0.0, f64::max)
            }
        };
        (given.max(self.least) * step_yr / (self.cell_m * self.cell_m)).min(MOST_MOBILE)
    }

    /// Lets heights creep for a step of `step_yr` for each of `turns`, columns before rows in every other turn.
    ///
    /// Cells at `base` sides keep their height. So do those at `open` sides and `channel`s that get more than they
    /// give: it leaves the world, or joins the river. What such cells got, in metres over a cell, is added to `lost`.
    /// Heights that are no numbers, or too high for any land, are walls.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn creep(
        &self,
        job: &Job<'_>,
        heights: &mut [f64],
        step_yr: f64,
        turns: Range<u32>,
        channel: &(impl Fn(usize) -> bool + Sync),
        mut lost: Option<&mut [f64]>,
    ) -> Result<(), NodeError> {
        if self.diffusivity.constant().is_some_and(|given| diffusivity(given).max(self.least) <= 0.0) {
            return Ok(());
        }
        let directions = |turn: u32| {
            if turn.is_multiple_of(2) { [Along::Rows, Along::Columns] } else { [Along::Columns, Along::Rows] }
        };
        let sweeps: Vec<Along> = turns.flat_map(directions).collect();
        // a turn ends along the lines with which the next one begins, which are read once for both; not where mobility
        // depends on the slope across the lines too
        let together = |a: &Along, b: &Along| a == b && self.critical_slope == f64::INFINITY;
        for sweeps in sweeps.chunk_by(together) {
            self.sweep(job, heights, (step_yr, sweeps.len()), sweeps[0], channel, lost.as_deref_mut())?;
        }
        Ok(())
    }

    /// The parts of steps that are along lines of one direction: the length of a step in years, and how many.
    fn sweep(
        &self,
        job: &Job<'_>,
        heights: &mut [f64],
        (step_yr, steps): (f64, usize),
        along: Along,
        channel: &(impl Fn(usize) -> bool + Sync),
        lost: Option<&mut [f64]>,
    ) -> Result<(), NodeError> {
        let (cells, joined) = match along {
            Along::Rows => (self.nx, wraps(&self.boundary)[0]),
            Along::Columns => (self.ny, wraps(&self.boundary)[1]),
        };
        let per_diffusivity = step_yr / (self.cell_m * self.cell_m);
        let critical_m = self.critical_slope * self.cell_m;
        let steepens = critical_m < f64::INFINITY;
        let outer = if steepens { self.outer(heights, along) } else { Vec::new() };
        let bundles = self.split(heights, along);
        let mut lost = lost.map_or_else(Vec::new, |lost| self.split(lost, along));
        lost.resize_with(bundles.len(), Vec::new);
        let new = || Bundle::new(cells, joined, self.risen, critical_m);
        par::each_with(bundles.into_iter().zip(lost), new, |bundle, k, (mut heights, mut lost)| {
            job.check()?;
            let first = k * LANES;
            let lines = match along {
                Along::Rows => heights.len(),
                Along::Columns => heights.first().map_or(0, |row| row.len()),
            };
            let (given, least) = match self.diffusivity {
                Lane::Constant(given) => (None, diffusivity(given).max(self.least)),
                Lane::Samples(given) => (Some(self.part(given, along, first, lines)), self.least),
            };
            let ground =
                Ground { lines, along, diffusivity: given.as_deref(), least, per_diffusivity, outer: outer.get(k) };
            bundle.load(&heights, &ground);
            // row by row of the raster
            let [rows, columns] = if along == Along::Rows { [lines, cells] } else { [cells, lines] };
            for step in 0..steps {
                if step > 0 {
                    bundle.go_on();
                }
                for row in 0..rows {
                    for column in 0..columns {
                        let (line, i, cell) = match along {
                            Along::Rows => (row, column, (first + row) * self.nx + column),
                            Along::Columns => (column, row, row * self.nx + first + column),
                        };
                        if channel(cell) {
                            bundle.hold(line, i, Hold::Sink);
                        }
                    }
                }
                self.hold_sides(bundle, along, first, [lines, cells]);
                bundle.step();
                if !lost.is_empty() {
                    bundle.add_arriving(&mut lost, along);
                }
            }
            bundle.store(&mut heights, along);
            Ok(())
        })
    }

    /// The rows of a raster in a bundle of lines.
    fn part<'h>(&self, samples: &'h [f32], along: Along, first: usize, lines: usize) -> Vec<&'h [f32]> {
        match along {
            Along::Rows => samples[first * self.nx..][..lines * self.nx].chunks(self.nx).collect(),
            Along::Columns => samples.chunks(self.nx).map(|row| &row[first..][..lines]).collect(),
        }
    }

    /// Lets cells at sides of the world do what these ask.
    fn hold_sides(&self, bundle: &mut Bundle, along: Along, first: usize, [lines, cells]: [usize; 2]) {
        let all = if along == Along::Rows { self.ny } else { self.nx };
        for line in 0..lines {
            let outermost = [0, all - 1].contains(&(first + line));
            let step = if outermost { 1 } else { (cells - 1).max(1) };
            for i in (0..cells).step_by(step) {
                let (x, y) = if along == Along::Rows { (i, first + line) } else { (first + line, i) };
                if let Some(hold) = self.side(x, y, along) {
                    bundle.hold(line, i, hold);
                }
            }
        }
    }

    /// What a cell does because it is at a side of the world; nothing for others.
    #[inline(always)]
    fn side(&self, x: usize, y: usize, along: Along) -> Option<Hold> {
        let (first, last) = ([x == 0, y == 0], [x + 1 == self.nx, y + 1 == self.ny]);
        if !(first[0] || first[1] || last[0] || last[1]) {
            return None;
        }
        let Boundary { west, east, north, south } = self.boundary;
        let sides = [(first[0], west), (last[0], east), (first[1], north), (last[1], south)];
        if sides.contains(&(true, Edge::Base)) {
            return Some(Hold::Fixed);
        }
        let ends = if along == Along::Rows { &sides[..2] } else { &sides[2..] };
        ends.contains(&(true, Edge::Open)).then_some(Hold::Sink)
    }

    /// The lines of a direction in bundles.
    fn split<'h>(&self, samples: &'h mut [f64], along: Along) -> Vec<Lines<'h>> {
        match along {
            Along::Rows => {
                let bundles = samples.chunks_mut(self.nx * LANES);
                bundles.map(|rows| rows.chunks_mut(self.nx).collect()).collect()
            }
            Along::Columns => {
                let mut bundles: Vec<Lines<'h>> = Vec::new();
                bundles.resize_with(self.nx.div_ceil(LANES), || Vec::with_capacity(self.ny));
                for row in samples.chunks_mut(self.nx) {
                    bundles.iter_mut().zip(row.chunks_mut(LANES)).for_each(|(bundle, part)| bundle.push(part));
                }
                bundles
            }
        }
    }

    /// Copies of the lines before and behind each bundle; empty where there is none.
    fn outer(&self, heights: &[f64], along: Along) -> Vec<[Vec<f64>; 2]> {
        let (lines, joined) = match along {
            Along::Rows => (self.ny, wraps(&self.boundary)[1]),
            Along::Columns => (self.nx, wraps(&self.boundary)[0]),
        };
        let copy = |line: Option<usize>| match (line, along) {
            (None, _) => Vec::new(),
            (Some(y), Along::Rows) => heights[y * self.nx..][..self.nx].to_vec(),
            (Some(x), Along::Columns) => (0..self.ny).map(|y| heights[y * self.nx + x]).collect(),
        };
        par::collect_all((0..lines).step_by(LANES), |_, first| {
            let before = first.checked_sub(1).or(joined.then_some(lines - 1));
            let behind = if first + LANES < lines { Some(first + LANES) } else { joined.then_some(0) };
            [copy(before), copy(behind)]
        })
    }
}
