//! Roughness at the scale of cells, plane patches, and positions above the surroundings.

use super::{Land, put};
use crate::{
    numerics::{math, par, simd::simd},
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

    /// Adds the cells of a row.
    fn add(&mut self, row: &Row, cell_m: f64) {
        let drop = 4.0 * cell_m;
        for at in 0..row.sum.len() {
            // NaN if any height around the cell is
            if !row.sum[at].is_finite() {
                continue;
            }
            self.cells += 1.0;
            self.detail += row.mean[at] * row.mean[at];
            self.ruggedness += row.ruggedness[at];
            let mut power = 1.0;
            for moment in &mut self.laplacian {
                power *= row.laplacian[at];
                *moment += power;
            }
            self.vectors += row.bend[at];
            let gradient = row.gradient[at];
            if gradient > STEEP_2 {
                self.patches += 1.0;
                self.plane += f64::from(u8::from(row.rest[at] < PLANE * PLANE * gradient * drop * drop));
            }
        }
    }
}

/// What is computed of each cell of a row but the two outermost at each side.
struct Row {
    /// Sum of the 25 heights around the cell, relative to it.
    sum: Vec<f64>,
    /// Mean of the nine nearest heights, relative to the cell, and root of the sum of their squares.
    mean: Vec<f64>,
    ruggedness: Vec<f64>,
    laplacian: Vec<f64>,
    /// One less the length of the mean of the nine unit normals.
    bend: Vec<f64>,
    /// Squared gradient of the plane through the patch of 25, and the mean squared distance from it.
    gradient: Vec<f64>,
    rest: Vec<f64>,
}

impl Row {
    fn new(cells: usize) -> Self {
        let [sum, mean, ruggedness, laplacian, bend, gradient, rest] = [(); 7].map(|()| vec![0.0; cells]);
        Self { sum, mean, ruggedness, laplacian, bend, gradient, rest }
    }

    /// Computes it from five rows of heights and the sums of the unit normals of the three middle ones.
    fn fill(&mut self, rows: &[&[f32]; 5], normals: &[Vec<f64>; 3], cell_m: f64) {
        let [_, b, c, d, _] = *rows;
        near(b, c, d, &mut self.mean, &mut self.ruggedness, &mut self.laplacian);
        let [east, south, up] = normals;
        bend(east, south, up, &mut self.bend);
        far(rows, cell_m * cell_m, &mut self.sum, &mut self.gradient, &mut self.rest);
    }
}

simd! {
    /// Mean and ruggedness of nine heights and the Laplacian of five, relative to the middle.
    fn near(b: &[f32], c: &[f32], d: &[f32], mean: &mut [f64], ruggedness: &mut [f64], laplacian: &mut [f64]) {
        let n = mean.len();
        let (b, c, d) = (&b[..n + 4], &c[..n + 4], &d[..n + 4]);
        let (ruggedness, laplacian) = (&mut ruggedness[..n], &mut laplacian[..n]);
        for i in 0..n {
            let centre = f64::from(c[i + 2]);
            let (mut sum, mut squares) = (0.0, 0.0);
            let heights = [
                b[i + 1], b[i + 2], b[i + 3], c[i + 1], c[i + 2], c[i + 3], d[i + 1], d[i + 2], d[i + 3],
            ];
            for z in heights {
                let z = f64::from(z) - centre;
                sum += z;
                squares += z * z;
            }
            mean[i] = sum / 9.0;
            ruggedness[i] = squares.sqrt();
            laplacian[i] = (f64::from(b[i + 2]) - centre)
                + (f64::from(d[i + 2]) - centre)
                + (f64::from(c[i + 1]) - centre)
                + (f64::from(c[i + 3]) - centre);
        }
    }
}

simd! {
    /// One less the length of the mean of nine unit normals, from the sums along columns.
    fn bend(east: &[f64], south: &[f64], up: &[f64], bend: &mut [f64]) {
        let n = bend.len();
        let (east, south, up) = (&east[..n + 4], &south[..n + 4], &up[..n + 4]);
        for i in 0..n {
            let along = |sums: &[f64]| sums[i + 1] + sums[i + 2] + sums[i + 3];
            let [x, y, z] = [along(east), along(south), along(up)];
            bend[i] = 1.0 - (x * x + y * y + z * z).sqrt() / 9.0;
        }
    }
}

simd! {
    /// The plane through 25 heights: their sum, its squared gradient, and the mean squared distance from it.
    fn far(rows: &[&[f32]; 5], square_m: f64, sum: &mut [f64], gradient: &mut [f64], rest: &mut [f64]) {
        let n = sum.len();
        let rows = rows.map(|row| &row[..n + 4]);
        let (gradient, rest) = (&mut gradient[..n], &mut rest[..n]);
        for i in 0..n {
            let centre = f64::from(rows[2][i + 2]);
            let (mut total, mut squares, mut east, mut south) = (0.0, 0.0, 0.0, 0.0);
            for (j, row) in rows.iter().enumerate() {
                for k in 0..5 {
                    let z = f64::from(row[i + k]) - centre;
                    // a share of the gradient; twice it is exact
                    let share = z / 50.0;
                    total += z;
                    squares += z * z;
                    east += share * (k as f64 - 2.0);
                    south += share * (j as f64 - 2.0);
                }
            }
            let mean = total / 25.0;
            sum[i] = total;
            gradient[i] = (east * east + south * south) / square_m;
            rest[i] = (squares / 25.0 - mean * mean - 2.0 * (east * east + south * south)).max(0.0);
        }
    }
}

simd! {
    /// Adds the unit normals of a row to sums, from the rows beside it. The outermost cells have none.
    fn normals(north: &[f32], own: &[f32], beyond: &[f32], per_m: f64, east: &mut [f64], south: &mut [f64], up: &mut [f64]) {
        let n = own.len();
        let (north, beyond) = (&north[..n], &beyond[..n]);
        let (east, south, up) = (&mut east[..n], &mut south[..n], &mut up[..n]);
        for i in 1..n - 1 {
            let x = (f64::from(own[i + 1]) - f64::from(own[i - 1])) * per_m;
            let y = (f64::from(beyond[i]) - f64::from(north[i])) * per_m;
            let z = 1.0 / (1.0 + x * x + y * y).sqrt();
            east[i] += x * z;
            south[i] += y * z;
            up[i] += z;
        }
    }
}

/// `slope_p50` is the median slope in degrees.
pub(super) fn measure(land: &Land<'_>, slope_p50: f64, report: &mut Report) {
    let (nx, ny, cell_m) = (land.nx(), land.ny(), land.cell_m());
    let width = nx.saturating_sub(4);
    let rows: Vec<usize> = if width == 0 { Vec::new() } else { (2..ny.saturating_sub(2)).collect() };
    let found = par::collect_all(rows, |_, j| {
        let mut sums = Sums::default();
        let rows: [&[f32]; 5] = std::array::from_fn(|k| &land.samples()[(j + k - 2) * nx..][..nx]);
        let mut columns = [(); 3].map(|()| vec![0.0; nx]);
        let [east, south, up] = &mut columns;
        for at in 1..4 {
            normals(rows[at - 1], rows[at], rows[at + 1], 0.5 / cell_m, east, south, up);
        }
        let mut row = Row::new(width);
        row.fill(&rows, &columns, cell_m);
        sums.add(&row, cell_m);
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
    report.series.push(Series::new(
        "position",
        Axis::new("radius", "m", curve.iter().map(|point| point[0]).collect()),
        Axis::new("height above the surroundings, root mean square", "m", curve.iter().map(|p| p[1]).collect()),
    ));
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
