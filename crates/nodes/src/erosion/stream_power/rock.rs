//! How easily rock erodes: its erodibility K, given as such or by the rate at which a reference river cuts it.

use orograph_graph::mix;

use super::{Inputs, Params, area::REFERENCE_M2, incision::Law};
use crate::{
    numerics::{
        math, par,
        rock::{Bodies, MOST_DEVIATIONS},
    },
    prelude::*,
};

/// What K is when the file says nothing.
pub const DEFAULT_ERODIBILITY: f64 = 2e-6;
/// Slope of the reference river.
const REFERENCE_SLOPE: f64 = 0.1;

/// The erodibility of every cell.
#[derive(Debug)]
pub struct Rock<'a> {
    given: Lane<'a>,
    /// K for 1 of what is given.
    per_given: f64,
    variation: Variation,
    seed: u32,
}

/// How K differs from place to place.
#[derive(Debug)]
enum Variation {
    None,
    /// Coefficients of which each cell draws one.
    Cells(Box<[f64; 256]>),
    /// A factor for each cell.
    Waves(Vec<f32>),
}

impl<'a> Rock<'a> {
    /// Reads `erodibility`, `reference_rate` and what varies, in waves of `shortest_m` metres and more. Gives the
    /// tangent of the steepest slope of each cell too, where that varies.
    ///
    /// # Errors
    /// When both the erodibility and the reference rate are given, or [`NodeError::Cancelled`].
    pub fn new(
        job: &Job<'_>,
        inputs: &Inputs<'a>,
        params: &Params,
        law: &Law,
        shortest_m: f64,
    ) -> Result<(Self, Option<Vec<f32>>), NodeError> {
        let (erodibility, rate) = (inputs.erodibility, inputs.reference_rate);
        let (given, per_given) = if rate.constant() == Some(0.0) {
            (erodibility, 1.0)
        } else if erodibility.constant() == Some(DEFAULT_ERODIBILITY as f32) {
            (rate, erodibility_of_unit_rate(params.m, params.n))
        } else {
            return Err(given_twice());
        };
        let seed = job.seed();
        let deviation = params.variation;
        if params.variation_size <= 0.0 {
            let variation =
                if deviation > 0.0 { Variation::Cells(Box::new(variation(law, deviation))) } else { Variation::None };
            return Ok((Self { given, per_given, variation, seed }, None));
        }
        let bodies = Bodies { longest_m: params.variation_size, shortest_m };
        let stands = params.repose_variation;
        let mut rock = if deviation > 0.0 || stands > 0.0 { bodies.softness(job)? } else { Vec::new() };
        let stands = (stands > 0.0).then(|| bodies.steepest(job, inputs.repose, stands, &rock)).transpose()?;
        let variation = if deviation > 0.0 {
            par::change(&mut rock, |rock| {
                *rock = math::exp(deviation * f64::from(rock.clamp(-MOST_DEVIATIONS, MOST_DEVIATIONS))) as f32;
            });
            Variation::Waves(rock)
        } else {
            Variation::None
        };
        Ok((Self { given, per_given, variation, seed }, stands))
    }

    /// The mean of K over `cells` cells.
    #[must_use]
    pub fn mean(&self, cells: usize) -> f64 {
        self.everywhere()
            .unwrap_or_else(|| (0..cells).map(|cell| self.erodibility(cell)).sum::<f64>() / cells.max(1) as f64)
    }

    /// K where it is the same everywhere, before it varies.
    #[must_use]
    pub fn everywhere(&self) -> Option<f64> {
        self.given.constant().map(|given| self.erodibility_of(given))
    }

    /// K of a cell, before it varies.
    #[must_use]
    #[inline(always)]
    pub fn erodibility(&self, cell: usize) -> f64 {
        self.erodibility_of(self.given.at(cell))
    }

    /// The coefficient of a cell whose erodibility varies, from the one without.
    #[must_use]
    #[inline(always)]
    pub fn vary(&self, law: &Law, cell: usize, coefficient: f64) -> f64 {
        match &self.variation {
            Variation::Cells(variation) => law.times(coefficient, variation[(draw(cell, self.seed) >> 24) as usize]),
            Variation::Waves(factors) => law.times(coefficient, law.coefficient(f64::from(factors[cell]))),
            Variation::None => coefficient,
        }
    }

    /// By how much softer than the mean the rock of a cell is, where it varies in waves; 1 elsewhere.
    #[must_use]
    #[inline(always)]
    pub fn softer(&self, cell: usize) -> f64 {
        match &self.variation {
            Variation::Waves(factors) => f64::from(factors[cell]),
            Variation::Cells(_) | Variation::None => 1.0,
        }
    }

    fn erodibility_of(&self, given: f32) -> f64 {
        f64::from(given).max(0.0) * self.per_given
    }
}

/// The failure with both the erodibility and the reference rate.
pub fn given_twice() -> NodeError {
    NodeError::failed_with_hint(
        "both `erodibility` and `reference_rate` are given",
        "leave one of them out: each says how easily the rock erodes",
    )
}

/// K at which the reference river is cut by 1 m/yr: 1 / (Aᵐ Sⁿ).
fn erodibility_of_unit_rate(m: f64, n: f64) -> f64 {
    1.0 / (math::pow(REFERENCE_M2, m) * math::pow(REFERENCE_SLOPE, n))
}

/// Equally likely factors of the erodibility, as coefficients: their logarithm is uniform around 0 and has the given
/// standard deviation.
fn variation(law: &Law, deviation: f64) -> [f64; 256] {
    std::array::from_fn(|at| law.coefficient(math::exp(deviation * 3.0_f64.sqrt() * uniform(at))))
}

/// A number of 256, from 0, as one from -1 to 1.
pub fn uniform(at: usize) -> f64 {
    (at as f64 + 0.5) / 128.0 - 1.0
}

/// The random bits of a cell.
#[inline(always)]
pub fn draw(cell: usize, seed: u32) -> u32 {
    mix((cell as u32).wrapping_mul(0x9E37_79B9) ^ seed)
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_reference_rate_is_that_of_the_law() {
        // K A^m S^n at 1 km² and 10 %
        for (m, n, k) in [(0.5, 1.0, 0.01), (0.4, 1.0, 0.039_810_717), (0.5, 2.0, 0.1)] {
            assert!((super::erodibility_of_unit_rate(m, n) / k - 1.0).abs() < 1e-8);
        }
    }
}
