//! Folded noise |n| with rounded creases, and its distribution.

use super::Gradients;

/// Returns the distribution of |n| for noise n of standard deviation 0.305 ([`Gradients::even_scale`]): the means of
/// its 32 quantile bins, ascending.
///
/// Measured on 33 million samples; a test repeats the measurement.
pub(crate) const fn distribution(gradients: Gradients) -> [f64; 32] {
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

/// Returns the mean of a function of |n| for noise n of standard deviation 0.305.
pub(crate) fn mean(gradients: Gradients, function: impl Fn(f64) -> f64) -> f64 {
    distribution(gradients).map(function).iter().sum::<f64>() / 32.0
}

/// 1 − |n| with a crest that is rounded over about a cell.
///
/// It is the mean of 1 − |n| over a cell where the noise crosses zero with its typical slope, 0.9 per wavelength: |n|
/// itself beyond half a cell from the crossing, (n² + r²) / 2r within.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fold {
    /// Half-width r of the rounding, and 1 / 2r.
    round: f32,
    half_per_round: f32,
    /// 1 − r / 2, the crest where the noise is 0.
    top: f32,
}

impl Fold {
    /// Creates the fold for an octave of that many cells per wavelength and noise in units of `unit`.
    pub fn new(wavelength_cells: f64, unit: f64) -> Self {
        let round = (0.45 / (wavelength_cells * unit)) as f32;
        Self { round, half_per_round: 0.5 / round, top: 1.0 - 0.5 * round }
    }

    /// Returns the half-width of the rounding, 1 over twice it, and the crest, for shaders.
    pub const fn parts(&self) -> [f32; 3] {
        [self.round, self.half_per_round, self.top]
    }

    /// Returns 1 − |n|, rounded.
    #[inline(always)]
    pub fn crest(&self, noise: f32) -> f32 {
        let distance = noise.abs();
        // unlike `min`, which handles NaN, one instruction
        let near = if distance < self.round { distance } else { self.round };
        (self.top - (distance - near)) - near * near * self.half_per_round
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

    /// Beyond the rounding it is 1 − |n|, and value and slope are continuous.
    #[test]
    fn a_crest_is_rounded_and_straight_beyond() {
        let fold = Fold::new(4.5, 1.0);
        assert_eq!(fold.round, 0.1);
        assert!((fold.crest(0.5) - 0.5).abs() < 1e-6 && (fold.crest(-0.1) - 0.9).abs() < 1e-6);
        assert!((fold.crest(0.0) - 0.95).abs() < 1e-6);
        let slope = |n: f32| (fold.crest(n + 1e-3) - fold.crest(n - 1e-3)) / 2e-3;
        assert!((slope(0.1) + 1.0).abs() < 0.01 && slope(0.0).abs() < 1e-3);
    }
}
