//! Simplex noise on a raster: gradients at the corners of triangles.
//!
//! K. Perlin (2001), "Noise hardware"; S. Gustavson (2005), "Simplex noise demystified"; the radius of the kernels, the
//! scale and the 24 directions are those of OpenSimplex2 (K. Spencer, 2020). Differences: the triangular lattice is
//! skewed in the fixed-point numbers of `lattice`, so that a window has the bits of the whole.

use super::{
    Octave,
    lattice::{Axis, hash, hash_row},
    raster::{Combine, LANES, Layer, Noise},
};
use crate::numerics::{math::lane, simd::simd};

/// (√3 − 1) / 2 in 0.32 fixed point: the sum of both coordinates times this, added to each of them, turns pairs of
/// triangles into squares.
const SKEW: i64 = 1_572_067_138;
/// (3 − √3) / 6: the inverse transformation.
const UNSKEW: f32 = 0.211_324_87;
/// The square of a kernel's radius.
const REACH: f32 = 0.5;
/// Scales the noise to ±1.
pub(crate) const SCALE: f32 = 99.836_85;
/// Ratio of the requested wavelength to that of the lattice, with which features are as large as those of gradient
/// noise on squares.
pub(crate) const FINER: f64 = 0.8;

/// Number of gradient directions; they are 15° apart, starting at 7.5°. Their spacing is in 2³²nds of a turn.
const DIRECTIONS: u32 = 24;
const APART: u32 = u32::MAX / DIRECTIONS + 1;

/// Returns the gradient directions, for shaders: the components along x and y of one after the other.
pub(crate) fn directions() -> [f32; 2 * DIRECTIONS as usize] {
    std::array::from_fn(|at| lane::turn((at as u32 / 2).wrapping_mul(APART).wrapping_add(APART / 2))[at % 2])
}

/// An octave of simplex noise.
pub(crate) struct Simplex {
    octave: Octave,
    /// The octave's factor.
    scale: f32,
    /// First row of samples in the world.
    top: u32,
}

impl Simplex {
    /// Creates an octave with a scale.
    pub fn new(octave: Octave, scale: f32) -> Self {
        Self { octave, scale, top: 0 }
    }
}

/// Returns the contribution of a lattice point, given by its hash, at an offset from it.
#[inline(always)]
fn corner(hash: u32, x: f32, y: f32) -> f32 {
    let direction = ((hash >> 8) * DIRECTIONS) >> 24;
    let [along, down] = lane::turn(direction.wrapping_mul(APART).wrapping_add(APART / 2));
    let rest = (REACH - x * x - y * y).max(0.0);
    let square = rest * rest;
    square * square * (along * x + down * y)
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
    /// Evaluates one octave for each row of samples.
    fn triangles<C: Combine>(layer: &Simplex, combine: &C, octave: usize, x: u32, states: &mut [C::State]) {
        let constants = combine.layer(octave);
        let (seed, [along, down]) = (layer.octave.seed, layer.octave.axes);
        let mut columns = [0; LANES];
        for (lane, column) in (0..).zip(&mut columns) {
            *column = along.at(x.wrapping_add(lane));
        }
        // step by step for all lanes, each step a loop over vectors
        for (y, state) in (layer.top..).zip(states) {
            let row = down.at(y);
            let (mut cells, mut lines) = ([0; LANES], [0; LANES]);
            let (mut xs, mut ys, mut rights) = ([0.0; LANES], [0.0; LANES], [0; LANES]);
            for lane in 0..LANES {
                let sum = columns[lane] + row;
                let skew = (sum >> 32) * SKEW + ((i64::from(sum as u32) * SKEW) >> 32);
                let (x, y) = (columns[lane] + skew, row + skew);
                (cells[lane], lines[lane]) = (Axis::cell(x), Axis::cell(y));
                let (s, t) = (Axis::fraction(x), Axis::fraction(y));
                let back = (s + t) * UNSKEW;
                (xs[lane], ys[lane]) = (s - back, t - back);
                rights[lane] = i32::from(s > t);
            }
            let mut hashes = [[0; LANES]; 3];
            for lane in 0..LANES {
                let (i, right) = (cells[lane], rights[lane]);
                let near = hash_row(lines[lane], seed);
                let far = hash_row(lines[lane].wrapping_add(1), seed);
                hashes[0][lane] = hash(i, near);
                hashes[1][lane] = hash(i.wrapping_add(1), far);
                hashes[2][lane] = hash(i.wrapping_add(right), if right == 1 { near } else { far });
            }
            let mut noise = [0.0; LANES];
            for lane in 0..LANES {
                let (x, y, across) = (xs[lane], ys[lane], rights[lane] as f32);
                let below = 1.0 - across;
                noise[lane] = layer.scale
                    * (corner(hashes[0][lane], x, y)
                        + corner(hashes[1][lane], (x - 1.0) + 2.0 * UNSKEW, (y - 1.0) + 2.0 * UNSKEW)
                        + corner(hashes[2][lane], (x - across) + UNSKEW, (y - below) + UNSKEW));
            }
            C::octave(&constants, &Noise::level(noise), state);
        }
    }
}
