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
