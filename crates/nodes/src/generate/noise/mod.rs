//! Fractal gradient noise on a raster: the engine behind the noise generators.
//!
//! An octave is gradient noise (K. Perlin, 1985, "An image synthesizer"; 2002, "Improving noise") on a square lattice
//! of one wavelength. What differs from the source: gradients are drawn by an integer hash instead of a permutation
//! table, so the noise never repeats; there are 32 directions instead of 8, so that no direction stands out; and
//! positions are fixed-point numbers of 32.32 bits built from cell indices, so that a tile has the bits of the whole
//! and the fraction is as exact 1000 km from the origin as at it.
//!
//! Octaves are decorrelated by a hashed seed and a hashed shift of the lattice each, never by a rotation. With lattice
//! rows along raster rows, everything that depends on the column alone is computed once per lattice row (see `raster`);
//! a turned lattice needs hashes, gradients, fades and four dot products per sample, several times the work. With 32
//! directions the aspects of a fractal sum are even all the same: a test measures their fourfold and eightfold harmonics.

mod fractal;
mod lattice;
pub(crate) mod raster;
#[cfg(test)]
pub(crate) mod reference;
#[cfg(test)]
pub(crate) mod spectrum;

use orograph_graph::choice;

pub(crate) use fractal::{Fractal, Octave};
pub(crate) use lattice::NOISE_SCALE;

choice! {
    /// The directions that gradients are drawn from.
    pub enum Gradients {
        /// 32 directions, 11.25° apart and none along the axes: no preferred direction.
        Even = "even",
        /// 8 directions, 45° apart, the axes among them: the classic look, with features along axes and diagonals.
        Classic = "classic",
    }
}
