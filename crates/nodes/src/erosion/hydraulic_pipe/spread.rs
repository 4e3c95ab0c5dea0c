//! Spreads erosion and deposition over the width of the smallest channel.
//!
//! Water finds the lowest cell, and cutting there attracts more water: without a width, gullies are one cell wide and
//! run along the axes of the grid. The change of each sweep is therefore averaged over a bell of `width`, by passes
//! of the binomial filter that exchange it between pairs of cells, so that nothing is lost. A cell that is no higher
//! than all eight neighbours is not lowered: otherwise erosion beside a hollow would deepen it without end. Passes
//! over distant cells come first and those between neighbours last, which fill the gaps (the cascade of M.
//! Holschneider et al., 1989).

use orograph_graph::{Job, NodeError};

use super::{
    band::{Band, HALO, Scene, at, mobility},
    flow::{self, HIGHEST},
};
use crate::numerics::simd::simd;

/// Cells that all passes together reach.
const REACH: usize = 16;
/// Rows beyond a band that are spread as well, for the slippage that follows.
const KEPT: isize = (HALO - REACH - 1) as isize;
/// The furthest that one pass reaches: cells before and after each row.
const FURTHEST: usize = 4;
/// Narrower than this, in cells, erosion would follow the axes.
const NARROWEST: f64 = 5.0;
/// Width of a bell at half its height, in standard deviations: 2 √(2 ln 2).
const WIDTH_PER_DEVIATION: f64 = 2.354_820_045;

/// Returns the distances of the passes that make a bell of a width in cells, as close as [`REACH`] allows; none for
/// 0.
///
/// A pass over a distance of s cells adds s² / 2 to the variance.
pub(super) fn distances(width: f64) -> Vec<usize> {
    if width <= 0.0 {
        return Vec::new();
    }
    let deviation = width.max(NARROWEST) / WIDTH_PER_DEVIATION;
    let variance = deviation * deviation;
    let near = (2.0 * variance).round();
    if near <= REACH as f64 {
        return vec![1; near as usize];
    }
    // two passes between neighbours, and of those over 4 cells as few as reach far enough
    let twos = |fours: usize| (0.5 * (variance - 1.0 - 8.0 * fours as f64)).round().max(1.0);
    let fits = |fours: &usize| 4.0 * *fours as f64 + 2.0 * twos(*fours) + 2.0 <= REACH as f64;
    let (fours, twos) = (0..3).find(fits).map_or((3, 1), |fours| (fours, twos(fours) as usize));
    [vec![4; fours], vec![2; twos], vec![1; 2]].concat()
}

/// Rasters of the passes.
#[derive(Debug)]
pub(super) struct Spread {
    distances: Vec<usize>,
    stride: usize,
    /// Amount to spread, NaN where nothing may change, before a pass and after it.
    rasters: [Vec<f32>; 2],
    /// The bed, NaN outside.
    bed: Vec<f32>,
    /// 1 where a cell is no higher than all eight neighbours, 0 elsewhere.
    hollow: Vec<f32>,
}

impl Spread {
    pub fn new(scene: &Scene<'_>, nx: usize, rows: usize) -> Self {
        let distances = distances(scene.physics.width_m / scene.physics.cell_m);
        let stride = nx + 2 * FURTHEST;
        let samples = if distances.is_empty() { 0 } else { stride * (rows + 2 * HALO) };
        Self {
            distances,
            stride,
            rasters: [vec![0.0; samples], vec![0.0; samples]],
            bed: vec![0.0; samples],
            hollow: vec![0.0; samples],
        }
    }
}

/// Fills the cells beyond both ends of a row: from the other end in a periodic world, otherwise with NaN.
fn close(row: &mut [f32], joined: bool) {
    let nx = row.len() - 2 * FURTHEST;
    for k in 0..FURTHEST {
        let (before, after) = (nx * FURTHEST + k - FURTHEST, k);
        row[k] = if joined { row[FURTHEST + before % nx] } else { f32::NAN };
        row[FURTHEST + nx + k] = if joined { row[FURTHEST + after % nx] } else { f32::NAN };
    }
}

/// The `n` cells of a row, with those at a distance before and after each.
#[inline(always)]
fn three(row: &[f32], distance: usize, n: usize) -> [&[f32]; 3] {
    [&row[FURTHEST - distance..][..n], &row[FURTHEST..][..n], &row[FURTHEST + distance..][..n]]
}

simd! {
    /// Marks the cells of a row that are no higher than all eight neighbours; `beds` are the rows north, here and
    /// south.
    fn hollows(out: &mut [f32], beds: [&[f32]; 3]) {
        let n = out.len();
        let [[north_west, north, north_east], [west, here, east], [south_west, south, south_east]] =
            beds.map(|row| three(row, 1, n));
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
    fn average(out: &mut [f32], rows: [&[f32]; 3], hollows: [&[f32]; 3], distance: usize) {
        let n = out.len();
        let [[north_west, north, north_east], [west, row, east], [south_west, south, south_east]] =
            rows.map(|row| three(row, distance, n));
        let [[low_nw, low_n, low_ne], [low_w, low, low_e], [low_sw, low_s, low_se]] =
            hollows.map(|row| three(row, distance, n));
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
    /// Spreads the erosion since the last call. The rows of the halo must be known.
    pub fn spread(&mut self, scene: &Scene<'_>, job: &Job<'_>) -> Result<(), NodeError> {
        if self.spread.distances.is_empty() {
            return Ok(());
        }
        let (rows, halo) = (self.rows as isize, HALO as isize);
        for y in -halo..rows + halo {
            self.taken_row(scene, y);
        }
        let Spread { distances, stride, rasters: [before, after], bed, hollow } = &mut self.spread;
        let stride = *stride;
        let mut more = halo - 1;
        for y in -more..rows + more {
            let beds = [y - 1, y, y + 1].map(|y| &bed[at(y) * stride..][..stride]);
            let out = &mut hollow[at(y) * stride..][..stride];
            hollows(&mut out[FURTHEST..stride - FURTHEST], beds);
            close(out, scene.joined()[0]);
        }
        for &distance in &*distances {
            job.check()?;
            more -= distance as isize;
            for y in -more..rows + more {
                let rows = [y - distance as isize, y, y + distance as isize];
                let [rows, hollows] =
                    [&*before, &*hollow].map(|raster| rows.map(|y| &raster[at(y) * stride..][..stride]));
                let out = &mut after[at(y) * stride..][..stride];
                average(&mut out[FURTHEST..stride - FURTHEST], rows, hollows, distance);
                close(out, scene.joined()[0]);
            }
            std::mem::swap(before, after);
        }
        for y in -KEPT..rows + KEPT {
            let spread = &before[at(y) * stride + FURTHEST..][..self.nx];
            let [change, loose, taken, ..] = &mut self.states;
            replace(change.cells_mut(at(y)), loose.cells_mut(at(y)), taken.cells_mut(at(y)), spread);
        }
        Ok(())
    }

    /// Loads the erosion of a row, and its bed.
    fn taken_row(&mut self, scene: &Scene<'_>, y: isize) {
        let Spread { stride, rasters: [raster, _], bed, .. } = &mut self.spread;
        let row = &mut raster[at(y) * *stride..][..*stride];
        let bed = &mut bed[at(y) * *stride..][..*stride];
        let inside = (0..scene.cells[1] as isize).contains(&(self.first as isize + y)) || scene.joined()[1];
        if !inside {
            row.fill(f32::NAN);
            bed.fill(f32::NAN);
            return;
        }
        let world_row = (self.first as isize + y).rem_euclid(scene.cells[1] as isize) as usize;
        let mobile = mobility(&mut self.mobile, scene, world_row);
        let land = &scene.land[world_row * self.nx..][..self.nx];
        let [change, _, taken, ..] = &self.states;
        flow::bed(&mut bed[FURTHEST..FURTHEST + self.nx], land, change.cells(at(y)));
        close(bed, scene.joined()[0]);
        let cells = row[FURTHEST..].iter_mut().zip(taken.cells(at(y))).zip(mobile.iter().zip(land));
        for ((out, taken), (mobile, land)) in cells {
            *out = if *mobile > 0.0 && land.abs() < HIGHEST { *taken } else { f32::NAN };
        }
        close(row, scene.joined()[0]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The bell is as wide as requested, within 8 %, and all passes reach the halo at most.
    #[test]
    fn a_bell_is_as_wide_as_asked() {
        for tenths in 50..=122 {
            let width = f64::from(tenths) / 10.0;
            let passes = distances(width);
            let variance: f64 = passes.iter().map(|&s| 0.5 * (s * s) as f64).sum();
            let found = variance.sqrt() * WIDTH_PER_DEVIATION;
            assert!((found / width - 1.0).abs() < 0.08, "{width}: {found} by {passes:?}");
            assert!(passes.iter().sum::<usize>() <= REACH);
        }
        assert!(distances(0.0).is_empty());
        assert_eq!(distances(1.0), distances(NARROWEST));
        assert_eq!(distances(1e9), distances(13.0));
    }
}
