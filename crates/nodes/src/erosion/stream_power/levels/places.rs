//! Where the cells of a level are on the level below it, and what the coarser raster has there.

use orograph_graph::{Edge, Window};

use crate::erosion::stream_power::inland;

/// The cells of a level with its margin.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// The world on the level's cells, without the margin.
    pub inner: Window,
    /// All cells.
    pub outer: Window,
    /// Columns in the west and rows in the north that the margin adds.
    pub before: [usize; 2],
}

/// The way from the cells of a level to those of a coarser one.
#[derive(Clone, Copy, Debug)]
pub struct Places {
    from: Frame,
    to: Frame,
    periodic: [bool; 2],
}

/// The 16 coarse cells around a place, and their weights along both axes.
#[derive(Clone, Copy, Debug)]
pub struct Around {
    columns: [usize; 4],
    rows: [usize; 4],
    weights: [[f64; 4]; 2],
    nx: usize,
}

impl Places {
    /// The places of the cells of `to` on those of `from`, which are larger.
    #[must_use]
    pub fn new(from: Frame, to: Frame) -> Self {
        let sides = from.inner.world.boundary;
        Self { from, to, periodic: [sides.west, sides.north].map(|edge| edge == Edge::Periodic) }
    }

    /// The place of a cell's centre: column and row, whole numbers at the centres of the coarse cells.
    #[must_use]
    pub fn of(&self, x: usize, y: usize) -> [f64; 2] {
        [self.along(0, x), self.along(1, y)]
    }

    fn along(&self, axis: usize, at: usize) -> f64 {
        let larger = f64::from(self.to.inner.cells[axis]) / f64::from(self.from.inner.cells[axis]);
        (at as f64 + 0.5 - self.to.before[axis] as f64) / larger + self.from.before[axis] as f64 - 0.5
    }

    /// The coarse cell that a cell lies in.
    #[must_use]
    pub fn cell(&self, x: usize, y: usize) -> usize {
        let [column, row] = [(0, x), (1, y)].map(|(axis, at)| {
            let last = self.from.outer.cells[axis] as usize - 1;
            ((self.along(axis, at) + 0.5).max(0.0) as usize).min(last)
        });
        row * self.from.outer.nx() + column
    }

    /// How far a place is from the nearest side that is not joined, in coarse cells.
    #[must_use]
    pub fn side_distance(&self, place: [f64; 2]) -> f64 {
        let [x, y] = [0, 1].map(|axis| {
            let count = f64::from(self.from.outer.cells[axis]);
            if self.periodic[axis] { f64::INFINITY } else { (place[axis] + 0.5).min(count - 0.5 - place[axis]) }
        });
        x.min(y)
    }

    /// What is around a place.
    #[must_use]
    pub fn around(&self, place: [f64; 2]) -> Around {
        let taps = |axis: usize| {
            let count = self.from.outer.cells[axis] as isize;
            let first = place[axis].floor();
            let columns = [-1, 0, 1, 2].map(|step| {
                let at = first as isize + step;
                (if self.periodic[axis] { at.rem_euclid(count) } else { at.clamp(0, count - 1) }) as usize
            });
            (columns, cubic(place[axis] - first))
        };
        let ((columns, across), (rows, down)) = (taps(0), taps(1));
        Around { columns, rows, weights: [across, down], nx: self.from.outer.nx() }
    }

    /// The cells at base level of `inland` sides: for each gate of the coarse level the lowest cell of its stretch.
    #[must_use]
    pub fn gates(&self, coarse: &[u32], heights: &[f32]) -> Vec<u32> {
        let (nx, ny) = (self.to.outer.nx(), self.to.outer.ny());
        let mut lowest = std::collections::BTreeMap::<usize, u32>::new();
        for (side, is_inland) in inland::sides(&self.to.outer.world).into_iter().enumerate() {
            let cells = if !is_inland {
                0
            } else if side < 2 {
                ny
            } else {
                nx
            };
            for at in 0..cells {
                let (x, y) = [(0, at), (nx - 1, at), (at, 0), (at, ny - 1)][side];
                let (cell, under) = ((y * nx + x) as u32, self.cell(x, y));
                if coarse.binary_search(&(under as u32)).is_ok() {
                    let found = lowest.entry(under).or_insert(cell);
                    if heights[cell as usize] < heights[*found as usize] {
                        *found = cell;
                    }
                }
            }
        }
        let mut gates: Vec<u32> = lowest.into_values().collect();
        gates.sort_unstable();
        gates
    }
}

impl Around {
    /// The nearest cell.
    #[must_use]
    pub fn nearest(&self) -> usize {
        let [column, row] = self.weights.map(|weights| if weights[1] < weights[2] { 2 } else { 1 });
        self.rows[row] * self.nx + self.columns[column]
    }

    /// A cubic (Catmull and Rom 1974) through the samples of a coarse raster, kept between the four nearest: an
    /// overshoot at the foot of a mountain front would be a row of pits.
    #[inline(always)]
    pub fn cubic(&self, sample: impl Fn(usize) -> f64) -> f64 {
        let mut sum = 0.0;
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for (j, &row) in self.rows.iter().enumerate() {
            let mut along = 0.0;
            for (i, &column) in self.columns.iter().enumerate() {
                let value = sample(row * self.nx + column);
                along += self.weights[0][i] * value;
                if (i == 1 || i == 2) && (j == 1 || j == 2) {
                    low = low.min(value);
                    high = high.max(value);
                }
            }
            sum += self.weights[1][j] * along;
        }
        sum.max(low).min(high)
    }
}

/// Weights of four samples in a row at a share of the way from the second to the third.
fn cubic(t: f64) -> [f64; 4] {
    let (square, cube) = (t * t, t * t * t);
    [
        0.5 * (2.0 * square - cube - t),
        0.5 * (3.0 * cube - 5.0 * square + 2.0),
        0.5 * (4.0 * square - 3.0 * cube + t),
        0.5 * (cube - square),
    ]
}
