//! Rough ground: the knolls and hollows of hillslopes, made by rock that is harder or softer over short distances.
//!
//! The ground is a field g in metres: a sum of octaves of noise from half the length of the hillslopes √A₀ down to a few
//! cells, of equal slope. Where hillslopes are in balance they have the height that they would have on even ground plus
//! S g, with S their slope: along the way of the length d to a receiver, the law divides K by 1 + (g − gᵣ) / d, and the
//! steepest stable slope S is that of the terrain less S g. What a way gains on a knoll it loses behind it, so that the
//! heights of ridges depend neither on the ground nor on how much of it the cells can hold. With a K that varies over
//! such distances the differences along a way would add up instead.

use orograph_graph::{Job, NodeError, mix};

use super::Params;
use crate::numerics::{par, ribs::ribs, rock::Knolls, variation::Variation};

/// The least and the largest factor of a slope.
const FACTORS: [f64; 2] = [0.25, 4.0];

/// The longest waves in which the roughness varies, in √A₀, and the shortest, in the longest.
const VARIATION_WAVES: [f64; 2] = [12.0, 0.2];

/// The ground of every cell.
pub struct Ground {
    /// g in metres; empty on even ground, and where cells are too large for it.
    heights: Vec<f32>,
    /// Whether slopes have a foot beside rivers.
    has_feet: bool,
    knolls: Knolls,
    /// A factor of the roughness.
    variation: Option<Variation>,
    /// How far knolls are drawn out down a slope, to either side in wavelengths.
    ribs: f64,
}

impl Ground {
    /// Makes the ground on the cells of a job. Where `ribs_follow`, it is even until [`Self::lie_along`].
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn new(job: &Job<'_>, params: &Params, ribs_follow: bool) -> Result<Self, NodeError> {
        let knolls = Knolls::new(job, params.roughness, params.headwater_area.sqrt());
        let has_feet = params.roughness > 0.0 && params.headwater_area > 0.0;
        let heights = if ribs_follow && params.ribs > 0.0 { Vec::new() } else { knolls.all(job)? };
        let varies = has_feet && params.roughness_variation > 0.0;
        let seed = mix(job.seed() ^ mix(0x5EED_0005));
        let [longest, shortest] = VARIATION_WAVES;
        let longest_m = longest * params.headwater_area.sqrt();
        let deviation = params.roughness_variation;
        let variation = varies.then(|| Variation::of_slopes(job, deviation, longest_m, shortest, seed));
        let mut ground = Self { heights, knolls, variation, has_feet, ribs: params.ribs };
        ground.vary(job)?;
        Ok(ground)
    }

    /// Makes the ground rougher here and smoother there.
    fn vary(&mut self, job: &Job<'_>) -> Result<(), NodeError> {
        let Some(variation) = &self.variation else { return Ok(()) };
        variation.scale(job, &job.window(), &mut self.heights)
    }

    /// Makes ribs of the knolls, along the slopes of the terrain `heights`.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn lie_along(&mut self, job: &Job<'_>, heights: &[f64]) -> Result<(), NodeError> {
        if self.ribs > 0.0 {
            self.heights = Vec::new();
            let heights = par::map_of(heights, |height| *height as f32);
            self.heights = ribs(job, &self.knolls, &heights, self.ribs)?;
            self.vary(job)?;
        }
        Ok(())
    }

    /// Returns true if ground is even.
    #[must_use]
    pub fn is_even(&self) -> bool {
        self.heights.is_empty()
    }

    /// g of every cell in metres; empty on even ground.
    #[must_use]
    pub fn heights(&self) -> &[f32] {
        &self.heights
    }

    /// Returns true if slopes have a foot beside rivers, on cells of any size: where the ground is not meant to be even.
    #[must_use]
    pub const fn has_feet(&self) -> bool {
        self.has_feet
    }

    /// How much steeper than on even ground the way of `length_m` to a receiver is; 1 on even ground.
    #[must_use]
    #[inline(always)]
    pub fn steeper(&self, cell: usize, receiver: usize, length_m: f64) -> f64 {
        match (self.heights.get(cell), self.heights.get(receiver)) {
            (Some(here), Some(below)) => (1.0 + f64::from(here - below) / length_m).clamp(FACTORS[0], FACTORS[1]),
            _ => 1.0,
        }
    }
}
