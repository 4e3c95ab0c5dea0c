//! The coarse grid of values that a fitted field interpolates, and what is compared at it.

use std::fmt::Write as _;

use orograph_graph::Field;
use orograph_nodes::numerics::gradient::{Method, Surface};

/// Values of a grid to the shortest wavelength of the field.
const PER_WAVELENGTH: f64 = 2.0;

/// A grid of values over the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Grid {
    /// Values along x and y.
    pub(super) values: [usize; 2],
    size_m: [f64; 2],
}

impl Grid {
    /// The grid whose values a field of this wavelength interpolates.
    pub(super) fn new(size_m: [f64; 2], wavelength_m: f64) -> Self {
        let values = size_m.map(|side| (PER_WAVELENGTH * side / wavelength_m).round().max(1.0) as usize);
        Self { values, size_m }
    }

    /// Number of values.
    pub(super) const fn len(&self) -> usize {
        self.values[0] * self.values[1]
    }

    /// The mean of a map over the cells around each value.
    pub(super) fn means(&self, map: &[f32], [nx, ny]: [usize; 2]) -> Vec<f64> {
        let mut sums = vec![[0.0; 2]; self.len()];
        let place = |at: usize, cells: usize, values: usize| (2 * at + 1) * values / (2 * cells);
        for (at, value) in map.iter().enumerate() {
            let column = place(at % nx, nx, self.values[0]);
            let row = place(at / nx, ny, self.values[1]);
            let sum = &mut sums[row * self.values[0] + column];
            *sum = [sum[0] + f64::from(*value), sum[1] + 1.0];
        }
        sums.iter().map(|[sum, count]| sum / count).collect()
    }

    /// The values as an ESRI ASCII grid, which anyone can read and compare.
    pub(super) fn as_text(&self, values: &[f32]) -> String {
        let [columns, rows] = self.values;
        let [dx, dy] = [self.size_m[0] / columns as f64, self.size_m[1] / rows as f64];
        let mut text = format!("ncols {columns}\nnrows {rows}\nxllcorner 0\nyllcorner 0\n");
        // Ignored: writing to a string has no error.
        let _ = if dx == dy { writeln!(text, "cellsize {dx}") } else { writeln!(text, "dx {dx}\ndy {dy}") };
        text.push_str("nodata_value -3e38\n");
        for row in values.chunks(columns) {
            let row: Vec<String> = row.iter().map(f32::to_string).collect();
            text.push_str(&row.join(" "));
            text.push('\n');
        }
        text
    }
}

/// The tangents of slopes.
pub(super) fn slopes(height: &Field) -> Vec<f32> {
    let surface = Surface::new(height, Method::Central);
    let mut slopes = Vec::with_capacity(height.window().len());
    for row in 0..height.window().ny() {
        surface.row(row, |_, east, south| slopes.extend(east.iter().zip(south).map(|(x, y)| (x * x + y * y).sqrt())));
    }
    slopes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_are_taken_around_each_value() {
        let grid = Grid::new([8.0, 4.0], 4.0);
        assert_eq!(grid.values, [4, 2]);
        let map: Vec<f32> = (0..32).map(|at| (at % 8) as f32 + 100.0 * (at / 8) as f32).collect();
        assert_eq!(grid.means(&map, [8, 4]), [50.5, 52.5, 54.5, 56.5, 250.5, 252.5, 254.5, 256.5]);
        let text = grid.as_text(&[0.1, 2.0, 3e-7, 4.0, 5.0, 6.0, 7.0, 8.0]);
        assert!(text.contains("ncols 4\nnrows 2") && text.contains("cellsize 2\n"), "{text}");
        assert!(text.ends_with("\n0.1 2 0.0000003 4\n5 6 7 8\n"), "{text}");
    }
}
