//! Kinds of terrain: where their measures lie, and their natural spread.

use super::real::{Real, spread};
use crate::prelude::*;

choice! {
    /// The kind of terrain to compare with.
    pub enum Kind {
        /// No kind: only the realism score.
        None = "none",
        /// Mountains cut by rivers: San Gabriel Mountains, Mandakini basin, Cumberland, Front Range.
        Fluvial = "fluvial",
        /// Uplands formed by glaciers: Glen Coe, Front Range.
        Glaciated = "glaciated",
        /// Uplands of layered rock: Yorkshire Dales.
        Stratified = "stratified",
        /// Lowlands: Norfolk.
        Lowland = "lowland",
        /// The Alps, by ranges of measures.
        Alps = "alps",
        /// The Himalaya, by ranges of measures.
        Himalaya = "himalaya",
        /// The Scottish Highlands, by ranges of measures.
        Highlands = "highlands",
        /// Canyons in layered rock, by ranges of measures.
        Canyon = "canyon",
    }
}

/// A window of a measure: lowest and highest value.
pub type Span = (&'static str, f64, f64);

/// Windows of preset kinds: tiles of 20 to 40 km at cells of 80 to 100 m, as measured on two or three tiles each and
/// widened by 15 %.
const WINDOWS: [(Kind, &[Span]); 4] = [
    (
        Kind::Alps,
        &[
            ("slope.p50", 23.0, 32.0),
            ("slope.p95", 37.0, 48.0),
            ("slope.p95_to_p50", 1.4, 1.8),
            ("hypsometric_integral", 0.47, 0.68),
            ("relief", 2000.0, 3500.0),
            ("spectrum.beta", 3.6, 4.3),
            ("valleys.v_index", -0.1, 0.15),
            ("valleys.exponent", 1.2, 1.8),
        ],
    ),
    (
        Kind::Himalaya,
        &[
            ("slope.p50", 25.0, 34.0),
            ("slope.p95", 42.0, 60.0),
            ("slope.p95_to_p50", 1.5, 2.0),
            ("hypsometric_integral", 0.33, 0.47),
            ("relief", 3600.0, 6000.0),
            ("spectrum.beta", 3.4, 4.0),
            ("valleys.v_index", -0.1, 0.1),
            ("valleys.exponent", 1.0, 1.4),
        ],
    ),
    (
        Kind::Highlands,
        &[
            ("slope.p50", 8.0, 15.0),
            ("slope.p95", 24.0, 41.0),
            ("slope.p95_to_p50", 2.3, 3.3),
            ("hypsometric_integral", 0.30, 0.48),
            ("relief", 900.0, 1500.0),
            ("spectrum.beta", 3.7, 4.4),
            ("valleys.v_index", 0.06, 0.25),
            ("valleys.exponent", 1.35, 2.3),
        ],
    ),
    (
        Kind::Canyon,
        &[
            ("slope.p50", 9.0, 14.0),
            ("slope.p95", 33.0, 48.0),
            ("slope.p95_to_p50", 2.8, 4.2),
            ("hypsometric_integral", 0.35, 0.60),
            ("relief", 1200.0, 2100.0),
            ("spectrum.beta", 2.4, 3.7),
            ("valleys.v_index", -0.1, 0.15),
            ("valleys.exponent", 1.0, 1.5),
        ],
    ),
];

impl Kind {
    /// All kinds, with none first.
    pub const ALL: [Self; 9] = [
        Self::None,
        Self::Fluvial,
        Self::Glaciated,
        Self::Stratified,
        Self::Lowland,
        Self::Alps,
        Self::Himalaya,
        Self::Highlands,
        Self::Canyon,
    ];

    /// The windows of the kind; empty for kinds that rest on elevation models.
    #[must_use]
    pub fn windows(self) -> &'static [Span] {
        WINDOWS.iter().find(|(kind, _)| *kind == self).map_or(&[], |(_, windows)| windows)
    }

    /// The models of the kind; empty for kinds that rest on windows.
    #[must_use]
    pub fn models(self) -> &'static [&'static str] {
        match self {
            Self::Fluvial => &["bigtujunga", "mandakini", "jacksboro", "frontrange"],
            Self::Glaciated => &["glencoe", "frontrange"],
            Self::Stratified => &["dales"],
            Self::Lowland => &["norfolk"],
            Self::None | Self::Alps | Self::Himalaya | Self::Highlands | Self::Canyon => &[],
        }
    }

    /// The models whose curves are drawn beside a terrain of the kind. No model of the Alps or of a canyon may be
    /// shipped: `alps` has the highest mountains of the table beside it, and `canyon` the layered upland.
    #[must_use]
    pub fn beside(self) -> &'static [&'static str] {
        match self {
            Self::Alps => &["mandakini", "frontrange"],
            Self::Himalaya => &["mandakini"],
            Self::Highlands => &["glencoe"],
            Self::Canyon => &["dales"],
            _ => self.models(),
        }
    }

    /// The middle of a measure and its natural spread: the standard deviation among quarters of the models, or half
    /// the width of the window. None if the kind says nothing about the measure.
    #[must_use]
    pub fn natural(self, measure: &str) -> Option<[f64; 2]> {
        if let Some((_, low, high)) = self.windows().iter().find(|(name, _, _)| *name == measure) {
            return Some([0.5 * (low + high), 0.5 * (high - low)]);
        }
        let models = self.models();
        let quarters = |tile: &super::Tile| models.contains(&tile.model) && tile.part != "whole";
        let values: Vec<f64> = Real::table().values(measure, quarters).collect();
        let [mean, spread] = spread(&values);
        (values.len() >= 3 && spread > 0.0).then_some([mean, spread])
    }
}
