//! The bilateral filter: a Gaussian of the distance times one of the difference in value.

use std::ops::Range;

use orograph_graph::memory::copied;

use super::mix;
use crate::numerics::{coarse::Coarse, lines::Ends, par};
use crate::{
    numerics::{math::lane, simd::simd},
    prelude::*,
};

params! {
    /// Distance of the smoothing: the standard deviation of a Gaussian of the distance.
    radius: f64 = 200.0, Metres, 0.0..=1e6, soft 0..=2000;
    /// How different values may be and still be mixed: the standard deviation of a Gaussian of their difference.
    ///
    /// In the unit of the input.
    contrast: f64 = 50.0, One, 1e-4..=1e9, soft 1..=500;
}

inputs! {
    /// Field to smooth.
    value: AnyScalar;
    /// Strength of the smoothing: full at 1, none at 0.
    mask: Mask = 1.0, 0.0..=1.0;
}

outputs! {
    /// The smoothed values, with the meaning of the input.
    value: SameAs(value);
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Bilateral",
    category: "filter",
    summary: "Smooths slopes and plains while keeping cliffs and crests sharp.",
    doc: include_str!("bilateral.md"),
    sources: &[
        "C. Tomasi and R. Manduchi (1998), Bilateral filtering for gray and color images, International Conference on Computer \
         Vision, 839-846",
        "S. Paris and F. Durand (2009), A fast approximation of the bilateral filter using a signal processing approach, \
         International Journal of Computer Vision 81, 24-52",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::Metres(|params, cell_m| {
        let radius_m = Params::read(params).radius;
        // a coarse cell is at most half a radius, and the cell itself is read too
        if radius_m < LEAST * cell_m { 0.0 } else { (CUT + 1.0) * radius_m + 2.0 * cell_m }
    }),
    cpu: run,
    example: "value: \"base\", radius: 600, contrast: 120",
    ..Node::DEFAULT
};

/// Radius of the kernel, in units of `radius`.
const CUT: f64 = 2.5;
/// Largest radius in cells that is computed at full resolution.
const FINE: f64 = 3.0;
/// Largest radius in coarse cells; exceeded only where the world is a single coarse cell and all values are equal.
const WIDE: f64 = 4.5;
/// Additional weight of the cell's own value, which keeps outliers that differ from all other values.
const ALONE: f32 = 1e-12;
/// Radius in cells below which the weight of a neighbour is below 1e-6.
const LEAST: f64 = 0.2;

/// Rows per task.
const BAND: usize = 64;
/// Maximum number of rows of a block of cells that is computed at once.
const ROWS: usize = 16;
/// Cells of such a block: few enough for the first-level cache.
const CELLS: usize = 2048;

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let Inputs { value, mask } = Inputs::read(job)?;
    let params = Params::read(job.params);
    let window = job.window();
    let radius = params.radius / job.cell_m();
    if radius < LEAST {
        return Ok(Given { value: Some(value.clone()) }.into());
    }
    let coarse = Coarse::new(&window, (radius / FINE).max(1.0));
    let means = coarse.means(job, value.samples())?;
    job.advance(0.1)?;
    let around = Around::new(&coarse, &window, &means, radius);
    let per_contrast = (0.5_f64.sqrt() / params.contrast) as f32;
    let mut out = copied(value.samples())?;
    crate::numerics::par::bands_within(job, [0.1, 0.9], BAND, &mut out, |first, rows| {
        around.smooth(first, rows, per_contrast);
        Ok(())
    })?;
    mix(job, value.samples(), &mut out, mask)?;
    Ok(Given { value: Some(Field::new(window, out)) }.into())
}

/// Coarse values and spatial weights for the cells of a window.
struct Around {
    /// Coarse values with a halo.
    values: Vec<f32>,
    width: usize,
    /// For each column of the window, the first coarse column of its kernel (halo included) and the weights from there
    /// on: one list per offset, so that a row is a loop over columns.
    columns: Axis,
    rows: Axis,
}

/// Coarse cells within the kernel, for the cells of a window along an axis.
struct Axis {
    /// The first coarse cell of each kernel.
    first: Vec<usize>,
    /// The weights of the first coarse cell for all cells, of the second for all cells, ...
    weights: Vec<f32>,
}

/// Returns the number of coarse cells in the kernel on either side of the centre.
fn side(step: f64, radius: f64) -> usize {
    (CUT * radius.min(WIDE * step) / step).ceil() as usize
}

impl Axis {
    /// Computes the kernels along an axis; `margin` is the number of halo cells before the first coarse cell of the
    /// window.
    fn new(coarse: &Coarse, axis: usize, cells: usize, radius: f64, margin: usize) -> Self {
        let step = coarse.steps()[axis];
        let radius = radius.min(WIDE * step);
        let side = side(step, radius);
        let count = 2 * side + 1;
        let places: Vec<f64> = (0..cells).map(|cell| coarse.place(axis, cell)).collect();
        let first: Vec<usize> =
            places.iter().map(|place| (place.round() as i64 + (margin - side) as i64) as usize).collect();
        let mut weights = Vec::with_capacity(count * cells);
        for k in 0..count {
            weights.extend(places.iter().zip(&first).map(|(place, &first)| {
                let off = ((first + k) as f64 - margin as f64 - place) * step / radius;
                crate::numerics::math::exp(-0.5 * off * off) as f32
            }));
        }
        Self { first, weights }
    }
}

impl Around {
    fn new(coarse: &Coarse, window: &Window, means: &[f32], radius: f64) -> Self {
        let [nx, ny] = coarse.cells();
        let ends = [0, 1].map(|axis| Ends::of(window, axis));
        let margins = coarse.steps().map(|step| side(step, radius) + 1);
        let width = nx + 2 * margins[0];
        let mut values = vec![0.0; width * (ny + 2 * margins[1])];
        par::all(values.chunks_mut(width), |j, out| {
            let row = &means[ends[1].index(j as i64 - margins[1] as i64, ny) * nx..][..nx];
            for (i, out) in out.iter_mut().enumerate() {
                *out = row[ends[0].index(i as i64 - margins[0] as i64, nx)];
            }
        });
        let axis = |axis: usize, cells| Axis::new(coarse, axis, cells, radius, margins[axis]);
        Self { values, width, columns: axis(0, window.nx()), rows: axis(1, window.ny()) }
    }

    /// Smooths rows of the window from row `first` on.
    fn smooth(&self, first: usize, rows: &mut [f32], per_contrast: f32) {
        let nx = self.columns.first.len();
        let mut block = Block::default();
        let mut from = 0;
        while from < rows.len() / nx {
            // rows that use the same coarse rows
            let coarse = self.rows.first[first + from];
            let same = self.rows.first[first + from..first + rows.len() / nx].iter().take_while(|at| **at == coarse);
            let end = from + same.take(ROWS).count();
            // a multiple of the vector length
            let width = (CELLS / (end - from)).next_multiple_of(64);
            for start in (0..nx).step_by(width) {
                let columns = start..nx.min(start + width);
                self.mix(&mut block, &mut rows[from * nx..end * nx], first + from, columns, per_contrast);
            }
            from = end;
        }
    }

    /// Smooths columns of rows of the window, from row `first` on, which use the same coarse rows.
    fn mix(&self, block: &mut Block, rows: &mut [f32], first: usize, columns: Range<usize>, per_contrast: f32) {
        let nx = self.columns.first.len();
        let (width, height) = (columns.len(), rows.len() / nx);
        block.cells.clear();
        rows.chunks_exact(nx).for_each(|row| block.cells.extend_from_slice(&row[columns.clone()]));
        for (list, value) in [(&mut block.sums, 0.0), (&mut block.totals, ALONE)] {
            list.clear();
            list.resize(width * height, value);
        }
        block.others.resize(width, 0.0);
        let Block { cells, sums, totals, others } = block;
        for (k, across) in self.rows.weights.chunks_exact(self.rows.first.len()).enumerate() {
            let line = &self.values[(self.rows.first[first] + k) * self.width..][..self.width];
            for (k, along) in self.columns.weights.chunks_exact(nx).enumerate() {
                take(others, &line[k..], &self.columns.first[columns.clone()]);
                add(
                    [sums, totals],
                    cells,
                    others,
                    [&along[columns.clone()], &across[first..first + height]],
                    per_contrast,
                );
            }
        }
        let means = block.sums.chunks_exact(width).zip(block.totals.chunks_exact(width));
        for (row, (sums, totals)) in rows.chunks_exact_mut(nx).zip(means) {
            for ((value, sum), total) in row[columns.clone()].iter_mut().zip(sums).zip(totals) {
                *value += sum / total;
            }
        }
    }
}

/// Cells that are computed at once, row by row.
#[derive(Default)]
struct Block {
    cells: Vec<f32>,
    sums: Vec<f32>,
    totals: Vec<f32>,
    /// One coarse value for each column.
    others: Vec<f32>,
}

/// Gathers the values of a line at the given places.
fn take(out: &mut [f32], line: &[f32], places: &[usize]) {
    let (first, last) = (places[0], places[places.len() - 1]);
    if last - first + 1 == places.len() {
        out.copy_from_slice(&line[first..=last]);
        return;
    }
    for (out, &place) in out.iter_mut().zip(places) {
        *out = line[place];
    }
}

simd! {
    /// Adds one coarse value to the sums of each cell: weighted differences, and weights.
    fn add(sums: [&mut [f32]; 2], cells: &[f32], others: &[f32], weights: [&[f32]; 2], per_contrast: f32) {
        let ([sums, totals], [along, across]) = (sums, weights);
        let width = others.len();
        let rows = sums.chunks_exact_mut(width).zip(totals.chunks_exact_mut(width)).zip(cells.chunks_exact(width));
        for (((sums, totals), cells), &across) in rows.zip(across) {
            let places = sums.iter_mut().zip(totals).zip(cells).zip(others).zip(along);
            for ((((sum, total), &cell), &other), &weight) in places {
                let difference = other - cell;
                let off = (difference * per_contrast).clamp(-9.0, 9.0);
                let weight = across * weight * lane::exp(-off * off);
                *sum += weight * difference;
                *total += weight;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        numerics::math,
        testing::{at_every_level, field, reach_m, run as result, run_in, with_params, world},
    };

    /// Reference: the sum over all cells within six radii.
    fn brute_force(land: &Field, radius_m: f64, contrast: f64, at: [i64; 2]) -> f64 {
        let window = land.window();
        let value = |[i, j]: [i64; 2]| {
            let [i, j] =
                [(i, 0), (j, 1)].map(|(at, axis)| Ends::of(window, axis).index(at, window.cells[axis] as usize));
            f64::from(land.samples()[j * window.nx() + i])
        };
        let reach = (6.0 * radius_m / window.cell_m()) as i64;
        let (mut sum, mut weights) = (0.0, 0.0);
        for dj in -reach..=reach {
            for di in -reach..=reach {
                let square = (di * di + dj * dj) as f64 * window.cell_m() * window.cell_m();
                let other = value([at[0] + di, at[1] + dj]);
                let difference = (other - value(at)) / contrast;
                let weight = math::exp(-0.5 * (square / (radius_m * radius_m) + difference * difference));
                sum += weight * other;
                weights += weight;
            }
        }
        sum / weights
    }

    /// Rough terrain with a cliff: at full resolution values beyond 2.5 radii are missing, on coarse cells detail below
    /// a third of a radius.
    #[test]
    fn values_are_near_the_sum_over_all_cells() {
        let land = field(world(120, 90, 5.0), |x, y| {
            let bumps = 6.0 * libm::sin(x * 0.3) * libm::cos(y * 0.25) + 3.0 * libm::sin(x * 0.9 + y * 0.7);
            bumps + 0.1 * x + if x + 0.3 * y > 300.0 { 120.0 } else { 0.0 }
        });
        for (radius, tolerance) in [(9.0, 0.4), (15.0, 0.4), (40.0, 1.2), (90.0, 1.2)] {
            let params = with_params(&NODE, &format!("radius={radius},contrast=20"));
            let found = result(&NODE, &params, &[("value", &land)], "value");
            for at in [[3, 4], [60, 45], [47, 20], [52, 60], [119, 89], [80, 10]] {
                let expected = brute_force(&land, radius, 20.0, at);
                let found = f64::from(found.samples()[(at[1] * 120 + at[0]) as usize]);
                assert!((found - expected).abs() < tolerance, "{radius} {at:?}: {found} {expected}");
            }
        }
    }

    /// A wall of ten contrasts stays in place; flat terrain keeps its bits.
    #[test]
    fn walls_stay() {
        let wall = field(world(60, 20, 5.0), |x, _| if x < 150.0 { 812.3 } else { 1312.3 });
        for radius in [8.0, 60.0] {
            let params = with_params(&NODE, &format!("radius={radius},contrast=50"));
            let found = result(&NODE, &params, &[("value", &wall)], "value");
            assert!(found.samples().iter().zip(wall.samples()).all(|(a, b)| (a - b).abs() < 1e-3), "{radius}");
        }
    }

    #[test]
    fn nothing_changes_without_a_radius_or_a_mask() {
        let hills = field(world(40, 9, 5.0), |x, y| libm::sin(x * y));
        assert_eq!(result(&NODE, &with_params(&NODE, "radius=0"), &[("value", &hills)], "value"), hills);
        let nowhere = field(world(40, 9, 5.0), |_, _| 0.0);
        assert_eq!(result(&NODE, &with_params(&NODE, ""), &[("value", &hills), ("mask", &nowhere)], "value"), hills);
    }

    #[test]
    fn windows_and_widths_of_vectors_give_the_same_bits() {
        let hills = field(world(150, 140, 5.0), |x, y| 300.0 * libm::sin(x * 0.05 + y * 0.02) * libm::cos(y * 0.3));
        for radius in [7.0, 45.0, 160.0] {
            let params = with_params(&NODE, &format!("radius={radius}"));
            let whole = result(&NODE, &params, &[("value", &hills)], "value");
            let part = Window { origin: [83, 77], cells: [40, 30], ..*hills.window() };
            let grown = hills.crop(&part.grown(reach_m(&NODE, &params, 5.0)));
            assert_eq!(result(&NODE, &params, &[("value", &grown)], "value").crop(&part), whole.crop(&part));
            at_every_level(|| run_in(2, &NODE, &params, &[("value", &hills)]));
        }
    }
}
