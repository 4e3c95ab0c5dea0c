//! Transcendental functions that are the same code, and so the same bits, on every machine.
//!
//! The platform's own differ in the last bits between systems; these are the `libm` crate's translations of musl, with
//! errors below one unit in the last place. Square root, floor and the four operations are exact by IEEE 754 and are
//! used directly.

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
    /// Length of the vector (x, y).
    hypot(x, y) = hypot, hypotf;
}

/// Functions for row kernels: without branches, so that the compiler can vectorise the loop around them.
pub mod lane {
    /// Arc tangent in radians, within 2e-7 of its value (relative).
    ///
    /// The argument is brought to at most tan(π/8) by `atan x = π/4 + atan((x - 1)/(x + 1))` or `π/2 - atan(1/x)`; an
    /// odd minimax polynomial of degree 9 (relative error 2e-8) does the rest.
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
}
