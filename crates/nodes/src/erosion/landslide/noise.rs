//! Smooth noise that makes outlines, floors and sheets irregular.

use super::land::Land;
use crate::numerics::{joins::Joins, noise::place};

/// Returns smooth noise between −1 and 1, with a standard deviation of 0.4 and features about one unit apart.
pub(super) fn noise(at: [f64; 2], seed: u32) -> f64 {
    (1.7 * place::at(at, seed)).clamp(-1.0, 1.0)
}

/// How many times as long as the bumps the longest features of their noise are.
const LONGEST: f64 = 3.0;

/// The bumps of a sheet of debris.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bumps {
    size_m: f64,
    seed: u32,
    joins: Option<Joins>,
}

impl Bumps {
    /// Bumps of this size and larger ones.
    pub fn new(land: &Land, size_m: f64, seed: u32) -> Self {
        Self { size_m, seed, joins: land.joins(LONGEST * size_m) }
    }

    /// Rough noise at a place: three octaves of [`noise`].
    pub fn at(&self, place_m: [f64; 2]) -> f64 {
        Joins::apply(self.joins.as_ref(), place_m, |place_m| self.endless_at(place_m))
    }

    fn endless_at(&self, place_m: [f64; 2]) -> f64 {
        let octave = |k: u32| {
            let scale = f64::from(1 << k);
            noise(place_m.map(|at| at * scale / (LONGEST * self.size_m)), self.seed ^ k) / scale
        };
        (0..3).map(octave).sum()
    }
}
