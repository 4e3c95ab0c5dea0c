//! Factors that vary from place to place: their logarithm is a random field of long waves, cut off on both sides.

use orograph_graph::{Job, NodeError, Window};

use super::{
    math, par,
    rock::grain,
    waves::{Sampler, Waves},
};

/// The spectral slope of waves of smooth and rough slopes, and how much longer they are along the grain of the rock than
/// across it.
const SLOPES: f64 = 2.6;
const SLOPES_STRETCH: f64 = 2.5;
/// Standard deviations at which they are cut off, to the smooth and to the rough side: ground that is much rougher than
/// the mean looks crumpled.
const MOST_DEVIATIONS: [f64; 2] = [2.0, 1.0];

/// A factor as a function of position.
pub struct Variation {
    /// Standard deviation of its natural logarithm, before the waves are cut off.
    pub deviation: f64,
    /// The waves, in standard deviations.
    pub waves: Sampler,
    /// Standard deviations at which they are cut off, below and above.
    pub most: [f64; 2],
}

impl Variation {
    /// How rough slopes are beside each other, in waves from `longest_m` down to the fraction `shortest` of it.
    #[must_use]
    pub fn of_slopes(job: &Job<'_>, deviation: f64, longest_m: f64, shortest: f64, seed: u32) -> Self {
        let (grain, spectral_slope) = (grain(job.seed()), SLOPES);
        let waves = Waves { longest_m, spectral_slope, stretch: SLOPES_STRETCH, grain, seed };
        Self { deviation, waves: waves.sampler(shortest * longest_m, job.world()), most: MOST_DEVIATIONS }
    }

    /// Multiplies a value per cell by the factor, over its root mean square.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn scale(&self, job: &Job<'_>, window: &Window, values: &mut [f32]) -> Result<(), NodeError> {
        let mean = self.root_mean_square();
        par::each(values.chunks_mut(window.nx()), |j, values| {
            job.check()?;
            for (value, wave) in values.iter_mut().zip(self.waves.row(window, j)) {
                *value *= (math::exp(self.log_of(wave)) / mean) as f32;
            }
            Ok(())
        })
    }

    /// The natural logarithm of the factor at a position in metres.
    #[must_use]
    pub fn log(&self, place_m: [f64; 2]) -> f64 {
        self.log_of(self.waves.at(place_m))
    }

    /// The natural logarithm of the factor where the waves have this value.
    fn log_of(&self, waves: f64) -> f64 {
        self.deviation * waves.clamp(-self.most[0], self.most[1])
    }

    /// The root mean square of the factor, for normally distributed waves: the sum over quantiles.
    fn root_mean_square(&self) -> f64 {
        root_mean_square(self.deviation, self.most)
    }
}

fn root_mean_square(deviation: f64, most: [f64; 2]) -> f64 {
    const STEPS: i32 = 400;
    let weight = |wave: f64| math::exp(-0.5 * wave * wave);
    let waves = || (-STEPS..=STEPS).map(|step| 4.0 * f64::from(step) / f64::from(STEPS));
    let square = |wave: f64| math::exp(2.0 * deviation * wave.clamp(-most[0], most[1]));
    let sum: f64 = waves().map(|wave| weight(wave) * square(wave)).sum();
    (sum / waves().map(weight).sum::<f64>()).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ∫ exp(2 σ min(w, 1)) over a normal distribution is exp(2 σ²) Φ(1 − 2 σ) + exp(2 σ) Φ(−1).
    #[test]
    fn the_root_mean_square_is_that_of_a_normal_distribution() {
        assert_eq!(root_mean_square(0.0, [2.0, 1.0]), 1.0);
        let expected = (math::exp(0.5) * 0.5 + math::exp(1.0) * 0.158_655_3_f64).sqrt();
        // the cut at −2 standard deviations adds a thousandth
        let found = root_mean_square(0.5, [2.0, 1.0]);
        assert!((found - expected).abs() < 2e-3, "{found} {expected}");
    }
}
