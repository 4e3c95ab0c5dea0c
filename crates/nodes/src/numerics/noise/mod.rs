//! Fractal gradient noise on a raster: the engine behind the noise generators.
//!
//! An octave is gradient noise (K. Perlin, 1985, "An image synthesizer"; 2002, "Improving noise") on a square lattice
//! of one wavelength. Differences from the source: gradients come from an integer hash instead of a permutation table,
//! so the noise never repeats; there are 32 directions instead of 8, so that none is visible; and positions are 32.32
//! fixed-point numbers built from cell indices, so that a tile has the bits of the whole and the fraction is as exact
//! 1000 km from the origin as at the origin.
//!
//! Lattices are aligned with rows and columns, so that samples of a row or column share almost all work (see `sheet`).
//! The artefacts of a square lattice, its preference for axes and its zeros at lattice points, are removed at the
//! source: by windows and draws with an isotropic power spectrum (see `basis`). Each octave has its own shift and seed.
//! Tests measure the power by direction.

mod basis;
pub(crate) mod cells;
pub(crate) mod fold;
mod fractal;
pub(crate) mod lattice;
pub(crate) mod place;
pub(crate) mod raster;
#[cfg(test)]
pub(crate) mod reference;
pub(crate) mod scattered;
pub(crate) mod sheet;
pub(crate) mod simplex;
#[cfg(test)]
pub(crate) mod spectrum;
pub(crate) mod sum;
pub(crate) mod table;

use orograph_graph::choice;

pub(crate) use basis::Basis;
pub(crate) use fractal::{Fractal, Octave};

choice! {
    /// The directions that gradients are drawn from.
    pub enum Gradients {
        /// 32 directions, 11.25° apart, under bell-shaped windows: no preferred direction.
        Even = "even",
        /// 8 directions, 45° apart, as published by Perlin in 2002: the classic look, with features along axes and
        /// diagonals and noise that is zero at all points of the lattice.
        Classic = "classic",
    }
}

impl Gradients {
    /// Returns the kind of noise.
    pub(crate) const fn basis(self) -> Basis {
        match self {
            Self::Even => Basis::Bell,
            Self::Classic => Basis::Classic,
        }
    }

    /// Returns the factor that scales the noise to the standard deviation of Perlin's of 2002 at a range of ±1, 0.305,
    /// for which the parameters of published recursions are intended.
    pub(crate) const fn even_scale(self) -> f32 {
        match self {
            Self::Even => 0.935,
            Self::Classic => std::f32::consts::SQRT_2,
        }
    }
}

/// Declares the parameters of a fractal of gradient noise with its defaults, preceded by and interleaved with the
/// node's own. `Params` also gets the method `fractal`, which takes the seed of the run.
macro_rules! fractal_params {
    ($([$($first:tt)*])? wavelength: $wavelength:literal, lacunarity: $lacunarity:literal, gain: $gain:literal;
        $($own:tt)*) => {
        params! {
            $($($first)*)?
            /// Wavelength of the largest features: about twice the distance between neighbouring crests.
            wavelength: f64 = $wavelength, Metres, 1.0..=1e6, soft 200..=30000;
            /// Number of octaves, from coarse to fine; those too fine for the cells are left out.
            octaves: i64 = 12, Count, 1..=24, soft 1..=16;
            /// Ratio of the wavelength of an octave to that of the next finer one.
            lacunarity: f64 = $lacunarity, One, 1.1..=8.0, soft 1.7..=3.0;
            /// Ratio of the amplitude of an octave to that of the one before: the roughness of the terrain.
            gain: f64 = $gain, One, 0.0..=1.0, soft 0.3..=0.7;
            $($own)*
            /// Directions of the gradients.
            gradients: Gradients = Gradients::Even, One, ..;
            /// Makes opposite sides of the world fit together; wavelengths are rounded to whole fractions of its sides.
            tileable: bool = false, One, ..;
            /// Random seed.
            seed: Seed = Seed(0), Count, ..;
        }

        impl Params {
            /// Returns the fractal of a run with that seed.
            fn fractal(&self, seed: u32) -> $crate::numerics::noise::Fractal {
                $crate::numerics::noise::Fractal {
                    wavelength_m: self.wavelength,
                    octaves: self.octaves,
                    lacunarity: self.lacunarity,
                    gain: self.gain,
                    tileable: self.tileable,
                    seed,
                }
            }
        }
    };
}
pub(crate) use fractal_params;
