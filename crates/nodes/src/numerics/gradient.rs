//! Height gradients from 3 x 3 cells, a block of a row at a time.
//!
//! Across joined sides the neighbours are the cells at the other end. Beyond other edges of the raster, heights are
//! extrapolated linearly (`2 a - b` from the last two cells), so an edge cell has the one-sided difference and a plane
//! has the same gradient in every cell. The gradient across a raster of one row or column is 0.
//!
//! Source: B. K. P. Horn, 1981, Hill shading and the reflectance map, Proc. IEEE 69(1), 14-47. The kernel sums
//! differences instead of subtracting sums, which keeps single precision exact to the last bits at any elevation.

use super::{lines::Ends, simd::simd};
use crate::prelude::*;

/// Cells per block.
pub const BLOCK: usize = 256;

choice! {
    /// How a gradient is computed.
    pub enum Method {
        /// Weighted differences over 3 x 3 cells (Horn 1981): steadier on rough terrain; used by most software.
        Horn = "horn",
        /// Differences of the two neighbours: sharpest.
        Central = "central",
    }
}

/// Parts of three rows, with one more cell at each end.
struct Patch([[f32; BLOCK + 2]; 3]);

/// A heightfield whose gradient is computed.
#[derive(Clone, Copy, Debug)]
pub struct Surface<'a> {
    heights: &'a [f32],
    nx: usize,
    ny: usize,
    joined: [bool; 2],
    cell_m: f64,
    method: Method,
}

impl<'a> Surface<'a> {
    /// Creates the surface of a field's first plane.
    #[must_use]
    pub fn new(height: &'a Field, method: Method) -> Self {
        let window = height.window();
        let (nx, ny) = (window.nx(), window.ny());
        let joined = [0, 1].map(|axis| Ends::of(window, axis) == Ends::Wrap);
        Self { heights: height.plane(0), nx, ny, joined, cell_m: window.cell_m(), method }
    }

    /// Calls `each(start, east, south)` for the blocks of row `j` from west to east, with the first column and the
    /// slopes dz/dx towards the east and dz/dy towards the south, in m/m.
    pub fn row(&self, j: usize, mut each: impl FnMut(usize, &[f32], &[f32])) {
        let (mut east, mut south) = ([0.0; BLOCK], [0.0; BLOCK]);
        for start in (0..self.nx).step_by(BLOCK) {
            let len = BLOCK.min(self.nx - start);
            let (east, south) = (&mut east[..len], &mut south[..len]);
            let patch = self.patch(j, start, len);
            match self.method {
                Method::Horn => horn(&patch, (0.125 / self.cell_m) as f32, east, south),
                Method::Central => central(&patch, (0.5 / self.cell_m) as f32, east, south),
            }
            each(start, east, south);
        }
    }

    fn patch(&self, j: usize, start: usize, len: usize) -> Patch {
        let mut patch = Patch([[0.0; BLOCK + 2]; 3]);
        let [north, centre, south] = &mut patch.0;
        self.pad(j, start, len, centre);
        let (is_first, is_last) = (j == 0, j + 1 == self.ny);
        if self.joined[1] || !is_first {
            self.pad(if is_first { self.ny - 1 } else { j - 1 }, start, len, north);
        }
        if self.joined[1] || !is_last {
            self.pad(if is_last { 0 } else { j + 1 }, start, len, south);
        }
        if is_first && !self.joined[1] {
            continue_line(centre, if self.ny > 1 { south } else { centre }, north);
        }
        if is_last && !self.joined[1] {
            continue_line(centre, if self.ny > 1 { north } else { centre }, south);
        }
        patch
    }

    fn pad(&self, j: usize, start: usize, len: usize, out: &mut [f32; BLOCK + 2]) {
        let row = &self.heights[j * self.nx..][..self.nx];
        let (end, last) = (start + len, self.nx - 1);
        let [beyond_west, beyond_east] = if self.joined[0] {
            [row[last], row[0]]
        } else {
            [beyond(row[0], row[1.min(last)]), beyond(row[last], row[last.saturating_sub(1)])]
        };
        out[1..=len].copy_from_slice(&row[start..end]);
        out[0] = if start > 0 { row[start - 1] } else { beyond_west };
        out[len + 1] = if end < self.nx { row[end] } else { beyond_east };
    }
}

/// Extrapolates from `inner` through `edge`.
#[inline(always)]
fn beyond(edge: f32, inner: f32) -> f32 {
    edge + (edge - inner)
}

fn continue_line(edge: &[f32], inner: &[f32], out: &mut [f32]) {
    for ((out, &edge), &inner) in out.iter_mut().zip(edge).zip(inner) {
        *out = beyond(edge, inner);
    }
}

simd! {
    fn horn(patch: &Patch, scale: f32, east: &mut [f32], south: &mut [f32]) {
        let n = east.len().min(BLOCK);
        let [a, b, c] = [&patch.0[0][..n + 2], &patch.0[1][..n + 2], &patch.0[2][..n + 2]];
        let (east, south) = (&mut east[..n], &mut south[..n]);
        for i in 0..n {
            east[i] = ((a[i + 2] - a[i]) + 2.0 * (b[i + 2] - b[i]) + (c[i + 2] - c[i])) * scale;
            south[i] = ((c[i] - a[i]) + 2.0 * (c[i + 1] - a[i + 1]) + (c[i + 2] - a[i + 2])) * scale;
        }
    }
}

simd! {
    fn central(patch: &Patch, scale: f32, east: &mut [f32], south: &mut [f32]) {
        let n = east.len().min(BLOCK);
        let [a, b, c] = [&patch.0[0][..n + 2], &patch.0[1][..n + 2], &patch.0[2][..n + 2]];
        let (east, south) = (&mut east[..n], &mut south[..n]);
        for i in 0..n {
            east[i] = (b[i + 2] - b[i]) * scale;
            south[i] = (c[i + 1] - a[i + 1]) * scale;
        }
    }
}

simd! {
    /// Computes slope angles in degrees, 0 to 90, from the gradient.
    pub fn slope_degrees(east: &[f32], south: &[f32], out: &mut [f32]) {
        for ((out, &p), &q) in out.iter_mut().zip(east).zip(south) {
            *out = crate::numerics::math::lane::atan((p * p + q * q).sqrt()) * const { (180.0 / std::f64::consts::PI) as f32 };
        }
    }
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Boundary, Edge, World};

    use super::*;
    use crate::testing::{field, world};

    /// Moving terrain by some cells in a periodic world moves its gradient; a row of several blocks too.
    #[test]
    fn joined_sides_are_like_any_other_place() {
        const SIZE: [usize; 2] = [600, 9];
        let joined = World { boundary: Boundary::all(Edge::Periodic), ..world(600, 9, 10.0) };
        let turn = |at: f64, count: usize| std::f64::consts::TAU * at / (10.0 * count as f64);
        let shape = |x: f64, y: f64| {
            let (x, y) = (turn(x, SIZE[0]), turn(y, SIZE[1]));
            f64::from((300.0 * crate::numerics::math::sin(3.0 * x + y) + 100.0 * crate::numerics::math::cos(y)) as f32)
        };
        let gradients = |surface: &Surface<'_>| {
            let mut found = vec![[0.0; 2]; SIZE[0] * SIZE[1]];
            for j in 0..SIZE[1] {
                surface.row(j, |start, east, south| {
                    for (i, (east, south)) in east.iter().zip(south).enumerate() {
                        found[j * SIZE[0] + start + i] = [*east, *south];
                    }
                });
            }
            found
        };
        for method in [Method::Horn, Method::Central] {
            let here = field(joined, shape);
            let moved = field(joined, |x, y| shape((x + 2570.0).rem_euclid(6000.0), (y + 40.0).rem_euclid(90.0)));
            let [here, moved] = [&here, &moved].map(|height| gradients(&Surface::new(height, method)));
            for (cell, gradient) in moved.iter().enumerate() {
                let (x, y) = ((cell % SIZE[0] + 257) % SIZE[0], (cell / SIZE[0] + 4) % SIZE[1]);
                let expected = here[y * SIZE[0] + x];
                for axis in 0..2 {
                    assert!(
                        (gradient[axis] - expected[axis]).abs() < 1e-5,
                        "{method:?} {cell}: {gradient:?} {expected:?}"
                    );
                }
            }
        }
    }
}
