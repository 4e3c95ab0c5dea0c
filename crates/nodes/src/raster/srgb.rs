//! The transfer curve of sRGB.

use orograph_graph::Field;

use crate::numerics::{math, par};

/// Returns the interleaved sRGB pixels of a picture in linear light.
///
/// # Panics
/// If the field has fewer than three planes, which is a mistake of the caller.
#[must_use]
pub fn srgb_bytes(field: &Field) -> Vec<u8> {
    let mut bytes = vec![0; 3 * field.window().len()];
    let curve = Srgb::new();
    par::all(bytes.chunks_mut(3 * field.window().nx()), |j, out| curve.row::<3>(field, j, out));
    bytes
}

/// The transfer curve of sRGB (IEC 61966-2-1) as a table, exact to the nearest 8-bit code.
pub(super) struct Srgb {
    /// Code at the low end of each of 65536 equal steps from 0 to 1.
    start: Vec<u8>,
    /// Linear value at which a code changes to the next.
    next: [f32; 256],
}

impl Srgb {
    pub(super) fn new() -> Self {
        let linear = |v: f64| if v <= 0.04045 { v / 12.92 } else { math::pow((v + 0.055) / 1.055, 2.4) };
        let mut next = [f32::INFINITY; 256];
        for (code, limit) in next.iter_mut().enumerate().take(255) {
            *limit = linear((code as f64 + 0.5) / 255.0) as f32;
        }
        // the narrowest code is twenty steps wide, so two steps contain at most one limit; entries begin one step
        // early, because the index may be rounded up
        let mut code = 0;
        let start = (0..=65_535_u32)
            .map(|step| {
                while next[usize::from(code)] <= step.saturating_sub(1) as f32 / 65_535.0 {
                    code += 1;
                }
                code
            })
            .collect();
        Self { start, next }
    }

    /// Fills the first three of `N` bytes of the pixels of row `j`.
    pub(super) fn row<const N: usize>(&self, field: &Field, j: usize, out: &mut [u8]) {
        let nx = field.window().nx();
        let [red, green, blue] = [0, 1, 2].map(|plane| &field.plane(plane)[j * nx..(j + 1) * nx]);
        for (out, ((r, g), b)) in out.as_chunks_mut::<N>().0.iter_mut().zip(red.iter().zip(green).zip(blue)) {
            out[..3].copy_from_slice(&[self.code(*r), self.code(*g), self.code(*b)]);
        }
    }

    fn code(&self, linear: f32) -> u8 {
        let v = linear.clamp(0.0, 1.0);
        let code = self.start[(v * 65_535.0) as usize];
        code + u8::from(v >= self.next[usize::from(code)])
    }
}
