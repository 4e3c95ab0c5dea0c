//! The realism score: how far a terrain lies outside of what real land measures.
//!
//! Each measure of a part has a natural range, that of all tiles of the real models. What lies outside counts with its
//! distance from the range, in standard deviations of the tiles; what lies inside is perfect, for nature is varied. A
//! part's excess is the root of the sum of the squares, so that one impossible measure is enough, and no number of
//! perfect ones makes up for it: a sum of windows could be gamed. A part scores `1 / (1 + excess)` over the median
//! score of real models when each is left out of the table, and the terrain scores the least of its parts.

use std::sync::LazyLock;

use super::real::{Real, Tile, spread};
use crate::prelude::*;

/// Median slope in degrees below which forms and classes of slope do not count: level ground has but one.
const GENTLE: f64 = 3.0;

/// A part of the score.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Slopes, roughness, spectrum and forms.
    Texture,
    /// Rivers, basins and valleys.
    Drainage,
    /// What only a computation leaves.
    Marks,
}

impl Part {
    /// All parts.
    pub const ALL: [Self; 3] = [Self::Texture, Self::Drainage, Self::Marks];

    /// The measures of the part, each with the least unit of its distances: what a tile of 10 km leaves uncertain.
    #[must_use]
    pub fn measures(self) -> &'static [(&'static str, f64)] {
        match self {
            Self::Texture => &[
                ("slope.p95_to_p50", 0.2),
                ("roughness.two_cells", 0.1),
                ("roughness.laplacian_skew", 0.5),
                ("spectrum.beta", 0.3),
                ("spectrum.beta_8_to_24_cells", 0.3),
                ("forms.ridge", 0.03),
                ("forms.spur", 0.03),
                ("forms.hollow", 0.03),
                ("forms.valley", 0.03),
            ],
            Self::Drainage => &[
                ("pits.share", 0.02),
                ("drainage_density", 0.1),
                ("concavity", 0.1),
                ("concavity.scatter", 0.1),
                ("hack_exponent", 0.05),
                ("streams.bifurcation_ratio", 0.5),
                ("streams.area_ratio", 0.5),
                ("channels.sinuosity", 0.05),
                ("valleys.exponent", 0.15),
                ("valleys.floor", 0.03),
            ],
            Self::Marks => &[
                ("planar_share", 0.005),
                ("slope.fullest_5_degrees", 0.05),
                ("aspect.four_fold", 0.05),
                ("aspect.eight_fold", 0.03),
                ("channels.straight", 0.03),
                ("channels.eight_fold", 0.04),
                ("border.comb", 0.05),
            ],
        }
    }

    /// How far each measure of the part lies outside of its natural range among the tiles that `known` accepts, in
    /// standard deviations. Measures without a value are left out.
    pub fn excesses(self, measured: &dyn Fn(&str) -> f64, known: &dyn Fn(&Tile) -> bool) -> Vec<(&'static str, f64)> {
        let gentle = measured("slope.p50") < GENTLE;
        let excess = |(name, least): &(&'static str, f64)| {
            if gentle && (name.starts_with("forms.") || *name == "slope.fullest_5_degrees") {
                return None;
            }
            let value = measured(name);
            let natural: Vec<f64> = Real::table().values(name, known).collect();
            let [_, spread] = spread(&natural);
            if !value.is_finite() || natural.len() < 4 {
                return None;
            }
            let low = natural.iter().copied().fold(f64::INFINITY, f64::min);
            let high = natural.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let outside = (low - value).max(value - high).max(0.0);
            Some((*name, outside / spread.max(*least)))
        };
        self.measures().iter().filter_map(excess).collect()
    }

    /// The score of a part before it is scaled; NaN if nothing is measured.
    fn raw(self, measured: &dyn Fn(&str) -> f64, known: &dyn Fn(&Tile) -> bool) -> f64 {
        let excesses = self.excesses(measured, known);
        let square: f64 = excesses.iter().map(|(_, excess)| excess * excess).sum();
        if excesses.is_empty() { f64::NAN } else { 1.0 / (1.0 + square.sqrt()) }
    }

    /// The median of the raw scores of whole real models, each left out of the table.
    fn scale(self) -> f64 {
        static SCALES: LazyLock<[f64; 3]> = LazyLock::new(|| {
            Part::ALL.map(|part| {
                let mut scores: Vec<f64> = wholes().map(|tile| part.left_out(tile)).collect();
                scores.sort_unstable_by(f64::total_cmp);
                scores[scores.len() / 2]
            })
        });
        SCALES[self as usize]
    }

    /// The raw score of a tile when its model is left out of the table.
    fn left_out(self, tile: &Tile) -> f64 {
        let value = |name: &str| Real::table().values(name, |other| other.is(tile)).next().unwrap_or(f64::NAN);
        self.raw(&value, &|other| other.model != tile.model)
    }
}

impl Tile {
    fn is(&self, other: &Self) -> bool {
        (self.model, self.part) == (other.model, other.part)
    }
}

/// The least unit of the distances of a measure.
pub(super) fn least(measure: &str) -> f64 {
    let shares = if measure.starts_with("forms.") || measure.starts_with("pits.") { 0.01 } else { 0.0 };
    let measures = Part::ALL.iter().flat_map(|part| part.measures());
    measures.filter(|(name, _)| *name == measure).map(|(_, least)| *least).next().unwrap_or(shares)
}

/// The whole models of the table.
fn wholes() -> impl Iterator<Item = &'static Tile> {
    Real::table().tiles.iter().filter(|tile| tile.part == "whole")
}

/// The score of a terrain and its parts.
#[derive(Clone, Copy, Debug)]
pub struct Score {
    /// In the order of [`Part::ALL`].
    pub parts: [f64; 3],
}

impl Score {
    /// Scores measures at cells of 80 to 100 m.
    #[must_use]
    pub fn of(report: &Report) -> Self {
        let value = |name: &str| report.get(name).unwrap_or(f64::NAN);
        Self { parts: Part::ALL.map(|part| part.raw(&value, &|_| true) / part.scale()) }
    }

    /// Scores a real tile, its model left out of the table.
    #[must_use]
    pub fn left_out(tile: &Tile) -> Self {
        Self { parts: Part::ALL.map(|part| part.left_out(tile) / part.scale()) }
    }

    /// The least of the parts; NaN if one of them could not be measured.
    #[must_use]
    pub fn least(&self) -> f64 {
        self.parts
            .iter()
            .copied()
            .fold(f64::INFINITY, |a, b| if a.is_nan() || b.is_nan() { f64::NAN } else { a.min(b) })
    }
}
