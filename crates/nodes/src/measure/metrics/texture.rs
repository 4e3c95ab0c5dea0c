//! Roughness at the scale of cells, plane patches, and positions above the surroundings.

use super::{Land, put};
use crate::{
    numerics::{math, par},
    prelude::*,
};
use orograph_graph::{Axis, Series};

/// Radii at which positions are measured, as fractions of `local_window`; the second is reported as a number.
const RADII: [f64; 3] = [0.04, 0.2, 0.8];
/// Square of the tangent of the slope, 15°, from which a patch may be plane.
const STEEP_2: f64 = 0.071_796_769_724_490_8;
/// The root mean square distance from its plane, as a fraction of its drop, below which a patch is plane.
const PLANE: f64 = 0.01;
/// The fewest patches.
const ENOUGH: f64 = 500.0;

/// Sums over windows of 3 x 3 and 5 x 5 cells.
#[derive(Clone, Copy, Default)]
struct Sums {
    /// Windows of 3 x 3 cells.
    cells: f64,
    /// Squared difference from the mean of nine cells, and of eight neighbours from the cell.
    detail: f64,
    ruggedness: f64,
    /// One less the length of the mean of the unit normals (Sappington et al. 2007).
    vectors: f64,
    /// Powers one to three of the Laplacian times the squared cell size.
    laplacian: [f64; 3],
    /// Steep patches of 5 x 5 cells, and those that are plane.
    patches: f64,
    plane: f64,
}

impl Sums {
    fn plus(mut self, other: &Self) -> Self {
        self.cells += other.cells;
        self.detail += other.detail;
        self.ruggedness += other.ruggedness;
        self.vectors += other.vectors;
        (0..3).for_each(|k| self.laplacian[k] += other.laplacian[k]);
        self.patches += other.patches;
        self.plane += other.plane;
        self
    }

    /// Adds the cell in the middle of 5 x 5 heights, relative to it, with the sum of the nine unit normals around it.
    fn add(&mut self, patch: &[[f64; 5]; 5], normal: [f64; 3], cell_m: f64) {
        let (mut sum, mut squares) = (0.0, 0.0);
        for row in &patch[1..4] {
            for z in &row[1..4] {
                sum += z;
                squares += z * z;
            }
        }
        let mean = sum / 9.0;
        let laplacian = patch[1][2] + patch[3][2] + patch[2][1] + patch[2][3];
        self.cells += 1.0;
        self.detail += mean * mean;
        self.ruggedness += squares.sqrt();
        let mut power = 1.0;
        for moment in &mut self.laplacian {
            power *= laplacian;
            *moment += power;
        }
        self.vectors += 1.0 - normal.iter().map(|n| n * n).sum::<f64>().sqrt() / 9.0;
        self.patch(patch, cell_m);
    }

    /// Compares a patch with its plane.
    fn patch(&mut self, patch: &[[f64; 5]; 5], cell_m: f64) {
        let (mut sum, mut squares, mut east, mut south) = (0.0, 0.0, 0.0, 0.0);
        for (j, row) in patch.iter().enumerate() {
            for (i, z) in row.iter().enumerate() {
                sum += z;
                squares += z * z;
                east += z * (i as f64 - 2.0) / 50.0;
                south += z * (j as f64 - 2.0) / 50.0;
            }
        }
        let gradient = (east * east + south * south) / (cell_m * cell_m);
        if gradient <= STEEP_2 {
            return;
        }
        let mean = sum / 25.0;
        let rest = (squares / 25.0 - mean * mean - 2.0 * (east * east + south * south)).max(0.0);
        self.patches += 1.0;
        let drop = 4.0 * cell_m;
        self.plane += f64::from(u8::from(rest < PLANE * PLANE * gradient * drop * drop));
    }
}

/// `slope_p50` is the median slope in degrees.
pub(super) fn measure(land: &Land<'_>, slope_p50: f64, report: &mut Report) {
    let (nx, ny, cell_m) = (land.nx(), land.ny(), land.cell_m());
    let rows: Vec<usize> = (2..ny.saturating_sub(2)).collect();
    let found = par::collect_all(rows, |_, j| {
        let mut sums = Sums::default();
        let rows: [&[f32]; 5] = std::array::from_fn(|k| &land.samples()[(j + k - 2) * nx..][..nx]);
        let normals = normals(&rows, cell_m);
        for i in 2..nx.saturating_sub(2) {
            let centre = f64::from(rows[2][i]);
            let patch: [[f64; 5]; 5] =
                std::array::from_fn(|k| std::array::from_fn(|l| f64::from(rows[k][i + l - 2]) - centre));
            // NaN if any height is
            let whole: f64 = patch.iter().flatten().sum();
            if whole.is_finite() {
                let normal = std::array::from_fn(|axis| (i - 1..i + 2).map(|i| normals[i][axis]).sum());
                sums.add(&patch, normal, cell_m);
            }
        }
        sums
    });
    let sums = found.iter().fold(Sums::default(), Sums::plus);
    let mean = |sum: f64| sum / sums.cells;
    let gradient = math::tan(slope_p50.to_radians());
    put(report, "roughness.two_cells", mean(sums.detail).sqrt() / (gradient * cell_m));
    put(report, "roughness.ruggedness", mean(sums.ruggedness));
    put(report, "roughness.vectors", mean(sums.vectors));
    let [first, second, third] = sums.laplacian.map(mean);
    let variance = second - first * first;
    let skew = (third - 3.0 * first * second + 2.0 * first * first * first) / (variance * variance.sqrt());
    put(report, "roughness.laplacian_skew", skew);
    put(report, "planar_share", if sums.patches >= ENOUGH { sums.plane / sums.patches } else { f64::NAN });
}

/// The sums of the unit normals of the three middle rows of five, by columns; 0 in the outermost.
fn normals(rows: &[&[f32]; 5], cell_m: f64) -> Vec<[f64; 3]> {
    let mut sums = vec![[0.0; 3]; rows[0].len()];
    let per_m = 0.5 / cell_m;
    for j in 1..4 {
        let last = sums.len() - 1;
        for (i, sum) in sums.iter_mut().enumerate().take(last).skip(1) {
            let east = (f64::from(rows[j][i + 1]) - f64::from(rows[j][i - 1])) * per_m;
            let south = (f64::from(rows[j + 1][i]) - f64::from(rows[j - 1][i])) * per_m;
            let up = 1.0 / (1.0 + east * east + south * south).sqrt();
            *sum = [sum[0] + east * up, sum[1] + south * up, sum[2] + up];
        }
    }
    sums
}

/// The root mean square of heights above the mean of a square around them (Weiss 2001), by its half side.
pub(super) fn positions(land: &Land<'_>, window_m: f64, report: &mut Report) {
    let mut curve = Vec::new();
    for (at, share) in RADII.into_iter().enumerate() {
        let radius = (share * window_m / land.cell_m()).round().max(1.0) as usize;
        let position = position(land, radius);
        let radius_m = radius as f64 * land.cell_m();
        if at == 1 {
            put(report, "position.radius", radius_m);
            put(report, "position.rms", position);
        }
        if position.is_finite() && curve.last().is_none_or(|last: &[f64; 2]| last[0] < radius_m) {
            curve.push([radius_m, position]);
        }
    }
    report.series.push(Series {
        name: "position".to_owned(),
        x: Axis::new("radius", "m", curve.iter().map(|point| point[0]).collect()),
        y: Axis::new("height above the surroundings, root mean square", "m", curve.iter().map(|p| p[1]).collect()),
    });
}

/// The root mean square of the position of all cells whose window lies within the terrain.
fn position(land: &Land<'_>, radius: usize) -> f64 {
    let (nx, ny) = (land.nx(), land.ny());
    let side = 2 * radius + 1;
    if nx < side || ny < side {
        return f64::NAN;
    }
    // sums and counts along rows of each cell's window
    let width = nx - 2 * radius;
    let rows = par::collect_all(land.samples().chunks(nx), |_, row| {
        let value = |i: usize| if row[i].is_finite() { (f64::from(row[i]), 1.0) } else { (0.0, 0.0) };
        let mut sum = (0..side).map(value).fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
        let mut sums = Vec::with_capacity(width);
        for i in 0..width {
            sums.push([sum.0 as f32, sum.1 as f32]);
            if i + side < nx {
                let (new, old) = (value(i + side), value(i));
                sum = (sum.0 + new.0 - old.0, sum.1 + new.1 - old.1);
            }
        }
        sums
    });
    let columns: Vec<usize> = (0..width).step_by(512).collect();
    let parts = par::collect_all(columns, |_, first| {
        let columns = first..(first + 512).min(width);
        let mut sums = vec![[0.0_f64; 2]; columns.len()];
        let (mut square, mut count) = (0.0, 0.0);
        for j in 0..ny {
            for (sum, i) in sums.iter_mut().zip(columns.clone()) {
                let new = rows[j][i].map(f64::from);
                let old = if j >= side { rows[j - side][i].map(f64::from) } else { [0.0; 2] };
                *sum = [sum[0] + new[0] - old[0], sum[1] + new[1] - old[1]];
                let z = if j + 1 >= side { land.samples()[(j - radius) * nx + i + radius] } else { f32::NAN };
                if z.is_finite() {
                    let above = f64::from(z) - sum[0] / sum[1];
                    square += above * above;
                    count += 1.0;
                }
            }
        }
        [square, count]
    });
    let [square, count] = parts.iter().fold([0.0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
    (square / count).sqrt()
}
