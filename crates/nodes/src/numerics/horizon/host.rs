//! Horizons on the CPU: blocks of cells, whose tangents stay in registers for all samples of a direction.

use std::ops::Range;

use orograph_graph::{
    Field, Job, NodeError, Window,
    memory::{OutOfMemory, filled},
};

use super::{Look, Rays, STEEPEST, sigma};
use crate::numerics::{
    gaussian::Gaussian,
    lines::{Ends, separable},
    par,
    simd::simd,
};

/// Cells of a block.
pub(super) const LANES: usize = 64;

/// Terrain for which horizons are computed.
///
/// Ask for parts of the raster, direction by direction: then most of what is read is still in the first cache.
#[derive(Debug)]
pub struct Horizon<'a> {
    height: &'a [f32],
    /// The terrain of each smoothing level, with margins at the west and east sides: what is beyond a side that is not
    /// periodic is infinitely low.
    lands: Vec<Vec<f32>>,
    margin: usize,
    rays: Vec<Ray>,
    window: Window,
    wrap: [bool; 2],
}

/// The samples of a direction.
#[derive(Debug)]
struct Ray {
    looks: Vec<Look>,
    /// Where the cells of each sample are, relative to that of the horizon.
    offsets: Vec<[isize; 2]>,
    /// Ranges of samples with their smoothing level.
    runs: Vec<(usize, Range<usize>)>,
}

impl<'a> Horizon<'a> {
    /// Prepares a field's first plane. `share` is the part of the job's progress.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn new(job: &Job<'_>, share: [f32; 2], height: &'a Field, rays: Rays) -> Result<Self, NodeError> {
        let window = *height.window();
        let wrap = [0, 1].map(|axis| Ends::of(&window, axis) == Ends::Wrap);
        let margin = rays.margin(&window);
        let levels = rays.levels();
        let part = (share[1] - share[0]) / levels.max(1) as f32;
        let mut lands = vec![padded(height.plane(0), window.nx(), margin, wrap[0])?];
        for level in 1..=levels {
            let from = share[0] + part * (level - 1) as f32;
            let smoothed = separable(job, [from, from + part], height.plane(0), &Gaussian::new(sigma(level)))?;
            lands.push(padded(&smoothed, window.nx(), margin, wrap[0])?);
        }
        let stride = (window.nx() + 2 * margin) as i64;
        let rays = rays.rays.into_iter().map(|looks| Ray {
            offsets: looks
                .iter()
                .map(|look| [look.first, look.second].map(|[x, y]| (y * stride + x) as isize))
                .collect(),
            runs: runs(&looks),
            looks,
        });
        Ok(Self { height: height.plane(0), lands, margin, rays: rays.collect(), window, wrap })
    }

    /// Returns the number of directions.
    #[must_use]
    pub fn rays(&self) -> usize {
        self.rays.len()
    }

    /// Computes the tangent of the horizon's elevation angle in one direction, for columns of row `j`; 0 where no
    /// terrain is higher than the cell. There is no terrain beyond the sides of the world, unless it is periodic.
    pub fn tangents(&self, ray: usize, j: usize, columns: Range<usize>, out: &mut [f32]) {
        raise(self, &self.rays[ray], [columns.start, j], &mut out[..columns.len()]);
    }

    /// Cells from one row of a land to the next.
    fn stride(&self) -> usize {
        self.window.nx() + 2 * self.margin
    }

    /// Returns true if the lands have all cells that a sample reads for a block.
    fn has(&self, look: &Look, [i, j]: [usize; 2]) -> bool {
        let [x, y] = [0, 1].map(|axis| [look.first[axis], look.second[axis]]);
        let [i, j] = [(i + self.margin) as i64, j as i64];
        i + x[0].min(x[1]) >= 0
            && i + x[0].max(x[1]) + LANES as i64 <= self.stride() as i64
            && j + y[0].min(y[1]) >= 0
            && j + y[0].max(y[1]) < self.window.ny() as i64
    }

    /// Copies the cells that a sample reads for a block. Those beyond a side that is not periodic are infinitely low;
    /// returns false if all are.
    fn copy(&self, level: usize, place: [usize; 2], shift: [i64; 2], out: &mut [f32; LANES]) -> bool {
        let [nx, ny] = [self.window.nx(), self.window.ny()].map(|count| count as i64);
        let [from, row] = [0, 1].map(|axis| place[axis] as i64 + shift[axis]);
        let row = if self.wrap[1] { row.rem_euclid(ny) } else { row };
        if !(0..ny).contains(&row) {
            return false;
        }
        let row = &self.lands[level][row as usize * self.stride()..][..self.stride()];
        let at = usize::try_from(from + self.margin as i64).ok();
        if let Some(cells) = at.and_then(|at| row.get(at..at + LANES)) {
            out.copy_from_slice(cells);
            return true;
        }
        let row = &row[self.margin..][..nx as usize];
        if self.wrap[0] {
            let (mut at, mut rest) = (from.rem_euclid(nx) as usize, &mut out[..]);
            while !rest.is_empty() {
                let count = rest.len().min(row.len() - at);
                let (part, others) = rest.split_at_mut(count);
                part.copy_from_slice(&row[at..at + count]);
                (at, rest) = (0, others);
            }
            return true;
        }
        let inside = from.clamp(0, nx)..(from + LANES as i64).clamp(0, nx);
        if inside.is_empty() {
            return false;
        }
        out.fill(f32::NEG_INFINITY);
        let lanes = (inside.start - from) as usize..(inside.end - from) as usize;
        out[lanes].copy_from_slice(&row[inside.start as usize..inside.end as usize]);
        true
    }

    /// Raises tangents of a block to those of samples, some of which are beyond the lands.
    #[inline(never)]
    fn raise_beyond(&self, looks: &[Look], place: [usize; 2], own: &[f32; LANES], tangents: &mut [f32; LANES]) {
        let mut cells = [[0.0; LANES]; 2];
        for look in looks {
            let [first, second] = &mut cells;
            let is_there = self.copy(look.level, place, look.first, first);
            if is_there && look.share == 0.0 {
                see(tangents, own, first, look);
            } else if is_there && self.copy(look.level, place, look.second, second) {
                see(tangents, own, &between(first, second, look.share), look);
            } else if self.wrap == [false; 2] {
                return;
            }
        }
    }
}

/// A raster with margins at the west and east sides.
fn padded(samples: &[f32], nx: usize, margin: usize, wraps: bool) -> Result<Vec<f32>, OutOfMemory> {
    let stride = nx + 2 * margin;
    let mut out = filled(samples.len() / nx * stride, f32::NEG_INFINITY)?;
    par::all(out.chunks_mut(stride).zip(samples.chunks(nx)), |_, (out, row)| {
        out[margin..margin + nx].copy_from_slice(row);
        if wraps {
            let at = |cell: usize| row[(cell + (nx - margin % nx)) % nx];
            out[..margin].iter_mut().enumerate().for_each(|(cell, out)| *out = at(cell));
            out[margin + nx..].iter_mut().enumerate().for_each(|(cell, out)| *out = row[cell % nx]);
        }
    });
    Ok(out)
}

/// Ranges of samples of one level, which ascend.
fn runs(looks: &[Look]) -> Vec<(usize, Range<usize>)> {
    let mut start = 0;
    let runs = looks.chunk_by(|a, b| a.level == b.level).map(|looks| {
        let range = start..start + looks.len();
        start = range.end;
        (looks[0].level, range)
    });
    runs.collect()
}

simd! {
    /// Computes the tangents of the cells of a row from a place, column and row, on.
    fn raise(horizon: &Horizon<'_>, ray: &Ray, place: [usize; 2], out: &mut [f32]) {
        let [start, j] = place;
        let own = &horizon.height[j * horizon.window.nx() + start..][..out.len()];
        let last = start + out.len().saturating_sub(1) / LANES * LANES;
        let is_inside = ray.looks.last().is_none_or(|look| horizon.has(look, place) && horizon.has(look, [last, j]));
        let (own, own_rest) = own.as_chunks();
        let (out, rest) = out.as_chunks_mut();
        let mut at = start;
        for (out, own) in out.iter_mut().zip(own) {
            *out = raised(horizon, ray, [at, j], own, is_inside);
            at += LANES;
        }
        if !rest.is_empty() {
            let mut levels = [0.0; LANES];
            levels[..own_rest.len()].copy_from_slice(own_rest);
            let count = rest.len();
            rest.copy_from_slice(&raised(horizon, ray, [at, j], &levels, is_inside)[..count]);
        }
    }
}

/// The tangents of a block of cells at a place. `is_inside` says that the lands have all cells that are read.
#[inline(always)]
fn raised(horizon: &Horizon<'_>, ray: &Ray, place: [usize; 2], own: &[f32; LANES], is_inside: bool) -> [f32; LANES] {
    let looks = &ray.looks;
    // samples go farther and farther
    let inside = if is_inside { looks.len() } else { looks.partition_point(|look| horizon.has(look, place)) };
    let here = (place[1] * horizon.stride() + horizon.margin + place[0]) as isize;
    let own = *own;
    let mut near = [0.0; LANES];
    for (level, range) in &ray.runs {
        let land = &horizon.lands[*level][..];
        let range = range.start.min(inside)..range.end.min(inside);
        for (look, offsets) in looks[range.clone()].iter().zip(&ray.offsets[range]) {
            let [first, second] = offsets.map(|offset| (here + offset) as usize);
            let Some(first) = land.get(first..).and_then(|land| land.first_chunk()) else { continue };
            if look.share == 0.0 {
                see(&mut near, &own, first, look);
            } else if let Some(second) = land.get(second..).and_then(|land| land.first_chunk()) {
                see(&mut near, &own, &between(first, second, look.share), look);
            }
        }
    }
    // a copy, because a call could not take tangents that are in registers
    let mut tangents = near;
    if inside < looks.len() {
        horizon.raise_beyond(&looks[inside..], place, &own, &mut tangents);
    }
    for tangent in &mut tangents {
        *tangent = if *tangent < STEEPEST { *tangent } else { STEEPEST };
    }
    tangents
}

/// Terrain between two cells.
#[inline(always)]
fn between(first: &[f32; LANES], second: &[f32; LANES], share: f32) -> [f32; LANES] {
    let mut heights = [0.0; LANES];
    for lane in 0..LANES {
        heights[lane] = first[lane] + (second[lane] - first[lane]) * share;
    }
    heights
}

/// Raises the tangents of a block to those of a sample.
#[inline(always)]
fn see(tangents: &mut [f32; LANES], own: &[f32; LANES], heights: &[f32; LANES], look: &Look) {
    for lane in 0..LANES {
        let seen = (heights[lane] - own[lane]) * look.per_m;
        tangents[lane] = if seen > tangents[lane] { seen } else { tangents[lane] };
    }
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Boundary, Edge, World};

    use super::*;
    use crate::{numerics::math, prelude::*, testing};

    inputs! {
        /// Terrain height.
        height: Height;
    }

    /// Tangents sample by sample and cell by cell.
    fn reference(horizon: &Horizon<'_>, ray: usize, [i, j]: [usize; 2]) -> f32 {
        let [nx, ny] = [horizon.window.nx() as i64, horizon.window.ny() as i64];
        let height = |look: &Look, shift: [i64; 2]| {
            let [x, y] = [i as i64 + shift[0], j as i64 + shift[1]];
            let [x, y] = [
                if horizon.wrap[0] { x.rem_euclid(nx) } else { x },
                if horizon.wrap[1] { y.rem_euclid(ny) } else { y },
            ];
            let is_inside = (0..nx).contains(&x) && (0..ny).contains(&y);
            is_inside.then(|| horizon.lands[look.level][y as usize * horizon.stride() + horizon.margin + x as usize])
        };
        let own = horizon.height[j * nx as usize + i];
        let seen = horizon.rays[ray].looks.iter().filter_map(|look| {
            let (first, second) = (height(look, look.first)?, height(look, look.second)?);
            Some((first + (second - first) * look.share - own) * look.per_m)
        });
        seen.fold(0.0, f32::max).min(STEEPEST)
    }

    fn compare(job: &Job<'_>) -> Result<Outputs, NodeError> {
        let height = Inputs::read(job)?.height;
        let rays =
            Rays::new((0..16).map(|k| 22.5 * f64::from(k) + 1.0).chain([0.0, 90.0, 225.0]), 3000.0, job.world(), 0.1);
        let horizon = Horizon::new(job, [0.0, 1.0], height, rays)?;
        let (nx, ny) = (job.window().nx(), job.window().ny());
        let mut found = vec![0.0; nx];
        for ray in 0..horizon.rays() {
            for j in 0..ny {
                for part in [0..nx, nx / 3..nx] {
                    horizon.tangents(ray, j, part.clone(), &mut found);
                    for (tangent, i) in found.iter().zip(part) {
                        assert_eq!(
                            *tangent,
                            reference(&horizon, ray, [i, j]),
                            "{nx} x {ny}, direction {ray}, {i}, {j}"
                        );
                    }
                }
            }
        }
        Ok(Outputs::default())
    }

    /// Narrow and wide worlds, whose sides are open or periodic, with distances beyond the margins and beyond the world.
    #[test]
    fn blocks_give_what_single_cells_do() {
        for (nx, ny) in [(1, 9), (40, 30), (200, 24), (700, 5)] {
            for [x, y] in
                [[Edge::Open; 2], [Edge::Periodic, Edge::Open], [Edge::Open, Edge::Periodic], [Edge::Periodic; 2]]
            {
                let boundary = Boundary { west: x, east: x, north: y, south: y };
                let world = World { boundary, ..testing::world(nx, ny, 10.0) };
                let height = testing::field(world, |x, y| 90.0 * math::sin(x / 37.0) * math::cos(y / 23.0) + x % 70.0);
                let node = Node { cpu: compare, inputs: Inputs::PORTS, ..Node::DEFAULT };
                testing::outputs(&node, &ParamValues::default(), &[("height", &height)]).expect("equal tangents");
            }
        }
    }
}
