//! Transcendental functions with the same code, and therefore the same bits, on every machine.
//!
//! The platform's functions differ in the last bits between systems. These are the `libm` crate's translations of musl,
//! with errors below one unit in the last place. Square root, floor and the four operations are exact by IEEE 754 and
//! are used directly.

macro_rules! functions {
    ($($(#[$meta:meta])* $name:ident($($arg:ident),+) = $double:ident, $single:ident;)+) => {
        $($(#[$meta])* #[must_use] #[inline] pub fn $name($($arg: f64),+) -> f64 { libm::$double($($arg),+) })+

        /// The same functions in single precision.
        pub mod f32 {
            $($(#[$meta])* #[must_use] #[inline] pub fn $name($($arg: f32),+) -> f32 { libm::$single($($arg),+) })+
        }
    };
}

functions! {
    /// Sine of an angle in radians.
    sin(x) = sin, sinf;
    /// Cosine of an angle in radians.
    cos(x) = cos, cosf;
    /// Tangent of an angle in radians.
    tan(x) = tan, tanf;
    /// Arc tangent in radians.
    atan(x) = atan, atanf;
    /// Angle of the point (x, y) in radians, -π to π.
    atan2(y, x) = atan2, atan2f;
    /// e to the power of x.
    exp(x) = exp, expf;
    /// 2 to the power of x.
    exp2(x) = exp2, exp2f;
    /// Natural logarithm.
    ln(x) = log, logf;
    /// Logarithm to base 2.
    log2(x) = log2, log2f;
    /// Logarithm to base 10.
    log10(x) = log10, log10f;
    /// x to the power of y.
    pow(x, y) = pow, powf;
    /// Complementary error function.
    erfc(x) = erfc, erfcf;
    /// Length of the vector (x, y).
    hypot(x, y) = hypot, hypotf;
}

/// Returns 0 at 0 and below, 1 at 1 and above, and the cubic `3 t² - 2 t³` in between, flat at both ends.
#[must_use]
#[inline]
pub fn smoothstep(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Returns the weights of four neighbours at the fraction `t` of the way from the second to the third, by the cubic of
/// E. Catmull and R. Rom (1974), "A class of local interpolating splines".
#[must_use]
#[inline]
pub fn catmull_rom(t: f64) -> [f64; 4] {
    [
        0.5 * t * (t * (2.0 - t) - 1.0),
        0.5 * (t * t * (3.0 * t - 5.0) + 2.0),
        0.5 * t * (t * (4.0 - 3.0 * t) + 1.0),
        0.5 * t * t * (t - 1.0),
    ]
}

/// Returns an order-preserving integer below 2³² for each value; −0 comes before +0.
#[must_use]
#[inline]
pub fn ordered(value: f32) -> u64 {
    let bits = value.to_bits();
    u64::from(if bits >> 31 == 1 { !bits } else { bits | 1 << 31 })
}

/// Returns the value of an integer of [`ordered`].
#[must_use]
#[inline]
pub fn from_ordered(number: u64) -> f32 {
    let bits = number as u32;
    f32::from_bits(if bits >> 31 == 1 { bits & !(1 << 31) } else { !bits })
}

/// Functions for row kernels: without branches, so that the compiler can vectorise the loop around them.
pub mod lane {
    /// Returns 0 at 0 and below, 1 at 1 and above, and the cubic `3 t² - 2 t³` in between, flat at both ends.
    #[must_use]
    #[inline(always)]
    pub fn smoothstep(t: f32) -> f32 {
        let t = if t > 0.0 { t } else { 0.0 };
        let t = if t < 1.0 { t } else { 1.0 };
        t * t * (3.0 - 2.0 * t)
    }

    /// Returns the weights of four consecutive values at a position from 0 to 1 between the second and the third: the
    /// cubic of E. Catmull and R. Rom (1974), which interpolates the values and is exact for parabolas.
    #[must_use]
    #[inline(always)]
    pub fn catmull_rom(t: f32) -> [f32; 4] {
        let r = 1.0 - t;
        [-0.5 * t * (r * r), 1.0 + t * t * (1.5 * t - 2.5), 1.0 + r * r * (1.5 * r - 2.5), -0.5 * r * (t * t)]
    }

    /// Arc tangent in radians, with a relative error of 2e-7.
    ///
    /// The argument is reduced to at most tan(π/8) by `atan x = π/4 + atan((x - 1)/(x + 1))` or `π/2 - atan(1/x)`; then
    /// an odd minimax polynomial of degree 9 (relative error 2e-8) applies.
    #[must_use]
    #[inline(always)]
    pub fn atan(x: f32) -> f32 {
        const TAN_EIGHTH: f32 = 0.414_213_57;
        const TAN_THREE_EIGHTHS: f32 = 2.414_213_7;
        use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};
        let t = x.abs();
        let (steep, middle) = (t > TAN_THREE_EIGHTHS, t > TAN_EIGHTH);
        let above = if steep { -1.0 } else { t - 1.0 };
        let below = if steep { t } else { t + 1.0 };
        let offset = if steep { FRAC_PI_2 } else { FRAC_PI_4 };
        let r = if middle { above / below } else { t };
        let z = r * r;
        let q = ((0.080_537_22 * z - 0.138_776_77) * z + 0.199_777_1) * z - 0.333_329_5;
        let angle = r + r * z * q;
        (if middle { offset + angle } else { angle }).copysign(x)
    }

    /// 1 / x for normal x above 0 and below 1e37, with a relative error of 1.2e-6, in a third of the time of a
    /// division.
    ///
    /// An estimate from the bits and two Newton steps, with constants that centre the error.
    #[must_use]
    #[inline(always)]
    pub fn inverse(x: f32) -> f32 {
        let t = f32::from_bits(0x7ef3_0000_u32.wrapping_sub(x.to_bits()));
        let t = t * (2.001_25 - x * t);
        t * (2.000_001 - x * t)
    }

    /// 1 / √x for normal x above 0, with a relative error of 8e-7. It is finite at 0, so that x times it is √x there
    /// too.
    ///
    /// An estimate from the bits and two Newton steps, with constants that centre the error (Walczyk, Moroz and
    /// Cieśliński 2021).
    #[must_use]
    #[inline(always)]
    pub fn inverse_root(x: f32) -> f32 {
        let half = 0.5 * x;
        let t = f32::from_bits(0x5f37_6908_u32.wrapping_sub(x.to_bits() >> 1));
        let t = t * (1.500_878_9 - half * t * t);
        t * (1.500_000_6 - half * t * t)
    }

    /// e to the power of x, with the error of [`pow`].
    #[must_use]
    #[inline(always)]
    pub fn exp(x: f32) -> f32 {
        pow(std::f32::consts::E, x)
    }

    /// x to the power of y for x of 0 or more.
    ///
    /// 2^(y log₂ x). The relative error is below 1e-7 (4 + |log₂ of the result|). Results below 1e-30 become 0, as does
    /// any power of 0; results are at most 2¹²⁷.
    #[must_use]
    #[inline(always)]
    pub fn pow(x: f32, y: f32) -> f32 {
        let result = exp2(y * log2(x));
        if x > 0.0 { result } else { 0.0 }
    }

    /// Logarithm to base 2, within 2e-7 (1 + |the result|); that of 0 is -126.
    ///
    /// By the series of the area tangent.
    #[must_use]
    #[inline(always)]
    pub fn log2(x: f32) -> f32 {
        // x = m 2^k with m from √½ to √2
        let bits = x.max(f32::MIN_POSITIVE).to_bits() as i32;
        let k = bits.wrapping_sub(0x3f35_04f3) >> 23;
        let m = f32::from_bits(bits.wrapping_sub(k << 23) as u32);
        let z = (m - 1.0) / (m + 1.0);
        let z2 = z * z;
        let series = 1.0 + z2 * (1.0 / 3.0 + z2 * (1.0 / 5.0 + z2 * (1.0 / 7.0 + z2 * (1.0 / 9.0))));
        k as f32 + z * series * (2.0 * std::f32::consts::LOG2_E)
    }

    /// 2 to the power of x, with a relative error of 3e-7; 0 below -100, and 2¹²⁷ above 127.
    ///
    /// By the series of the exponential.
    #[must_use]
    #[inline(always)]
    pub fn exp2(x: f32) -> f32 {
        // 2^x = 2^whole 2^r with r from -½ to ½
        let x = x.clamp(-126.0, 127.0);
        const SHIFT: f32 = 12_582_912.0; // 1.5 · 2²³: a sum with it is rounded to a whole number, kept in the low bits
        let shifted = x + SHIFT;
        let whole = (shifted.to_bits() as i32).wrapping_sub(SHIFT.to_bits() as i32);
        let r = (x - (shifted - SHIFT)) * std::f32::consts::LN_2;
        let tail = 1.0 / 24.0 + r * (1.0 / 120.0 + r * (1.0 / 720.0 + r * (1.0 / 5040.0)));
        let exp = 1.0 + r * (1.0 + r * (0.5 + r * (1.0 / 6.0 + r * tail)));
        let result = exp * f32::from_bits((whole.wrapping_add(127) << 23) as u32);
        if x > -100.0 { result } else { 0.0 }
    }

    /// 2 to the power of x in double precision, with a relative error of 1e-11; x is clamped to -1000 to 1000.
    ///
    /// By the series of the exponential.
    #[must_use]
    #[inline(always)]
    pub fn exp2_double(x: f64) -> f64 {
        let x = x.clamp(-1000.0, 1000.0);
        const SHIFT: f64 = 6_755_399_441_055_744.0; // 1.5 · 2⁵²: as in `exp2`
        let shifted = x + SHIFT;
        let whole = (shifted.to_bits() as i64).wrapping_sub(SHIFT.to_bits() as i64);
        let r = (x - (shifted - SHIFT)) * std::f64::consts::LN_2;
        let tail = 1.0 / 720.0 + r * (1.0 / 5040.0 + r * (1.0 / 40_320.0 + r * (1.0 / 362_880.0)));
        let exp = 1.0 + r * (1.0 + r * (0.5 + r * (1.0 / 6.0 + r * (1.0 / 24.0 + r * (1.0 / 120.0 + r * tail)))));
        exp * f64::from_bits((whole.wrapping_add(1023) as u64) << 52)
    }

    /// Cosine and sine of an angle in 2³²nds of a turn, within 1.5e-7.
    ///
    /// By the series of both up to an eighth of a turn.
    #[must_use]
    #[inline(always)]
    pub fn turn(angle: u32) -> [f32; 2] {
        let quarters = angle.wrapping_add(1 << 29) >> 30;
        let rest = angle.wrapping_sub(quarters << 30) as i32;
        let x = rest as f32 * (std::f32::consts::TAU / 4_294_967_296.0);
        let z = x * x;
        let sin = x + x * z * (-1.0 / 6.0 + z * (1.0 / 120.0 + z * (-1.0 / 5040.0 + z * (1.0 / 362_880.0))));
        let cos = 1.0 + z * (-0.5 + z * (1.0 / 24.0 + z * (-1.0 / 720.0 + z * (1.0 / 40_320.0))));
        let (first, second) = if quarters & 1 == 1 { (sin, cos) } else { (cos, sin) };
        let signs = [quarters.wrapping_add(1) & 2, quarters & 2].map(|half| half << 30);
        [f32::from_bits(first.to_bits() ^ signs[0]), f32::from_bits(second.to_bits() ^ signs[1])]
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_lane_arc_tangent_is_within_its_error() {
        let mut worst = 0.0_f64;
        for bits in (0..f32::INFINITY.to_bits()).step_by(9973) {
            let x = f32::from_bits(bits);
            let exact = libm::atan(f64::from(x));
            if exact > 1e-30 {
                worst = worst.max((f64::from(super::lane::atan(x)) / exact - 1.0).abs());
            }
            assert_eq!(super::lane::atan(-x), -super::lane::atan(x));
        }
        assert!(worst < 2e-7, "{worst}");
        assert_eq!(super::lane::atan(f32::INFINITY), std::f32::consts::FRAC_PI_2);
        assert!(super::lane::atan(f32::NAN).is_nan());
    }

    #[test]
    fn the_cubic_goes_through_values_and_is_exact_for_parabolas() {
        assert_eq!(super::lane::catmull_rom(0.0), [0.0, 1.0, 0.0, 0.0]);
        assert_eq!(super::lane::catmull_rom(1.0), [0.0, 0.0, 1.0, 0.0]);
        for k in 0..=16 {
            let t = k as f32 / 16.0;
            let parabola = |x: f32| 3.0 - 2.0 * x + 1.5 * x * x;
            let places = [-1.0, 0.0, 1.0, 2.0];
            let sum: f32 = super::lane::catmull_rom(t).iter().zip(places).map(|(w, x)| w * parabola(x)).sum();
            assert!((sum - parabola(t)).abs() < 2e-6, "{t}");
        }
    }

    #[test]
    fn ordered_numbers_are_in_the_order_of_values() {
        let values = [f32::MIN, -1.5, -1.0e-30, -0.0, 0.0, 1.0e-30, 2.0, f32::MAX];
        assert!(values.map(super::ordered).is_sorted());
        assert!(values.iter().all(|&v| super::from_ordered(super::ordered(v)).to_bits() == v.to_bits()));
    }

    #[test]
    fn lane_inverses_are_within_their_errors() {
        for bits in (1e-37_f32.to_bits()..1e37_f32.to_bits()).step_by(9973) {
            let x = f32::from_bits(bits);
            let inverse = f64::from(super::lane::inverse(x)) * f64::from(x);
            let root = f64::from(super::lane::inverse_root(x)) * f64::from(x).sqrt();
            assert!((inverse - 1.0).abs() < 1.2e-6 && (root - 1.0).abs() < 8e-7, "{x}: {inverse} {root}");
        }
        assert_eq!(0.0 * super::lane::inverse_root(0.0), 0.0);
    }

    #[test]
    fn turns_logarithms_and_powers_of_two_are_within_their_errors() {
        for k in 0..200_000_u32 {
            let angle = k.wrapping_mul(2_654_435_769);
            let radians = f64::from(angle) * (std::f64::consts::TAU / 4_294_967_296.0);
            let [cos, sin] = super::lane::turn(angle).map(f64::from);
            assert!((cos - libm::cos(radians)).abs() < 1.5e-7 && (sin - libm::sin(radians)).abs() < 1.5e-7, "{angle}");
        }
        assert_eq!(super::lane::turn(0), [1.0, 0.0]);
        for bits in (f32::MIN_POSITIVE.to_bits()..f32::INFINITY.to_bits()).step_by(9973) {
            let exact = libm::log2(f64::from(f32::from_bits(bits)));
            let log = super::lane::log2(f32::from_bits(bits));
            assert!((f64::from(log) - exact).abs() < 2e-7 * (1.0 + exact.abs()), "{exact}");
            if (-100.0..127.0).contains(&log) && log != -100.0 {
                let power = f64::from(super::lane::exp2(log)) / libm::exp2(f64::from(log));
                assert!((power - 1.0).abs() < 3e-7, "{log} {power}");
            }
        }
        for k in -99_900..=99_900 {
            let x = f64::from(k) * 0.01;
            assert!((super::lane::exp2_double(x) / libm::exp2(x) - 1.0).abs() < 1e-11, "{x}");
        }
        assert_eq!([-2e9, 0.0, 2e9].map(super::lane::exp2_double), [-1000.0, 0.0, 1000.0].map(libm::exp2));
        assert_eq!([-100.0, -1e9, 0.0, 1e9].map(super::lane::exp2), [0.0, 0.0, 1.0, super::f32::exp2(127.0)]);
    }

    #[test]
    fn the_power_of_lanes_is_a_power() {
        for y in [-2.0_f32, 0.25, 0.5, 1.0, 1.4, 3.0, 8.0] {
            assert_eq!((super::lane::pow(0.0, y), super::lane::pow(1.0, y)), (0.0, 1.0));
            for k in 1..8000 {
                let x = k as f32 / 2000.0;
                let expected = super::pow(f64::from(x), f64::from(y));
                let error = (f64::from(super::lane::pow(x, y)) - expected).abs();
                let bound = 1e-7 * (4.0 + super::log2(expected).abs()) * expected;
                assert!(error <= bound.max(1e-30), "{x}^{y}: {error} {expected}");
            }
        }
        assert_eq!(super::lane::pow(1e30, 100.0), super::f32::exp2(127.0));
    }
}
