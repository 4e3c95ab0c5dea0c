//! Simplex noise on a raster: gradients at the corners of triangles.
//!
//! K. Perlin (2001), "Noise hardware"; S. Gustavson (2005), "Simplex noise demystified"; the radius of the kernels, the factor
//! and the 24 directions are those of OpenSimplex2 (K. Spencer, 2020). What differs: the lattice of triangles is skewed in
//! the fixed-point numbers of `lattice`, so that a window has the bits of the whole.

use super::{
    Octave,
    lattice::{Axis, hash, hash_row},
    raster::{Combine, LANES, Layer, Noise},
};
use crate::simd::simd;

/// (√3 − 1) / 2 in 0.32 fixed point: what is added to both coordinates, times their sum, makes squares of pairs of triangles.
const SKEW: i64 = 1_572_067_138;
/// (3 − √3) / 6: the way back.
const UNSKEW: f32 = 0.211_324_87;
/// The square of a kernel's radius.
const REACH: f32 = 0.5;
/// Brings the noise to ±1.
pub(crate) const SCALE: f32 = 99.836_85;
/// A lattice is so much finer than the wavelength asked for that its forms are as large as those of gradient noise on squares.
pub(crate) const FINER: f64 = 0.8;

/// The unit vectors at 7.5° + k · 15° in the first quadrant.
const QUADRANT: [[f32; 2]; 6] = [
    [0.991_444_9, 0.130_526_2],
    [0.923_879_5, 0.382_683_43],
    [0.793_353_3, 0.608_761_4],
    [0.608_761_4, 0.793_353_3],
    [0.382_683_43, 0.923_879_5],
    [0.130_526_2, 0.991_444_9],
];

/// An octave of simplex noise.
pub(crate) struct Simplex {
    octave: Octave,
    /// The 24 directions, multiplied by the octave's factor.
    directions: [[f32; 2]; 24],
    /// First row of samples in the world.
    top: u32,
}

impl Simplex {
    /// An octave with a factor on it.
    pub fn new(octave: Octave, scale: f32) -> Self {
        let directions = std::array::from_fn(|k| {
            let [x, y] = QUADRANT[k % 6].map(|part| part * scale);
            [[x, y], [-y, x], [-x, -y], [y, -x]][k / 6]
        });
        Self { octave, directions, top: 0 }
    }

    /// What the lattice point of a hash adds at an offset from it.
    #[inline(always)]
    fn corner(&self, hash: u32, x: f32, y: f32) -> f32 {
        let [along, down] = self.directions[((u64::from(hash >> 8) * 24) >> 24) as usize];
        let rest = (REACH - x * x - y * y).max(0.0);
        let square = rest * rest;
        square * square * (along * x + down * y)
    }
}

impl Layer for Simplex {
    fn lay(&mut self, origin: [u32; 2], _: [usize; 2]) {
        self.top = origin[1];
    }

    fn add<C: Combine>(&mut self, combine: &C, octave: usize, x: u32, states: &mut [C::State]) {
        triangles(self, combine, octave, x, states);
    }
}

simd! {
    /// One octave for each row of samples.
    fn triangles<C: Combine>(layer: &Simplex, combine: &C, octave: usize, x: u32, states: &mut [C::State]) {
        let constants = combine.layer(octave);
        let (seed, [along, down]) = (layer.octave.seed, layer.octave.axes);
        let mut columns = [0; LANES];
        for (lane, column) in (0..).zip(&mut columns) {
            *column = along.at(x.wrapping_add(lane));
        }
        for (y, state) in (layer.top..).zip(states) {
            let row = down.at(y);
            let mut noise = [0.0; LANES];
            for lane in 0..LANES {
                let sum = columns[lane] + row;
                let skew = (sum >> 32) * SKEW + ((i64::from(sum as u32) * SKEW) >> 32);
                let (x, y) = (columns[lane] + skew, row + skew);
                let (i, j) = (Axis::cell(x), Axis::cell(y));
                let (s, t) = (Axis::fraction(x), Axis::fraction(y));
                let back = (s + t) * UNSKEW;
                let (x, y) = (s - back, t - back);
                let right = i32::from(s > t);
                let (across, below) = (right as f32, 1.0 - right as f32);
                let near = hash_row(j, seed);
                let far = hash_row(j.wrapping_add(1), seed);
                let third = hash(i.wrapping_add(right), if right == 1 { near } else { far });
                noise[lane] = layer.corner(hash(i, near), x, y)
                    + layer.corner(hash(i.wrapping_add(1), far), (x - 1.0) + 2.0 * UNSKEW, (y - 1.0) + 2.0 * UNSKEW)
                    + layer.corner(third, (x - across) + UNSKEW, (y - below) + UNSKEW);
            }
            C::octave(&constants, &Noise::level(noise), state);
        }
    }
}
