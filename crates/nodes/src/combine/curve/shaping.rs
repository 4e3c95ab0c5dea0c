//! Shaping functions for levels: from 0..1 to 0..1, keeping both ends.
//!
//! In addition to the power of a gamma, these are the shaping functions of G. Dahan (2025), "La création et la
//! manipulation de champs de hauteur": 2 (eˣ − 1), 6x⁵ − 15x⁴ + 10x³, 2 atan 2x and k tan x on −1..1. Their factors
//! cancel because both ends are kept. The quintic is made for 0..1 and gives −31 at −1, so it is mirrored at the
//! middle.

use crate::numerics::math;

/// A function from 0..1 to 0..1, without branches so that row kernels vectorise.
pub(super) trait Bend: Copy {
    /// Returns the value of the function at `inside`.
    fn bend(self, inside: f32) -> f32;
}

/// A power.
#[derive(Clone, Copy)]
pub(super) struct Power(pub f32);

/// The exponential: flat low and steep high.
#[derive(Clone, Copy)]
pub(super) struct Exponential;

/// The quintic, mirrored: level at both ends and in the middle.
#[derive(Clone, Copy)]
pub(super) struct Quintic;

/// The arc tangent: steep in the middle.
#[derive(Clone, Copy)]
pub(super) struct Arctangent;

/// The tangent: steep at both ends.
#[derive(Clone, Copy)]
pub(super) struct Tangent;

impl Bend for Power {
    #[inline(always)]
    fn bend(self, inside: f32) -> f32 {
        if self.0 == 1.0 { inside } else { math::lane::pow(inside, self.0) }
    }
}

impl Bend for Exponential {
    #[inline(always)]
    fn bend(self, inside: f32) -> f32 {
        let [low, high] = [math::lane::exp(-1.0), math::lane::exp(1.0)];
        (math::lane::exp(2.0 * inside - 1.0) - low) / (high - low)
    }
}

impl Bend for Quintic {
    #[inline(always)]
    fn bend(self, inside: f32) -> f32 {
        let x = 2.0 * inside - 1.0;
        let t = x.abs();
        let quintic = t * t * t * (t * (6.0 * t - 15.0) + 10.0);
        0.5 + 0.5 * quintic.copysign(x)
    }
}

impl Bend for Arctangent {
    #[inline(always)]
    fn bend(self, inside: f32) -> f32 {
        0.5 + 0.5 * (math::lane::atan(2.0 * (2.0 * inside - 1.0)) / math::lane::atan(2.0))
    }
}

impl Bend for Tangent {
    #[inline(always)]
    fn bend(self, inside: f32) -> f32 {
        // the continued fraction of J. H. Lambert (1761), within 3e-7 up to 1
        let tan = |x: f32| {
            let square = x * x;
            x * (945.0 - square * (105.0 - square)) / (945.0 - square * (420.0 - 15.0 * square))
        };
        0.5 + 0.5 * (tan(2.0 * inside - 1.0) / tan(1.0))
    }
}
