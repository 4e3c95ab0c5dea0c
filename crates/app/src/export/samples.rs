//! Values between the centres of cells.

use orograph_graph::Field;

/// A field, interpolated between cell centres.
pub(crate) struct Samples<'a> {
    field: &'a Field,
}

impl<'a> Samples<'a> {
    /// Those of a field.
    pub(crate) const fn of(field: &'a Field) -> Self {
        Self { field }
    }

    /// The bilinear value at a position in cells; the centre of the first cell is at 0.
    pub(crate) fn at(&self, plane: usize, at: [f64; 2]) -> f32 {
        let samples = self.field.plane(plane);
        let last = self.field.window().cells.map(|n| f64::from(n - 1));
        let at = [0, 1].map(|axis| at[axis].clamp(0.0, last[axis]));
        let nx = self.field.window().nx();
        let [i, j] = at.map(|v| v.floor() as usize);
        let (right, down) = (usize::from(at[0] < last[0]), nx * usize::from(at[1] < last[1]));
        let first = j * nx + i;
        let [u, v] = at.map(|v| v - v.floor());
        let value = |at: usize| f64::from(samples[at]);
        let north = value(first) + u * (value(first + right) - value(first));
        let south = value(first + down) + u * (value(first + down + right) - value(first + down));
        (north + v * (south - north)) as f32
    }
}
