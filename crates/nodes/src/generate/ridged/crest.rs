//! The crest function of a ridged octave, and the mean contribution of octaves.

use crate::numerics::noise::{Gradients, fold::distribution};

/// The crest function (1 − |n| / offset)^exponent, 0 beyond, and the weights between octaves.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crest {
    gradients: Gradients,
    /// Value of |n| where the function reaches 0.
    offset: f64,
    /// The exponent.
    pub exponent: f32,
    /// Factor from an octave's height to the weight of the next.
    pub weight_gain: f32,
    /// Mean of the crest function over the distribution of noise.
    pub mean: f32,
}

impl Crest {
    pub fn new(gradients: Gradients, offset: f64, exponent: f64, weight_gain: f64) -> Self {
        let mut crest =
            Self { gradients, offset, exponent: exponent as f32, weight_gain: weight_gain as f32, mean: 0.0 };
        crest.mean = (crest.draws().iter().sum::<f64>() / 32.0) as f32;
        crest
    }

    /// Returns the crest function over the distribution of the noise.
    fn draws(&self) -> [f64; 32] {
        distribution(self.gradients).map(|n| {
            let ridge = (1.0 - n / self.offset).max(0.0);
            crate::numerics::math::pow(ridge, f64::from(self.exponent))
        })
    }
}

/// The mean contribution of octaves that are too fine for the raster, as a function of their first weight w: `linear ·
/// w + square · w²` metres, fitted at w = ½ and w = 1.
///
/// With Mₖ(w) the mean of octave k and all finer ones, Mₖ(w) = E[aₖ w c + Mₖ₊₁(min(G w c, 1))], where c is the crest
/// function of a random draw of noise. Octaves are independent except for the correlation of neighbouring places.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tail {
    linear: f32,
    square: f32,
}

impl Tail {
    /// Computes the tail from the remaining octaves, from coarse to fine, with their maximum heights in metres.
    pub fn new(left: &[(Crest, f64)]) -> Self {
        /// Weights at which the means are tabulated, 0 to 1.
        const NODES: usize = 65;
        let weight = |node: usize| node as f64 / (NODES - 1) as f64;
        let mut finer = [0.0; NODES];
        for (crest, height_m) in left.iter().rev() {
            let draws = crest.draws();
            finer = std::array::from_fn(|node| {
                let mean = draws.iter().map(|c| {
                    let ridge = weight(node) * c;
                    let next = (f64::from(crest.weight_gain) * ridge).min(1.0) * (NODES - 1) as f64;
                    let at = (next as usize).min(NODES - 2);
                    height_m * ridge + finer[at] + (next - at as f64) * (finer[at + 1] - finer[at])
                });
                mean.sum::<f64>() / draws.len() as f64
            });
        }
        let (half, whole) = (finer[NODES / 2], finer[NODES - 1]);
        Self { linear: (4.0 * half - whole) as f32, square: (2.0 * whole - 4.0 * half) as f32 }
    }

    /// Returns the factors of the weight and of its square.
    pub const fn factors(&self) -> [f32; 2] {
        [self.linear, self.square]
    }

    /// Returns the mean contribution at a weight, in metres.
    #[inline(always)]
    pub fn at(&self, weight: f32) -> f32 {
        weight * (self.linear + self.square * weight)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With one octave left the tail is the mean of that octave; with none it is 0.
    #[test]
    fn the_tail_is_the_mean_of_what_is_left() {
        let crest = Crest::new(Gradients::Even, 1.0, 2.0, 2.0);
        assert!((crest.mean - 0.5925).abs() < 0.002, "{}", crest.mean); // 1 − 2 E|n| + E n²
        assert_eq!(Tail::new(&[]), Tail { linear: 0.0, square: 0.0 });
        let one = Tail::new(&[(crest, 10.0)]);
        assert!((one.linear - 10.0 * crest.mean).abs() < 1e-4 && one.square.abs() < 1e-4, "{one:?}");
        let two = Tail::new(&[(crest, 10.0), (crest, 5.0)]);
        let extra = two.linear + two.square - 10.0 * crest.mean;
        assert!(extra > 0.0 && extra < 5.0 * crest.mean, "{two:?}");
    }
}
