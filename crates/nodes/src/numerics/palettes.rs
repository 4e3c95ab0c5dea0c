//! Colour ramps of the node `Ramp`, as positions from 0 to 1 and sRGB.
//!
//! The natural ones are mixed by eye for terrain seen from the air: muted, since saturated greens and reds look like
//! plastic under light, and with smoothly changing lightness. `viridis` is the colour map of S. van der Walt and N.
//! Smith (2015), at nine positions.

use orograph_graph::{Srgb, Stop, choice};

use super::tints;

choice! {
    /// The colours of a ramp.
    pub enum Palette {
        /// Those of the parameter `stops` or `second_stops`, at the values given there.
        Stops = "stops",
        /// A physical map: lowland green over ochre and brown to snow.
        Map = "map",
        /// A temperate range from the air: forest, meadow, scree, snow.
        Alpine = "alpine",
        /// Bare rock: dark clefts to pale weathered faces.
        Rock = "rock",
        /// Layered sandstone: rust, cream and purple bands.
        Canyon = "canyon",
        /// Sand and gravel of dry land.
        Desert = "desert",
        /// Tundra, ice and snow.
        Arctic = "arctic",
        /// Ash, basalt and oxidised cinder.
        Volcanic = "volcanic",
        /// Water from the deep to the shore.
        Sea = "sea",
        /// For data: uniform steps of lightness, also for colour-blind readers.
        Viridis = "viridis",
        /// Black to white, linear in light.
        Grey = "grey",
        /// For directions: a circle of hues of equal lightness: blue in the north, pink in the east, ochre in the south.
        Compass = "compass",
    }
}

const ALPINE: [(f64, u32); 8] = [
    (0.0, 0x3b4a2f),
    (0.25, 0x4c5b37),
    (0.42, 0x6f7548),
    (0.55, 0x8b8560),
    (0.66, 0x85796a),
    (0.8, 0x9a938c),
    (0.88, 0xd9d9d8),
    (1.0, 0xf7f9fb),
];
const ROCK: [(f64, u32); 5] = [(0.0, 0x3d3a37), (0.3, 0x5f5a54), (0.55, 0x7d756b), (0.8, 0x9c9387), (1.0, 0xbdb5a8)];
const CANYON: [(f64, u32); 11] = [
    (0.0, 0x4a2f29),
    (0.12, 0x7b4433),
    (0.2, 0x8f553d),
    (0.27, 0xc89b72),
    (0.36, 0xa8623f),
    (0.5, 0xb8764c),
    (0.56, 0xdcb88c),
    (0.66, 0x9c5b45),
    (0.76, 0x83504f),
    (0.84, 0xd0a27a),
    (1.0, 0xe2c6a0),
];
const DESERT: [(f64, u32); 6] =
    [(0.0, 0x8b6b4a), (0.2, 0xb18a5c), (0.45, 0xcfa974), (0.65, 0xdcbd8c), (0.85, 0xc09a72), (1.0, 0xe6d2ae)];
const ARCTIC: [(f64, u32); 6] =
    [(0.0, 0x565a48), (0.2, 0x7a7663), (0.4, 0x8e8f8b), (0.6, 0xb9c7cf), (0.8, 0xdce8ee), (1.0, 0xfbfdfe)];
const VOLCANIC: [(f64, u32); 6] =
    [(0.0, 0x1f1d1d), (0.3, 0x37322f), (0.55, 0x544741), (0.72, 0x70483a), (0.85, 0x7c6a60), (1.0, 0x9c938c)];
const VIRIDIS: [(f64, u32); 9] = [
    (0.0, 0x440154),
    (0.125, 0x472d7b),
    (0.25, 0x3b528b),
    (0.375, 0x2c728e),
    (0.5, 0x21918c),
    (0.625, 0x28ae80),
    (0.75, 0x5ec962),
    (0.875, 0xaddc30),
    (1.0, 0xfde725),
];
/// Hues of lightness 0.7 and chroma 0.115 in OKLCH, 30° apart.
const COMPASS: [(f64, u32); 13] = [
    (0.0, 0x6ca1e5),
    (1.0 / 12.0, 0x9794e3),
    (2.0 / 12.0, 0xb988d0),
    (3.0 / 12.0, 0xd180af),
    (4.0 / 12.0, 0xdc7f87),
    (5.0 / 12.0, 0xd98660),
    (6.0 / 12.0, 0xc89344),
    (7.0 / 12.0, 0xa9a245),
    (8.0 / 12.0, 0x7fae64),
    (9.0 / 12.0, 0x4cb58c),
    (10.0 / 12.0, 0x1db4b4),
    (11.0 / 12.0, 0x3aadd4),
    (1.0, 0x6ca1e5),
];
const GREY: [(f64, u32); 2] = [(0.0, 0x000000), (1.0, 0xffffff)];

impl Palette {
    /// Returns the stops between `low` and `high`; empty for [`Self::Stops`], whose stops are a parameter.
    #[must_use]
    pub fn stops(self, low: f64, high: f64) -> Vec<Stop> {
        let place = |(at, code): &(f64, u32)| Stop { at: low + (high - low) * at, colour: Srgb::hex(*code) };
        let anchors: &[(f64, u32)] = match self {
            Self::Stops => &[],
            Self::Map => &tints::LAND,
            Self::Alpine => &ALPINE,
            Self::Rock => &ROCK,
            Self::Canyon => &CANYON,
            Self::Desert => &DESERT,
            Self::Arctic => &ARCTIC,
            Self::Volcanic => &VOLCANIC,
            Self::Viridis => &VIRIDIS,
            Self::Grey => &GREY,
            Self::Compass => &COMPASS,
            // depths are tabulated from the shore down
            Self::Sea => {
                let deepest_first = tints::WATER.iter().rev();
                return deepest_first.map(|(depth, code)| place(&(1.0 - depth, *code))).collect();
            }
        };
        anchors.iter().map(place).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_rise_from_end_to_end() {
        for (name, _) in Palette::OPTIONS.iter().skip(1) {
            let value = orograph_graph::ParamValue::Choice(name);
            let palette = <Palette as orograph_graph::ParamType>::from_value(&value).expect("an option");
            let stops = palette.stops(-100.0, 300.0);
            assert_eq!((stops[0].at, stops[stops.len() - 1].at), (-100.0, 300.0), "{name}");
            assert!(stops.windows(2).all(|pair| pair[0].at < pair[1].at), "{name}");
        }
    }
}
