//! The same land on cells twice as large, and the way back.
//!
//! Inputs are restricted by their mean. What happened to the land on the coarse cells comes back as a change of height,
//! interpolated by a cubic (Catmull and Rom 1974) and added to the land as it was on the fine cells, so that its detail
//! stays. The cubic is kept between the four values around it: an overshoot at the foot of a mountain front would be a
//! row of pits.

use orograph_graph::{Edge, InputValue, Value, Warnings, World};

use crate::{
    numerics::{
        par,
        routing::{Grid, Outlet},
    },
    prelude::*,
};

/// Weights of four samples in a row at a quarter of the way from the second to the third.
const CUBIC: [f64; 4] = [-0.070_312_5, 0.867_187_5, 0.226_562_5, -0.023_437_5];

/// A raster of cells twice as large, with its inputs.
pub struct Coarse {
    window: Window,
    inputs: Vec<InputValue>,
    grid: Grid,
    fine: Grid,
    periodic: [bool; 2],
}

impl Coarse {
    /// The raster below that of a job, where it has at least `fewest` cells along each side.
    ///
    /// # Errors
    /// When the world has no outlet.
    pub fn below(job: &Job<'_>, fewest: u32) -> Result<Option<Self>, NodeError> {
        let fine = job.window();
        let cells = fine.cells.map(|cells| cells.div_ceil(2));
        if cells.iter().any(|&cells| cells < fewest) {
            return Ok(None);
        }
        let cell_m = 2.0 * fine.cell_m();
        let world = World { size: cells.map(|cells| f64::from(cells) * cell_m), cells, ..fine.world };
        let window = Window::whole(world);
        let sides = fine.world.boundary;
        let (grid, fine) = (Grid::new(&window)?, Grid::new(&fine)?);
        let inputs = job.node.inputs.iter().zip(&job.inputs).map(|(input, value)| match value {
            InputValue::Value(Value::Field(field)) => {
                let keep_base = input.name == "height";
                let samples = restrict(&grid, &fine, field.samples(), keep_base);
                InputValue::Value(Value::Field(Field::new(window, samples)))
            }
            other => other.clone(),
        });
        let inputs = inputs.collect();
        let periodic = [sides.west, sides.north].map(|edge| edge == Edge::Periodic);
        Ok(Some(Self { window, inputs, grid, fine, periodic }))
    }

    /// The same job on the coarse cells; it warns nobody.
    #[must_use]
    pub fn job<'a>(&self, job: &'a Job<'_>) -> Job<'a> {
        Job {
            node: job.node,
            params: job.params,
            inputs: self.inputs.clone(),
            window: self.window,
            wanted: job.wanted,
            folder: job.folder.clone(),
            cancel: job.cancel.clone(),
            progress: job.progress,
            level: orograph_graph::LevelJob::default(),
            warnings: Warnings::default(),
            glimpses: None,
        }
    }

    /// Fine land from what it was and the coarse land before and after. Cells at base level move with their coarse
    /// cell.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn corrected(
        &self,
        job: &Job<'_>,
        fine: &[f32],
        before: &[f32],
        mut after: Vec<f64>,
    ) -> Result<Vec<f64>, NodeError> {
        par::change_with(&mut after, before, |after, before| *after -= f64::from(*before));
        let change = after;
        let (nx, coarse_nx) = (self.fine.nx, self.grid.nx);
        let mut heights: Vec<f64> = par::map_of(fine, |&height| f64::from(height));
        let corrected = par::each(heights.chunks_mut(nx), |y, heights| {
            job.check()?;
            let (rows, row_weights) = taps(y, self.grid.ny, self.periodic[1]);
            let row = rows.map(|y| &change[y * coarse_nx..(y + 1) * coarse_nx]);
            let border = self.fine.is_border_row(y);
            for (x, height) in heights.iter_mut().enumerate() {
                let side = border || x == 0 || x + 1 == nx;
                if side && self.fine.outlet(x, y) == Outlet::Base {
                    *height += change[y / 2 * coarse_nx + x / 2];
                    continue;
                }
                let (columns, weights) = taps(x, coarse_nx, self.periodic[0]);
                let along = |row: &[f64]| {
                    let [a, b, c, d] = columns.map(|x| row[x]);
                    a * weights[0] + b * weights[1] + c * weights[2] + d * weights[3]
                };
                let smooth = along(row[0]) * row_weights[0]
                    + along(row[1]) * row_weights[1]
                    + along(row[2]) * row_weights[2]
                    + along(row[3]) * row_weights[3];
                let [a, b, c, d] = [row[1][columns[1]], row[1][columns[2]], row[2][columns[1]], row[2][columns[2]]];
                *height += smooth.max(a.min(b).min(c.min(d))).min(a.max(b).max(c.max(d)));
            }
            Ok(())
        });
        corrected.map(|()| heights)
    }
}

/// The four coarse samples around a fine one along an axis, and their weights.
fn taps(at: usize, count: usize, periodic: bool) -> ([usize; 4], [f64; 4]) {
    // The centre of an even cell is a quarter before that of its coarse cell, of an odd one a quarter after it.
    let odd = at % 2 == 1;
    let first = (at / 2) as isize - if odd { 1 } else { 2 };
    let place = |step: isize| {
        let at = first + step;
        if periodic { at.rem_euclid(count as isize) as usize } else { at.clamp(0, count as isize - 1) as usize }
    };
    let [a, b, c, d] = CUBIC;
    ([0, 1, 2, 3].map(place), if odd { CUBIC } else { [d, c, b, a] })
}

/// Means of two by two cells, fewer at the end of odd rows and columns. Where water leaves a coarse cell at base level,
/// `keep_base` takes only cells that are at base level.
fn restrict(grid: &Grid, fine: &Grid, samples: &[f32], keep_base: bool) -> Vec<f32> {
    let mean = |cell: usize| {
        let (x, y) = (cell % grid.nx, cell / grid.nx);
        let side = grid.is_border_row(y) || x == 0 || x + 1 == grid.nx;
        let only_base = keep_base && side && grid.outlet(x, y) == Outlet::Base;
        let (mut sum, mut count) = (0.0, 0.0);
        for y in 2 * y..(2 * y + 2).min(fine.ny) {
            for x in 2 * x..(2 * x + 2).min(fine.nx) {
                if !only_base || fine.outlet(x, y) == Outlet::Base {
                    sum += f64::from(samples[y * fine.nx + x]);
                    count += 1.0;
                }
            }
        }
        (sum / count) as f32
    };
    par::map(grid.cells(), mean)
}

#[cfg(test)]
mod tests {
    use orograph_graph::Boundary;

    use super::*;
    use crate::{
        erosion::stream_power::{Inputs, NODE},
        testing,
    };

    /// Runs a kernel on a world.
    fn run(world: World, cpu: orograph_graph::Kernel) {
        let height = testing::field(world, |x, y| 3.0 * x - y);
        let node = Node { cpu, inputs: NODE.inputs, params: NODE.params, ..Node::DEFAULT };
        testing::outputs(&node, &ParamValues::defaults(&NODE.specs()), &[("height", &height)]).expect("a result");
    }

    #[test]
    fn means_keep_places_and_a_plane_comes_back_as_it_was() {
        run(testing::world(131, 178, 10.0), |job| {
            let coarse = Coarse::below(job, 64)?.expect("enough cells");
            assert_eq!((coarse.window.cells, coarse.window.cell_m()), ([66, 89], 20.0));
            let [fine, before] = [job, &coarse.job(job)].map(|job| Inputs::read(job).expect("inputs").height.clone());
            assert_eq!(before.samples()[66 + 1], 3.0 * 30.0 - 30.0);
            let change = |x: f64, y: f64| 7.0 + 0.25 * x - 0.5 * y;
            let after = (0..66 * 89).map(|cell| {
                let [x, y] = coarse.window.centre_m(cell % 66, cell / 66);
                f64::from(before.samples()[cell]) + change(x, y)
            });
            let found = coarse.corrected(job, fine.samples(), before.samples(), after.collect()).expect("heights");
            for (cell, found) in found.iter().enumerate() {
                let (i, j) = (cell % 131, cell / 131);
                let inner = (3..127).contains(&i) && (3..174).contains(&j);
                let [x, y] = fine.window().centre_m(i, j);
                let error = found - f64::from(fine.samples()[cell]) - change(x, y);
                assert!(!inner || error.abs() < 1e-9, "{i} {j}: {error}");
            }
            // Cells at base level move with their coarse cell.
            assert!((found[0] - f64::from(fine.samples()[0]) - change(10.0, 10.0)).abs() < 1e-9);
            Ok(Outputs::default())
        });
    }

    #[test]
    fn periodic_sides_meet() {
        let boundary = Boundary { west: Edge::Periodic, east: Edge::Periodic, ..Boundary::default() };
        run(World { boundary, ..testing::world(128, 128, 10.0) }, |job| {
            let coarse = Coarse::below(job, 64)?.expect("enough cells");
            let zero = vec![0.0_f32; 64 * 64];
            let after = (0..64 * 64).map(|cell| f64::from(u8::from(cell % 64 == 0))).collect();
            let found = coarse.corrected(job, &vec![0.0; 128 * 128], &zero, after).expect("heights");
            let row = &found[64 * 128..65 * 128];
            assert_eq!((row[126], row[0], row[1], row[2]), (0.0, row[1], row[0], row[127]));
            assert!(row[127] > 0.2);
            Ok(Outputs::default())
        });
    }
}
