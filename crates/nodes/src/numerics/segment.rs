//! Cells near a segment of a line.

/// A raster of the world: cells along x and y, whether opposite sides are joined, and the side of a cell in metres.
#[derive(Clone, Copy, Debug)]
pub struct Cells {
    /// Columns and rows.
    pub counts: [i64; 2],
    /// Whether opposite sides are joined, along x and y.
    pub wraps: [bool; 2],
    /// Side of a cell in metres.
    pub cell_m: f64,
}

impl Cells {
    /// Calls `visit` with the column and row of each cell whose centre may be within `reach_m` of a segment in metres
    /// from the north-west corner, with its distance from the segment in metres, and with the place of the nearest
    /// point on it from 0 to 1. In a periodic world a cell is visited once by a segment wider than the world.
    #[inline]
    pub fn near(&self, [from, to]: [[f64; 2]; 2], reach_m: f64, mut visit: impl FnMut([i64; 2], f64, f64)) {
        let Self { counts, wraps, cell_m } = *self;
        let [columns, rows] = [0, 1].map(|axis| {
            let (a, b) = (from[axis], to[axis]);
            let first = ((a.min(b) - reach_m) / cell_m - 0.5).ceil() as i64;
            let last = ((a.max(b) + reach_m) / cell_m - 0.5).floor() as i64;
            if wraps[axis] {
                first..=last.min(first.saturating_add(counts[axis] - 1))
            } else {
                first.max(0)..=last.min(counts[axis] - 1)
            }
        });
        let along = [0, 1].map(|axis| to[axis] - from[axis]);
        let square = along[0] * along[0] + along[1] * along[1];
        for j in rows {
            for i in columns.clone() {
                let off = [(i, 0), (j, 1)].map(|(at, axis)| (at as f64 + 0.5) * cell_m - from[axis]);
                let t =
                    if square > 0.0 { ((off[0] * along[0] + off[1] * along[1]) / square).clamp(0.0, 1.0) } else { 0.0 };
                let [x, y] = [off[0] - t * along[0], off[1] - t * along[1]];
                visit([i.rem_euclid(counts[0]), j.rem_euclid(counts[1])], (x * x + y * y).sqrt(), t);
            }
        }
    }
}
