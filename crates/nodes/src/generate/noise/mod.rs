//! Fractal gradient noise on a raster: the engine behind the noise generators.
//!
//! An octave is gradient noise (K. Perlin, 1985, "An image synthesizer"; 2002, "Improving noise") on a square lattice
//! of one wavelength. What differs from the source: gradients are drawn by an integer hash instead of a permutation
//! table, so the noise never repeats; there are 32 directions instead of 8, so that no direction stands out; and
//! positions are fixed-point numbers of 32.32 bits built from cell indices, so that a tile has the bits of the whole
//! and the fraction is as exact 1000 km from the origin as at it.
//!
//! The lattice of each octave is turned, shifted and seeded on its own. A square lattice has a fourfold pattern in its
//! spectrum, so octaves whose lattices lie alike leave creases along rows, columns and diagonals. And pure gradient noise
//! is zero at all lattice points, so that the crests of ridged land meet in a regular grid: here a lattice point has a
//! value of its own too, evenly drawn from −½ to ½. That is the one width for which the variance is the same at lattice
//! points, σ², and at the centres of cells, 1/16 + σ²/4. Tests measure the power by direction.
//!
//! A raster row crosses a turned lattice in runs of samples of one lattice cell, for which the work about corners is done
//! once (see `runs`).

mod fractal;
mod lattice;
pub(crate) mod raster;
#[cfg(test)]
pub(crate) mod reference;
mod runs;
#[cfg(test)]
pub(crate) mod spectrum;

use orograph_graph::choice;

pub(crate) use fractal::{Fractal, Octave};
pub(crate) use lattice::NOISE_SCALE;

choice! {
    /// The directions that gradients are drawn from.
    pub enum Gradients {
        /// 32 directions, 11.25° apart, on lattices turned from octave to octave: no preferred direction.
        Even = "even",
        /// 8 directions, 45° apart, the axes among them, on lattices along the axes: the classic look, with features along
        /// axes and diagonals.
        Classic = "classic",
    }
}
