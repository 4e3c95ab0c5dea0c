//! Height gradients from 3 x 3 cells, a block of a row at a time.
//!
//! Beyond the edge of the raster, heights are extrapolated linearly (`2 a - b` from the last two cells), so an edge
//! cell has the one-sided difference and a plane has the same gradient in every cell. The gradient across a raster of
//! one row or column is 0.
//!
//! Source: B. K. P. Horn, 1981, Hill shading and the reflectance map, Proc. IEEE 69(1), 14-47. The kernel sums
//! differences instead of subtracting sums, which keeps single precision exact to the last bits at any elevation.

use super::simd::simd;
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
    cell_m: f64,
    method: Method,
}

impl<'a> Surface<'a> {
    /// Creates the surface of a field's first plane.
    #[must_use]
    pub fn new(height: &'a Field, method: Method) -> Self {
        let window = height.window();
        let (nx, ny) = (window.nx(), window.ny());
        Self { heights: height.plane(0), nx, ny, cell_m: window.cell_m(), method }
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
        if j > 0 {
            self.pad(j - 1, start, len, north);
        }
        if j + 1 < self.ny {
            self.pad(j + 1, start, len, south);
        }
        if j == 0 {
            continue_line(centre, if self.ny > 1 { south } else { centre }, north);
        }
        if j + 1 == self.ny {
            continue_line(centre, if self.ny > 1 { north } else { centre }, south);
        }
        patch
    }

    fn pad(&self, j: usize, start: usize, len: usize, out: &mut [f32; BLOCK + 2]) {
        let row = &self.heights[j * self.nx..][..self.nx];
        let end = start + len;
        out[1..=len].copy_from_slice(&row[start..end]);
        out[0] = if start > 0 { row[start - 1] } else { beyond(row[0], row[1.min(self.nx - 1)]) };
        out[len + 1] = if end < self.nx { row[end] } else { beyond(row[end - 1], row[end.saturating_sub(2)]) };
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
