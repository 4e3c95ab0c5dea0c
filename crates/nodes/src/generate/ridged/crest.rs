//! The crest function of a ridged octave and what octaves are on average.

use crate::generate::noise::Gradients;

/// The distribution of |n| for noise n of standard deviation 0.305 ([`Gradients::even_scale`]): the means of its 32 equal
/// parts, from small to large.
///
/// Measured on 33 million samples; a test measures it again.
const fn distribution(gradients: Gradients) -> [f64; 32] {
    match gradients {
        Gradients::Even => [
            0.0065, 0.0197, 0.0329, 0.0462, 0.0594, 0.0727, 0.0862, 0.0998, 0.1135, 0.1272, 0.1413, 0.1554, 0.1698,
            0.1844, 0.1994, 0.2146, 0.2302, 0.2463, 0.2628, 0.2798, 0.2976, 0.3161, 0.3355, 0.3560, 0.3779, 0.4016,
            0.4274, 0.4559, 0.4887, 0.5279, 0.5801, 0.6921,
        ],
        Gradients::Classic => [
            0.0059, 0.0183, 0.0311, 0.0440, 0.0571, 0.0704, 0.0841, 0.0981, 0.1123, 0.1266, 0.1411, 0.1555, 0.1699,
            0.1841, 0.1980, 0.2114, 0.2252, 0.2389, 0.2532, 0.2682, 0.2856, 0.3054, 0.3272, 0.3503, 0.3755, 0.4025,
            0.4314, 0.4639, 0.4980, 0.5405, 0.5960, 0.6880,
        ],
    }
}

/// The crest function (1 − |n| / offset)^exponent, 0 beyond, and the weights between octaves.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crest {
    gradients: Gradients,
    /// Where the function reaches 0.
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

    /// The crest function over the distribution of the noise.
    fn draws(&self) -> [f64; 32] {
        distribution(self.gradients).map(|n| {
            let ridge = (1.0 - n / self.offset).max(0.0);
            crate::math::pow(ridge, f64::from(self.exponent))
        })
    }
}

/// The mean of what octaves beyond the raster's would add, as a function of the weight w that reaches them:
/// `linear · w + square · w²` metres, fitted at w = ½ and w = 1.
///
/// With Mₖ(w) the mean of octave k and all finer ones, Mₖ(w) = E[aₖ w c + Mₖ₊₁(min(G w c, 1))], c the crest function of
/// a random draw of noise. That octaves are independent is exact but for the correlation of neighbouring places.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tail {
    linear: f32,
    square: f32,
}

impl Tail {
    /// From the largest heights in metres of the octaves that are left, from coarse to fine.
    pub fn new(crest: &Crest, left_m: &[f64]) -> Self {
        /// Weights at which the means are tabulated, 0 to 1.
        const NODES: usize = 65;
        let draws = crest.draws();
        let weight = |node: usize| node as f64 / (NODES - 1) as f64;
        let mut finer = [0.0; NODES];
        for height_m in left_m.iter().rev() {
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

    /// The mean at a weight, in metres.
    #[inline(always)]
    pub fn at(&self, weight: f32) -> f32 {
        weight * (self.linear + self.square * weight)
    }
}

#[cfg(test)]
mod tests {
    use orograph_graph::Window;

    use super::*;
    use crate::testing::{generate, world};

    #[test]
    fn the_distribution_is_that_of_the_noise() {
        let window = Window::whole(world(4096, 2048, 10.0));
        for gradients in [Gradients::Even, Gradients::Classic] {
            let changes = format!("wavelength=107,octaves=1,amplitude=1,gradients={}", gradients.name());
            let mut all = generate(window, &crate::generate::perlin::NODE, &changes).into_samples();
            all.iter_mut().for_each(|n| *n = n.abs() * (gradients.even_scale() / gradients.basis().scale()));
            all.sort_unstable_by(f32::total_cmp);
            for (part, expected) in all.chunks_exact(all.len() / 32).zip(distribution(gradients)) {
                let mean = part.iter().map(|&n| f64::from(n)).sum::<f64>() / part.len() as f64;
                assert!((mean - expected).abs() < 0.005, "{gradients:?}: {mean} {expected}");
            }
        }
    }

    /// With one octave left the mean is that of the octave; with none it is nothing.
    #[test]
    fn the_tail_is_the_mean_of_what_is_left() {
        let crest = Crest::new(Gradients::Even, 1.0, 2.0, 2.0);
        assert!((crest.mean - 0.5925).abs() < 0.002, "{}", crest.mean); // 1 − 2 E|n| + E n²
        assert_eq!(Tail::new(&crest, &[]), Tail { linear: 0.0, square: 0.0 });
        let one = Tail::new(&crest, &[10.0]);
        assert!((one.linear - 10.0 * crest.mean).abs() < 1e-4 && one.square.abs() < 1e-4, "{one:?}");
        let two = Tail::new(&crest, &[10.0, 5.0]);
        let extra = two.linear + two.square - 10.0 * crest.mean;
        assert!(extra > 0.0 && extra < 5.0 * crest.mean, "{two:?}");
    }
}
