//! The implicit step of the stream-power law along one link.
//!
//! A cell at height h₀, above a receiver that is already at its new height hᵣ a distance d below, is at
//! h = hᵣ + x after a step, where x + C xⁿ = b, b = h₀ − hᵣ and C = K Aᵐ Δt / dⁿ (Braun and Willett 2013). In terms of
//! y = x / b it is y + c yⁿ = 1 with c = C bⁿ⁻¹: one function of one number for each n. For n = 1 it is 1 / (1 + c),
//! for n = 2 it is 2 / (1 + √(1 + 4 c)). Otherwise it is solved once by Newton's method for many c and interpolated,
//! which has no iteration to end; for n = 1.5, where c is C √b, at places that need no logarithm.

use crate::numerics::math;

/// What is left of a drop after a step, as a share of it.
#[derive(Debug)]
pub enum Law {
    /// n = 1.
    Linear,
    /// n = 1.5.
    ThreeHalves {
        /// y as a cubic of the place between two c: [`PARTS`] to a doubling, equally far apart, from 2^[`LOWEST`] up.
        table: Vec<[f64; 4]>,
    },
    /// n = 2.
    Square,
    /// Any other n.
    Power {
        /// n − 1.
        excess: f64,
        /// y for log₂ c from [`LOWEST`] up, [`PER_OCTAVE`] to a doubling.
        table: Vec<f64>,
    },
}

/// log₂ c below which nothing is eroded to double precision.
const LOWEST: f64 = -52.0;
/// log₂ c above which what is left is that of this one.
const HIGHEST: f64 = 96.0;
/// Entries for a doubling of c. Cubic interpolation between them is exact to 1e-8 of the drop.
const PER_OCTAVE: f64 = 32.0;
/// Parts of a doubling of c, as a power of 2. Hermite's cubics on them are exact to 1e-8 of the drop.
const PARTS_BITS: u32 = 5;
/// Parts of a doubling of c.
const PARTS: usize = 1 << PARTS_BITS;
/// Bits of a number in double precision that say where in its part it is.
const PLACE_BITS: u32 = 52 - PARTS_BITS;

impl Law {
    /// The law of slope exponent `n`, above 0.
    #[must_use]
    pub fn new(n: f64) -> Self {
        if n == 1.0 {
            return Self::Linear;
        }
        if n == 2.0 {
            return Self::Square;
        }
        if n == 1.5 {
            let parts = (HIGHEST - LOWEST) as usize * PARTS;
            return Self::ThreeHalves { table: (0..=parts).map(|part| cubic(n, part)).collect() };
        }
        let entries = ((HIGHEST - LOWEST) * PER_OCTAVE) as usize + 3;
        let table = (0..entries).map(|at| share_left(n, math::exp2(LOWEST + (at as f64 - 1.0) / PER_OCTAVE)));
        Self::Power { excess: n - 1.0, table: table.collect() }
    }

    /// The coefficient of a link as [`Self::left`] takes it: C itself for n of 1, 1.5 and 2, its logarithm to base 2
    /// otherwise.
    #[must_use]
    #[inline(always)]
    pub fn coefficient(&self, c: f64) -> f64 {
        match self {
            Self::Linear | Self::ThreeHalves { .. } | Self::Square => c,
            Self::Power { .. } => log2(c),
        }
    }

    /// The number that a coefficient stands for.
    #[must_use]
    pub fn value(&self, coefficient: f64) -> f64 {
        match self {
            Self::Linear | Self::ThreeHalves { .. } | Self::Square => coefficient,
            Self::Power { .. } => math::exp2(coefficient),
        }
    }

    /// The coefficient of a product.
    #[must_use]
    #[inline(always)]
    pub fn times(&self, one: f64, other: f64) -> f64 {
        match self {
            Self::Linear | Self::ThreeHalves { .. } | Self::Square => one * other,
            Self::Power { .. } => one + other,
        }
    }

    /// What is left of a drop above 0.
    #[must_use]
    #[inline(always)]
    pub fn left(&self, coefficient: f64, drop: f64) -> f64 {
        match self {
            Self::Linear => drop / (1.0 + coefficient),
            Self::Square => 2.0 * drop / (1.0 + (1.0 + 4.0 * coefficient * drop).sqrt()),
            Self::ThreeHalves { table } => {
                let c = coefficient * drop.sqrt();
                let bits = c.to_bits();
                // Negative where so little is eroded that it cannot be told, and for what is not a number.
                let part = (bits >> PLACE_BITS) as i64 - FIRST_PART;
                if c.is_nan() || part < 0 {
                    return drop;
                }
                const ONE: u64 = 1023 << 52;
                let t = f64::from_bits(bits << PARTS_BITS & ((1 << 52) - 1) | ONE) - 1.0;
                let (part, t) =
                    if part as usize + 1 < table.len() { (part as usize, t) } else { (table.len() - 1, 0.0) };
                let [a, b, c, d] = table[part];
                drop * (a + t * (b + t * (c + t * d))).clamp(0.0, 1.0)
            }
            Self::Power { excess, table } => {
                let at = (coefficient + excess * log2(drop) - LOWEST) * PER_OCTAVE + 1.0;
                if at.is_nan() || at < 1.0 {
                    return drop;
                }
                let cell = (at as usize).min(table.len() - 3);
                let t = (at - cell as f64).min(1.0);
                let [a, b, c, d] = [table[cell - 1], table[cell], table[cell + 1], table[cell + 2]];
                // Lagrange's cubic through four entries.
                let (u, v, w) = (t + 1.0, t - 1.0, t - 2.0);
                let share = (b * v - c * t) * u * w * 0.5 + (d * u - a * w) * t * v * (1.0 / 6.0);
                drop * share.clamp(0.0, 1.0)
            }
        }
    }
}

/// Bits of 2^[`LOWEST`] above those of the place.
const FIRST_PART: i64 = (1023 + LOWEST as i64) << PARTS_BITS;

/// Hermite's cubic for y on a part: its value and slope at both ends are those of y.
fn cubic(n: f64, part: usize) -> [f64; 4] {
    let end = |part: usize| f64::from_bits(((FIRST_PART + part as i64) as u64) << PLACE_BITS);
    let (low, high) = (end(part), end(part + 1));
    let [(y_0, slope_0), (y_1, slope_1)] = [low, high].map(|c| {
        let y = share_left(n, c);
        let curved = math::pow(y, n);
        (y, -curved / (1.0 + n * c * curved / y) * (high - low))
    });
    [y_0, slope_0, 3.0 * (y_1 - y_0) - 2.0 * slope_0 - slope_1, 2.0 * (y_0 - y_1) + slope_0 + slope_1]
}

/// The root of y + c yⁿ = 1, by Newton's method from the right, where the convex form of the equation cannot overshoot:
/// in y for n above 1, in yⁿ below.
fn share_left(n: f64, c: f64) -> f64 {
    let convex = |power: f64, linear: f64, curved: f64, mut at: f64| {
        for _ in 0..200 {
            let low = math::pow(at, power - 1.0);
            let step = (linear * at + curved * low * at - 1.0) / (linear + curved * power * low);
            at -= step;
            if step <= 1e-16 * at {
                break;
            }
        }
        at
    };
    if n > 1.0 {
        convex(n, 1.0, c, math::pow(c, -1.0 / n).min(1.0))
    } else {
        math::pow(convex(1.0 / n, c, 1.0, (1.0 / c).min(1.0)), 1.0 / n)
    }
}

/// Logarithm to base 2 of a number above 0, to 1e-12. Below the smallest normal number it is about -1023.
#[inline(always)]
fn log2(x: f64) -> f64 {
    let bits = x.to_bits();
    let exponent = (bits >> 52) as f64 - 1023.0;
    let mantissa = f64::from_bits(bits & ((1 << 52) - 1) | 1023 << 52);
    let high = mantissa > std::f64::consts::SQRT_2;
    let (exponent, mantissa) = if high { (exponent + 1.0, mantissa * 0.5) } else { (exponent, mantissa) };
    // ln m = 2 artanh((m - 1) / (m + 1)), as its series.
    let s = (mantissa - 1.0) / (mantissa + 1.0);
    let (t, t2) = (s * s, s * s * (s * s));
    let upper = 1.0 / 5.0 + t * (1.0 / 7.0) + t2 * (1.0 / 9.0 + t * (1.0 / 11.0) + t2 * (1.0 / 13.0));
    let series = 1.0 + t * (1.0 / 3.0) + t2 * upper;
    exponent + s * series * (2.0 * std::f64::consts::LOG2_E)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The root of x + C xⁿ = b by bisection, to the last bit.
    fn bisection(n: f64, c: f64, drop: f64) -> f64 {
        let (mut lo, mut hi) = (0.0, drop);
        for _ in 0..200 {
            let mid = 0.5 * (lo + hi);
            if mid + c * math::pow(mid, n) > drop { hi = mid } else { lo = mid }
        }
        lo
    }

    #[test]
    fn every_exponent_solves_its_equation() {
        for n in [0.3, 0.7, 1.0, 1.2, 1.5, 2.0, 3.0] {
            let law = Law::new(n);
            for c_exponent in -40..60 {
                for drop in [1e-9, 0.03, 1.0, 7.3, 900.0] {
                    let c = math::exp2(0.37 + f64::from(c_exponent));
                    let found = law.left(law.coefficient(c), drop);
                    let error = (found - bisection(n, c, drop)).abs();
                    // 1e-8 of the drop is the interpolation's error, below what a height in f32 can hold.
                    assert!(error <= 1e-8 * drop, "n {n}, c {c}, drop {drop}: {found}, off by {error}");
                }
            }
        }
    }

    #[test]
    fn extreme_coefficients_stay_between_the_receiver_and_the_cell() {
        for n in [0.5, 1.0, 1.5, 1.7, 2.0] {
            let law = Law::new(n);
            for c in [0.0, f64::MIN_POSITIVE, 1e-300, 1e300, f64::MAX, f64::INFINITY] {
                for drop in [5e-324, 1e-12, 1.0, 1e9] {
                    let left = law.left(law.coefficient(c), drop);
                    assert!((0.0..=drop).contains(&left), "n {n}, c {c}, drop {drop}: {left}");
                }
            }
            assert_eq!(law.left(law.coefficient(0.0), 3.0), 3.0);
        }
    }

    #[test]
    fn the_logarithm_is_one() {
        for x in [1e-300, 3e-9, 0.7, 1.0, 1.414, 1.415, 2.0, 12345.678, 1e200] {
            assert!((log2(x) - math::log2(x)).abs() < 2e-12 * (1.0 + math::log2(x).abs()), "{x}");
        }
    }
}
