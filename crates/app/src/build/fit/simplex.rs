//! The search itself: the simplex method of Nelder and Mead, from the crate `argmin`.

use std::fmt;

use argmin::{
    core::{CostFunction, Error, Executor},
    solver::neldermead::NelderMead,
};
use argmin_math::{ArgminAdd, ArgminMul, ArgminSub};

/// The search ends when the losses at the corners have a smaller standard deviation.
const LEVEL: f64 = 1e-3;

/// A corner of the simplex, in units of the parameters' ranges.
#[derive(Clone, Debug, PartialEq)]
struct Corner(Vec<f64>);

impl Corner {
    fn with(&self, other: &Self, each: impl Fn(f64, f64) -> f64) -> Self {
        Self(self.0.iter().zip(&other.0).map(|(a, b)| each(*a, *b)).collect())
    }
}

impl ArgminAdd<Self, Self> for Corner {
    fn add(&self, other: &Self) -> Self {
        self.with(other, |a, b| a + b)
    }
}

impl ArgminSub<Self, Self> for Corner {
    fn sub(&self, other: &Self) -> Self {
        self.with(other, |a, b| a - b)
    }
}

impl ArgminMul<f64, Self> for Corner {
    fn mul(&self, factor: &f64) -> Self {
        Self(self.0.iter().map(|a| a * factor).collect())
    }
}

/// The function to minimise.
struct Cost<'a>(&'a dyn Fn(&[f64]) -> f64);

impl fmt::Debug for Cost<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Cost")
    }
}

impl CostFunction for Cost<'_> {
    type Param = Corner;
    type Output = f64;

    fn cost(&self, corner: &Corner) -> Result<f64, Error> {
        Ok((self.0)(&corner.0))
    }
}

/// Minimises a function that is never NaN: `start` is a corner of the first simplex, whose other corners lie `steps`
/// away from it, one along each axis, inward. The caller remembers the least value.
pub(super) fn minimise(cost: &dyn Fn(&[f64]) -> f64, start: &[f64], steps: &[f64], iterations: u64) {
    let mut corners = vec![Corner(start.to_vec())];
    for (axis, step) in steps.iter().enumerate() {
        let mut corner = start.to_vec();
        corner[axis] += if (0.0..=1.0).contains(&(corner[axis] + step)) { *step } else { -step };
        corners.push(Corner(corner));
    }
    let Ok(solver) = NelderMead::new(corners).with_sd_tolerance(LEVEL) else { return };
    let executor = Executor::new(Cost(cost), solver).configure(|state| state.max_iters(iterations)).timer(false);
    // Ignored: the cost has no error, and the least value is known to the caller.
    let _ = executor.run();
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;

    use super::*;

    #[test]
    fn a_valley_is_descended() {
        let least = RefCell::new((f64::INFINITY, vec![]));
        let cost = |at: &[f64]| {
            let (x, y) = (at[0] - 0.7, at[1] - 0.2);
            let value = f64::sqrt(x * x + 20.0 * (y - 0.5 * x) * (y - 0.5 * x));
            if value < least.borrow().0 {
                *least.borrow_mut() = (value, at.to_vec());
            }
            value
        };
        minimise(&cost, &[0.95, 0.95], &[0.15, 0.15], 200);
        let (value, at) = least.into_inner();
        assert!(value < 0.01 && (at[0] - 0.7).abs() < 0.01 && (at[1] - 0.2).abs() < 0.01, "{value} at {at:?}");
    }
}
