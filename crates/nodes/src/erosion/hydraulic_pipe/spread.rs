//! Spreads erosion and deposition over the width of the smallest channel.
//!
//! Water finds the lowest cell, and cutting there attracts more water: without a width, gullies are one cell wide and
//! run along the axes of the grid. The change of each sweep is therefore averaged over a bell of `width`, by passes
//! of the binomial filter that exchange it between pairs of cells, so that nothing is lost. A cell that is no higher
//! than all eight neighbours is not lowered: otherwise erosion beside a hollow would deepen it without end. Passes
//! over distant cells come first and those between neighbours last, which fill the gaps (the cascade of M.
//! Holschneider et al., 1989).

use std::ops::Range;

use orograph_graph::{Edge, Job, NodeError};

use super::{
    band::{Band, Scene, at, mobility},
    flow::{self, HIGHEST},
    physics::Physics,
};
use crate::numerics::{par, simd::simd};

/// Rows beyond a band whose change is replaced as well, for the slippage that follows.
const KEPT: isize = 2;
/// Narrower than this, in cells, erosion would follow the axes.
pub(super) const NARROWEST: f64 = 5.0;
/// Wider than this fraction of the shorter side of the world, a bell would level the world.
pub(super) const WIDEST: f64 = 0.25;
/// Width of a bell at half its height, in standard deviations: 2 √(2 ln 2).
const WIDTH_PER_DEVIATION: f64 = 2.354_820_045;

/// Returns the width in metres that a spread keeps, of one asked for: 0, or between [`NARROWEST`] and [`WIDEST`].
pub(super) fn kept_m(width_m: f64, cells: [usize; 2], cell_m: f64) -> f64 {
    let widest_m = WIDEST * cell_m * cells[0].min(cells[1]) as f64;
    if width_m > 0.0 { width_m.min(widest_m).max(NARROWEST * cell_m) } else { 0.0 }
}

/// Returns the distances of the passes that make a bell of a width in cells, within 3 %; none for 0.
///
/// A pass over a distance of s cells adds s² / 2 to the variance, and leaves gaps that a pass over s / 2 fills. So each
/// power of two up to the largest occurs, 1 twice, and the largest is that which needs the fewest passes.
pub(super) fn distances(width: f64) -> Vec<usize> {
    if width <= 0.0 {
        return Vec::new();
    }
    let deviation = width / WIDTH_PER_DEVIATION;
    let whole = (2.0 * deviation * deviation).round() as usize;
    let passes = |largest: u32| {
        let chain = 1 + (0..=largest).map(|power| 1 << (2 * power)).sum::<usize>();
        let mut left = whole.checked_sub(chain)?;
        let mut counts = vec![1; largest as usize + 1];
        counts[0] = 2;
        for power in (0..=largest).rev() {
            // the last three per cent of the variance are not worth a pass
            let count = if 33 * left > whole { left >> (2 * power) } else { 0 };
            counts[power as usize] += count;
            left -= count << (2 * power);
        }
        let passes = (0..=largest).rev().flat_map(|power| std::iter::repeat_n(1 << power, counts[power as usize]));
        Some(passes.collect::<Vec<usize>>())
    };
    (0..31).map_while(passes).min_by_key(Vec::len).unwrap_or_default()
}

/// Rasters of the passes, over the whole world.
#[derive(Debug)]
pub(super) struct Spread {
    distances: Vec<usize>,
    nx: usize,
    /// Cells before and after each row: the furthest that one pass reaches.
    pad: usize,
    /// Amount to spread, NaN where nothing may change, before a pass and after it; the second begins as the bed, NaN
    /// outside.
    rasters: [Vec<f32>; 2],
    /// 1 where a cell is no higher than all eight neighbours, 0 elsewhere.
    hollow: Vec<f32>,
}

impl Spread {
    pub fn new(scene: &Scene<'_>) -> Self {
        let [nx, ny] = scene.cells;
        let Physics { width_m, cell_m, .. } = scene.physics;
        let distances = distances(kept_m(width_m, scene.cells, cell_m) / cell_m);
        let pad = distances.iter().copied().max().unwrap_or(0);
        let stride = if pad > 0 { nx + 2 * pad } else { 0 };
        let raster = || vec![0.0; stride * ny];
        Self { distances, nx, pad, rasters: [raster(), raster()], hollow: raster() }
    }

    /// Spreads what all bands have eroded since the last call, whose halos must be known.
    pub fn run(&mut self, bands: &mut [Band], scene: &Scene<'_>, job: &Job<'_>) -> Result<(), NodeError> {
        if self.distances.is_empty() {
            return Ok(());
        }
        let Self { distances, nx, pad, rasters: [before, after], hollow } = self;
        let (nx, pad, joined) = (*nx, *pad, scene.joined());
        let stride = nx + 2 * pad;
        let (ny, boundary) = (scene.cells[1] as isize, &scene.boundary);
        let spans: Vec<Range<usize>> = bands.iter().map(Band::world_rows).collect();
        let parts = bands.iter_mut().zip(split(before, stride, &spans)).zip(split(after, stride, &spans));
        par::each(parts, |_, ((band, amounts), beds)| {
            let rows = amounts.chunks_exact_mut(stride).zip(beds.chunks_exact_mut(stride));
            for (y, (amounts, bed)) in rows.enumerate() {
                band.amounts(scene, y as isize, &mut amounts[pad..pad + nx], &mut bed[pad..pad + nx]);
                close(amounts, pad, joined[0]);
                close(bed, pad, joined[0]);
                if !joined[0] {
                    (bed[pad - 1], bed[pad + nx]) = (bed_beyond(boundary.west), bed_beyond(boundary.east));
                }
            }
            job.check()
        })?;
        let bed = &*after;
        // where a row begins that may lie beyond the world
        let start = |y: isize| inside(y, ny as usize, joined[1]) * stride;
        let [north, south] = [boundary.north, boundary.south].map(|edge| vec![bed_beyond(edge); stride]);
        par::each(split(hollow, stride, &spans), |k, part| {
            for (y, out) in part.chunks_exact_mut(stride).enumerate() {
                let y = (spans[k].start + y) as isize;
                let above = if y == 0 && !joined[1] { &north } else { &bed[start(y - 1)..][..stride] };
                let below = if y + 1 == ny && !joined[1] { &south } else { &bed[start(y + 1)..][..stride] };
                hollows(&mut out[pad..pad + nx], [above, &bed[start(y)..][..stride], below], pad);
                close(out, pad, joined[0]);
            }
            job.check()
        })?;
        for &distance in &*distances {
            let (from, hollow, by) = (&*before, &*hollow, distance as isize);
            par::each(split(after, stride, &spans), |k, part| {
                for (y, out) in part.chunks_exact_mut(stride).enumerate() {
                    let y = (spans[k].start + y) as isize;
                    let starts = [y - by, y, y + by].map(start);
                    let [amounts, hollows] =
                        [from, hollow].map(|raster| starts.map(|start| &raster[start..][..stride]));
                    average(&mut out[pad..pad + nx], amounts, hollows, distance, pad);
                    close(out, pad, joined[0]);
                }
                job.check()
            })?;
            std::mem::swap(before, after);
        }
        let spread = &*before;
        par::each(bands.iter_mut(), |_, band| {
            let rows = band.rows as isize;
            for y in -KEPT..rows + KEPT {
                let world_row = band.first as isize + y;
                if !joined[1] && !(0..ny).contains(&world_row) {
                    continue;
                }
                let spread = &spread[world_row.rem_euclid(ny) as usize * stride + pad..][..nx];
                let [change, loose, taken, ..] = &mut band.states;
                replace(change.cells_mut(at(y)), loose.cells_mut(at(y)), taken.cells_mut(at(y)), spread);
            }
            Ok(())
        })
    }
}

/// The bed beyond a side, compared with that of the cells at it: lower where water runs out, so that they are not
/// hollows.
fn bed_beyond(edge: Edge) -> f32 {
    match edge {
        Edge::Base | Edge::Open | Edge::Inland => f32::NEG_INFINITY,
        Edge::Wall | Edge::Periodic => f32::NAN,
    }
}

/// The parts of a raster that bands own.
fn split<'a>(mut raster: &'a mut [f32], stride: usize, spans: &[Range<usize>]) -> Vec<&'a mut [f32]> {
    let mut parts = Vec::with_capacity(spans.len());
    for span in spans {
        let (part, rest) = raster.split_at_mut(span.len() * stride);
        parts.push(part);
        raster = rest;
    }
    parts
}

/// Returns the cell of a side of `n` cells that stands for one beyond its ends, or itself within: from the other end in
/// a periodic world, otherwise its mirror image, with which an exchange loses nothing and smooths as well as inside.
fn inside(at: isize, n: usize, joined: bool) -> usize {
    let n = n as isize;
    let place = at.rem_euclid(if joined { n } else { 2 * n });
    (if place < n { place } else { 2 * n - 1 - place }) as usize
}

/// Fills the cells beyond both ends of a row.
fn close(row: &mut [f32], pad: usize, joined: bool) {
    let nx = row.len() - 2 * pad;
    for k in 0..pad {
        row[k] = row[pad + inside(k as isize - pad as isize, nx, joined)];
        row[pad + nx + k] = row[pad + inside((nx + k) as isize, nx, joined)];
    }
}

/// The `n` cells of a row, with those at a distance before and after each.
#[inline(always)]
fn three(row: &[f32], distance: usize, pad: usize, n: usize) -> [&[f32]; 3] {
    [&row[pad - distance..][..n], &row[pad..][..n], &row[pad + distance..][..n]]
}

simd! {
    /// Marks the cells of a row that are no higher than all eight neighbours; `beds` are the rows north, here and
    /// south.
    fn hollows(out: &mut [f32], beds: [&[f32]; 3], pad: usize) {
        let n = out.len();
        let [[north_west, north, north_east], [west, here, east], [south_west, south, south_east]] =
            beds.map(|row| three(row, 1, pad, n));
        for i in 0..n {
            let height = here[i];
            let beside = (west[i] < height) | (east[i] < height) | (north[i] < height) | (south[i] < height);
            let across = (north_west[i] < height)
                | (north_east[i] < height)
                | (south_west[i] < height)
                | (south_east[i] < height);
            out[i] = if beside | across { 0.0 } else { 1.0 };
        }
    }
}

simd! {
    /// Computes a pass over a row: each cell moves towards the eight at a distance, those at the corners with half
    /// the weight. `rows` are the eroded amounts and `hollows` the marks of hollows, north, here and south.
    fn average(out: &mut [f32], rows: [&[f32]; 3], hollows: [&[f32]; 3], distance: usize, pad: usize) {
        let n = out.len();
        let [[north_west, north, north_east], [west, row, east], [south_west, south, south_east]] =
            rows.map(|row| three(row, distance, pad, n));
        let [[low_nw, low_n, low_ne], [low_w, low, low_e], [low_sw, low_s, low_se]] =
            hollows.map(|row| three(row, distance, pad, n));
        for i in 0..n {
            let (here, hollow) = (row[i], low[i]);
            // ground moves from here to where more is eroded, but not from a hollow; NaN counts as none
            let more = |there: f32, beside: f32| {
                let more = there - here;
                if (more > 0.0) & (hollow == 0.0) | (more < 0.0) & (beside == 0.0) { more } else { 0.0 }
            };
            let beside = (more(west[i], low_w[i]) + more(east[i], low_e[i]))
                + (more(north[i], low_n[i]) + more(south[i], low_s[i]));
            let across = (more(north_west[i], low_nw[i]) + more(south_east[i], low_se[i]))
                + (more(north_east[i], low_ne[i]) + more(south_west[i], low_sw[i]));
            out[i] = here + (0.125 * beside + 0.0625 * across);
        }
    }
}

simd! {
    /// Replaces the eroded amounts by the spread ones.
    fn replace(change: &mut [f32], loose: &mut [f32], taken: &mut [f32], spread: &[f32]) {
        let n = change.len();
        let (loose, taken, spread) = (&mut loose[..n], &mut taken[..n], &spread[..n]);
        for i in 0..n {
            let back = if spread[i].is_nan() { 0.0 } else { taken[i] - spread[i] };
            change[i] += back;
            let left = loose[i] + back;
            loose[i] = if left > 0.0 { left } else { 0.0 };
            taken[i] = 0.0;
        }
    }
}

impl Band {
    /// Loads the erosion of a row since the last spread, NaN where nothing may change, and its bed.
    fn amounts(&mut self, scene: &Scene<'_>, y: isize, amounts: &mut [f32], bed: &mut [f32]) {
        let world_row = self.first + y as usize;
        let mobile = mobility(&mut self.mobile, scene, world_row);
        let land = &scene.land[world_row * self.nx..][..self.nx];
        let [change, _, taken, ..] = &self.states;
        flow::bed(bed, land, change.cells(at(y)));
        for ((out, taken), (mobile, land)) in amounts.iter_mut().zip(taken.cells(at(y))).zip(mobile.iter().zip(land)) {
            *out = if *mobile > 0.0 && land.abs() < HIGHEST { *taken } else { f32::NAN };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The bell is as wide as requested, whatever its width in cells: within 3 %, as half a pass between neighbours is
    /// 5.6 % of the variance of the narrowest. The number of passes grows with the logarithm of the width.
    #[test]
    fn a_bell_is_as_wide_as_asked() {
        for tenths in (50..=300).chain((300..20_000).step_by(77)) {
            let width = f64::from(tenths) / 10.0;
            let passes = distances(width);
            let variance: f64 = passes.iter().map(|&s| 0.5 * (s * s) as f64).sum();
            let found = variance.sqrt() * WIDTH_PER_DEVIATION;
            assert!((found / width - 1.0).abs() < 0.03, "{width}: {found} by {passes:?}");
            assert!(passes.len() as f64 <= 5.0 + 2.0 * libm::log2(width), "{width}: {passes:?}");
            assert!(
                passes.windows(2).all(|pair| pair[0] == pair[1] || pair[0] == 2 * pair[1]) && passes.ends_with(&[1])
            );
        }
        assert!(distances(0.0).is_empty());
    }

    /// Widths that cells or the world do not allow become the nearest that they do.
    #[test]
    fn widths_are_held_between_five_cells_and_a_quarter_of_the_world() {
        for (asked, kept) in [(0.0, 0.0), (1.0, 10.0), (10.0, 10.0), (33.0, 33.0), (80.0, 50.0), (1e9, 50.0)] {
            assert_eq!(kept_m(asked, [100, 120], 2.0), kept, "{asked}");
        }
        assert_eq!(kept_m(80.0, [3, 120], 2.0), 10.0);
    }

    /// What lies beyond a side is its mirror image, or the other end.
    #[test]
    fn sides_are_mirrors_or_joined() {
        let seen = |joined| (-4..7).map(|at| inside(at, 3, joined)).collect::<Vec<_>>();
        assert_eq!(seen(false), [2, 2, 1, 0, 0, 1, 2, 2, 1, 0, 0]);
        assert_eq!(seen(true), [2, 0, 1, 2, 0, 1, 2, 0, 1, 2, 0]);
    }
}
