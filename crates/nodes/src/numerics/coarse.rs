//! Averages a field over coarser cells and interpolates it back: for filters whose cost would grow with the radius, and
//! for [`crate::filter::resample`].
//!
//! A whole number of coarse cells fills the world along each side, so they have nearly the requested size and are
//! nearly square. Each has the mean of the area it covers, with partly covered cells weighted. Positions are relative
//! to the world's edge, so that a coarse cell is the same in every window that contains it.

use orograph_graph::{Job, NodeError, Window, memory::zeroed};

use super::lines::Ends;
use super::{math, par};

/// Interpolation between the centres of coarse cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Between {
    /// Each cell has the value of the coarse cell that contains its centre.
    Cells,
    /// Linear in both directions.
    Linear,
    /// Catmull-Rom cubic.
    Cubic,
}

/// The coarse cells of a window.
#[derive(Clone, Copy, Debug)]
pub struct Coarse {
    axes: [Axis; 2],
}

/// The coarse cells of a window along one axis.
#[derive(Clone, Copy, Debug)]
struct Axis {
    /// Cells of the window per coarse cell.
    step: f64,
    /// The first coarse cell that the window touches, counted from the world's edge.
    first: usize,
    /// Number of coarse cells that the window touches.
    count: usize,
    /// The window's first cell, counted from the world's edge.
    origin: usize,
    /// Number of cells of the window.
    cells: usize,
    ends: Ends,
}

/// Interpolation weights of a cell, with the indices of coarse cells.
struct Taps {
    places: [usize; 4],
    weights: [f64; 4],
}

impl Coarse {
    /// Creates coarse cells of about `size_cells` cells per side.
    #[must_use]
    pub fn new(window: &Window, size_cells: f64) -> Self {
        Self { axes: [0, 1].map(|axis| Axis::new(window, axis, size_cells)) }
    }

    /// Coarse cells along x and y.
    #[must_use]
    pub const fn cells(&self) -> [usize; 2] {
        [self.axes[0].count, self.axes[1].count]
    }

    /// Cells per coarse cell along x and y.
    #[must_use]
    pub const fn steps(&self) -> [f64; 2] {
        [self.axes[0].step, self.axes[1].step]
    }

    /// Returns the position of a cell of the window relative to the centres of coarse cells along an axis; 0 is the
    /// first.
    #[must_use]
    pub fn place(&self, axis: usize, cell: usize) -> f64 {
        self.axes[axis].place(cell) - 0.5
    }

    /// Returns the mean over the area of each coarse cell.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn means(&self, job: &Job<'_>, samples: &[f32]) -> Result<Vec<f32>, NodeError> {
        let [columns, rows] = &self.axes;
        let covers: Vec<Vec<(usize, f64)>> = (0..columns.count).map(|at| columns.covers(at)).collect();
        let mut means = zeroed(columns.count * rows.count)?;
        par::each(means.chunks_mut(columns.count), |at, means| {
            job.check()?;
            let mut sums = vec![0.0; columns.count];
            let mut height = 0.0;
            for (j, share) in rows.covers(at) {
                let row = &samples[j * columns.cells..][..columns.cells];
                for (sum, cover) in sums.iter_mut().zip(&covers) {
                    *sum += share * cover.iter().map(|&(i, share)| share * f64::from(row[i])).sum::<f64>();
                }
                height += share;
            }
            for ((mean, sum), cover) in means.iter_mut().zip(&sums).zip(&covers) {
                let width: f64 = cover.iter().map(|(_, share)| share).sum();
                *mean = (sum / (width * height)) as f32;
            }
            Ok::<_, NodeError>(())
        })?;
        Ok(means)
    }

    /// Interpolates the values of the coarse cells at each cell of the window. `share` is the part of the job's
    /// progress.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn spread(
        &self,
        job: &Job<'_>,
        share: [f32; 2],
        coarse: &[f32],
        between: Between,
    ) -> Result<Vec<f32>, NodeError> {
        let [columns, rows] = &self.axes;
        let taps: Vec<Taps> = (0..columns.cells).map(|i| columns.taps(i, between)).collect();
        let mut out = zeroed(columns.cells * rows.cells)?;
        par::rows_within(job, share, &mut out, |j, out| {
            let across = rows.taps(j, between);
            let line: Vec<f64> =
                (0..columns.count).map(|i| across.sum(|place| f64::from(coarse[place * columns.count + i]))).collect();
            for (out, taps) in out.iter_mut().zip(&taps) {
                *out = taps.sum(|place| line[place]) as f32;
            }
        })?;
        Ok(out)
    }
}

impl Axis {
    fn new(window: &Window, axis: usize, size_cells: f64) -> Self {
        let most = f64::from(window.world.cells[axis]);
        let step = most / (most / size_cells).round().clamp(1.0, most);
        let (origin, cells) = (window.origin[axis] as usize, window.cells[axis] as usize);
        let first = (origin as f64 / step).floor() as usize;
        let count = ((origin + cells) as f64 / step).ceil() as usize - first;
        Self { step, first, count, origin, cells, ends: Ends::of(window, axis) }
    }

    /// Returns the cells of the window that a coarse cell covers, and the covered fraction of each.
    fn covers(&self, at: usize) -> Vec<(usize, f64)> {
        let [low, high] = [0, 1].map(|end| (self.first + at + end) as f64 * self.step);
        let first = (low.floor() as usize).clamp(self.origin, self.origin + self.cells - 1);
        let end = (high.ceil() as usize).clamp(first + 1, self.origin + self.cells);
        let cover = |cell: usize| ((cell + 1) as f64).min(high) - (cell as f64).max(low);
        // rounding may leave a cell a fraction of almost 0, which must count if there is no other cell
        (first..end).map(|cell| (cell - self.origin, cover(cell).max(1e-9))).collect()
    }

    /// Returns the position of a cell's centre, in coarse cells from the edge of the first.
    fn place(&self, cell: usize) -> f64 {
        ((self.origin + cell) as f64 + 0.5) / self.step - self.first as f64
    }

    fn taps(&self, cell: usize, between: Between) -> Taps {
        let at = self.place(cell) - if between == Between::Cells { 0.0 } else { 0.5 };
        let left = at.floor();
        let t = at - left;
        Taps {
            places: [-1, 0, 1, 2].map(|k| self.ends.index(left as i64 + k, self.count)),
            weights: match between {
                Between::Cells => [0.0, 1.0, 0.0, 0.0],
                Between::Linear => [0.0, 1.0 - t, t, 0.0],
                Between::Cubic => math::catmull_rom(t),
            },
        }
    }
}

impl Taps {
    fn sum(&self, value: impl Fn(usize) -> f64) -> f64 {
        let [a, b, c, d] = [0, 1, 2, 3].map(|k| self.weights[k] * value(self.places[k]));
        (a + b) + (c + d)
    }
}
