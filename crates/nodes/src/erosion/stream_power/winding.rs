//! What makes rivers wind: beds that are easier or harder to cut from cell to cell.
//!
//! On even rock the steepest way downhill is one of eight directions for many cells, and a valley that has formed keeps
//! it. Boulders, bars and joints turn a real river long before that. Here each cell of a river has its own factor of the
//! erodibility, the same at every step: the river seeks the softer cells, and its valley bends with it.

use orograph_graph::mix;

use super::{
    incision::Law,
    rock::{draw, uniform},
};
use crate::numerics::math;

/// Shares of rivers in what a cell erodes that have their own factors, from 0 to 1.
const SHARES: usize = 32;
/// Equally likely factors of each.
const DRAWS: usize = 256;

/// By how much the bed that a river has found is softer than the mean of all cells, as a share of the variance: the slope
/// of rivers, which this offsets, is then the same for each deviation.
const SOFTER: f64 = 0.3;

/// The factors of the cells of a grid, as coefficients of the law.
#[derive(Debug)]
pub struct Winding {
    /// By share, then by draw. Empty where all are 1.
    factors: Vec<f64>,
    headwater_m2: f64,
    seed: u32,
}

impl Winding {
    /// Factors whose natural logarithm has the standard deviation `deviation` in rivers that drain much more than
    /// `headwater_m2`, and the share A / (A + A₀) of it where less drains: in a cell that hardly any water crosses the
    /// bed counts for little. Without headwaters it has all of it in every cell.
    #[must_use]
    pub fn new(law: &Law, deviation: f64, headwater_m2: f64, seed: u32) -> Self {
        let factor = |at: usize| {
            let own = (at / DRAWS) as f64 / SHARES as f64 * deviation;
            law.coefficient(math::exp(own * (3.0_f64.sqrt() * uniform(at % DRAWS) - SOFTER * own)))
        };
        let entries = if deviation > 0.0 { (SHARES + 1) * DRAWS } else { 0 };
        Self { factors: (0..entries).map(factor).collect(), headwater_m2, seed: mix(seed ^ 0x817D_1460) }
    }

    /// The coefficient of a cell that drains `area_m2`, from the one of even beds.
    #[must_use]
    #[inline(always)]
    pub fn vary(&self, law: &Law, cell: usize, area_m2: f64, coefficient: f64) -> f64 {
        if self.factors.is_empty() {
            return coefficient;
        }
        let share = (area_m2 / (area_m2 + self.headwater_m2) * SHARES as f64 + 0.5) as usize;
        law.times(coefficient, self.factors[share * DRAWS + draw(cell, self.seed) as usize % DRAWS])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn deviation(winding: &Winding, law: &Law, area_m2: f64) -> [f64; 2] {
        let logs: Vec<f64> = (0..20_000).map(|cell| math::ln(winding.vary(law, cell, area_m2, 1.0))).collect();
        let mean = logs.iter().sum::<f64>() / logs.len() as f64;
        let square = logs.iter().map(|log| (log - mean) * (log - mean)).sum::<f64>() / logs.len() as f64;
        [mean, square.sqrt()]
    }

    #[test]
    fn beds_vary_in_rivers_and_hardly_in_headwaters() {
        let law = Law::new(1.0);
        let winding = Winding::new(&law, 0.8, 1e5, 7);
        for (area_m2, expected) in [(1e9, 0.8), (1e5, 0.4), (900.0, 0.0)] {
            // The error of the deviation of 20 000 draws is half a percent; shares are steps of 1/32.
            let [mean, found] = deviation(&winding, &law, area_m2);
            assert!(
                (mean + SOFTER * expected * expected).abs() < 0.02 && (found - expected).abs() < 0.02,
                "{area_m2}: {mean} {found}"
            );
        }
        let everywhere = Winding::new(&law, 0.8, 0.0, 7);
        assert!((deviation(&everywhere, &law, 900.0)[1] - 0.8).abs() < 0.02);
        assert_eq!(Winding::new(&law, 0.0, 1e5, 7).vary(&law, 3, 1e9, 0.3), 0.3);
    }
}
