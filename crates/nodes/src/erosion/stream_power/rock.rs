//! How easily rock erodes: its erodibility K, given as such or by the rate at which a reference river cuts it.

use super::{Inputs, Params, incision::Law};
use crate::{math, prelude::*};

/// What K is when the file says nothing.
pub const DEFAULT_ERODIBILITY: f64 = 2e-6;
/// Drainage area of the reference river.
const REFERENCE_AREA_M2: f64 = 1e6;
/// Slope of the reference river.
const REFERENCE_SLOPE: f64 = 0.1;

/// The erodibility of every cell.
#[derive(Debug)]
pub struct Rock<'a> {
    given: Lane<'a>,
    /// K for 1 of what is given.
    per_given: f64,
    /// Coefficients of the variation; a cell draws one.
    variation: Option<[f64; 256]>,
    seed: u32,
}

impl<'a> Rock<'a> {
    /// Reads `erodibility`, `reference_rate` and `variation`.
    ///
    /// # Errors
    /// When both the erodibility and the reference rate are given.
    pub fn new(inputs: &Inputs<'a>, params: &Params, law: &Law, seed: u32) -> Result<Self, NodeError> {
        let (erodibility, rate) = (inputs.erodibility, inputs.reference_rate);
        let (given, per_given) = if rate.constant() == Some(0.0) {
            (erodibility, 1.0)
        } else if erodibility.constant() == Some(DEFAULT_ERODIBILITY as f32) {
            (rate, erodibility_of_unit_rate(params.m, params.n))
        } else {
            return Err(NodeError::failed_with_hint(
                "both `erodibility` and `reference_rate` are given",
                "leave one of them out: each says how easily the rock erodes",
            ));
        };
        let variation = (params.variation > 0.0).then(|| variation(law, params.variation));
        Ok(Self { given, per_given, variation, seed })
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
            Some(variation) => {
                let draw = orograph_graph::mix((cell as u32).wrapping_mul(0x9E37_79B9) ^ self.seed) >> 24;
                law.times(coefficient, variation[draw as usize])
            }
            None => coefficient,
        }
    }

    fn erodibility_of(&self, given: f32) -> f64 {
        f64::from(given).max(0.0) * self.per_given
    }
}

/// K at which the reference river is cut by 1 m/yr: 1 / (Aᵐ Sⁿ).
fn erodibility_of_unit_rate(m: f64, n: f64) -> f64 {
    1.0 / (math::pow(REFERENCE_AREA_M2, m) * math::pow(REFERENCE_SLOPE, n))
}

/// Equally likely factors of the erodibility, as coefficients: their logarithm is uniform around 0 and has the given
/// standard deviation.
fn variation(law: &Law, deviation: f64) -> [f64; 256] {
    std::array::from_fn(|at| {
        let uniform = (at as f64 + 0.5) / 128.0 - 1.0;
        law.coefficient(math::exp(deviation * 3.0_f64.sqrt() * uniform))
    })
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
