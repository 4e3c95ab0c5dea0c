//! Hypsometric tints: colours of elevations, from lowland green to snow and from shallow to deep water.
//!
//! The anchors follow the convention of physical maps since the nineteenth century, lighter with height as in Imhof's
//! relief maps (E. Imhof, 1965, Kartographische Geländedarstellung). Between them colours are interpolated in OKLab (B.
//! Ottosson, 2020), where equal distances look equal, so that no band stands out.

use std::sync::LazyLock;

use super::light::{linear, oklab, rgb};
use crate::prelude::*;
use orograph_graph::Srgb;

/// Number of colours in the table, each for water and for land.
const STEPS: usize = 256;

/// Land from low to high: position between 0 and 1, sRGB.
pub(crate) const LAND: [(f64, u32); 8] = [
    (0.0, 0x7a9e77),
    (0.12, 0xa3b97f),
    (0.27, 0xd3cd96),
    (0.45, 0xd2b280),
    (0.62, 0xb58d68),
    (0.78, 0xa48f82),
    (0.9, 0xcfc8c3),
    (1.0, 0xfbfaf8),
];

/// Water from the shore to the deep: position between 0 and 1, sRGB.
pub(crate) const WATER: [(f64, u32); 4] = [(0.0, 0xb4d8e0), (0.12, 0x86bcd2), (0.5, 0x4b86b0), (1.0, 0x24507f)];

/// Numbers of a shader that reads tints.
pub const VALUES: [(&str, Number); 4] =
    [("k_steps", Number::U32), ("k_low_m", Number::F32), ("k_per_m", Number::F32), ("k_sea_m", Number::F32)];

/// The colours of water from the shore to the deep, then those of land from low to high, as linear RGB.
static TABLE: LazyLock<Vec<[f32; 3]>> = LazyLock::new(|| {
    let row = |anchors: &[(f64, u32)]| -> Vec<[f32; 3]> {
        (0..STEPS).map(|i| at(anchors, i as f64 / (STEPS - 1) as f64)).collect()
    };
    [row(&WATER), row(&LAND)].concat()
});

/// Linear RGB by elevation.
#[derive(Clone, Debug)]
pub struct Tints {
    table: &'static [[f32; 3]],
    low_m: f32,
    per_m: f32,
    sea_m: f32,
}

impl Tints {
    /// Creates land tints from `low_m` to `high_m`. Terrain below sea level is coloured as water, down to as far below
    /// it as `high_m` is above `low_m`.
    #[must_use]
    pub fn new(low_m: f64, high_m: f64, sea_m: Option<f64>) -> Self {
        let sea_m = sea_m.map_or(f32::NEG_INFINITY, |level| level as f32);
        Self { table: TABLE.as_slice(), low_m: low_m as f32, per_m: (1.0 / (high_m - low_m).max(1e-6)) as f32, sea_m }
    }

    /// Returns the table for shaders with [`VALUES`]: red, green and blue of each step.
    #[must_use]
    pub fn words(&self) -> Vec<u32> {
        self.table.as_flattened().iter().map(|v| v.to_bits()).collect()
    }

    /// Returns the numbers of such a shader.
    #[must_use]
    pub fn values(&self) -> [(&'static str, Scalar); 4] {
        // below every height
        let sea_m = self.sea_m.max(f32::MIN);
        [
            ("k_steps", Scalar::U32(STEPS as u32)),
            ("k_low_m", Scalar::F32(self.low_m)),
            ("k_per_m", Scalar::F32(self.per_m)),
            ("k_sea_m", Scalar::F32(sea_m)),
        ]
    }

    /// Returns the colour of an elevation in linear RGB.
    #[must_use]
    #[inline]
    pub fn of(&self, height_m: f32) -> [f32; 3] {
        let wet = height_m < self.sea_m;
        let place = if wet { (self.sea_m - height_m) * self.per_m } else { (height_m - self.low_m) * self.per_m };
        let place = place.clamp(0.0, 1.0) * (STEPS - 1) as f32;
        let step = (place as usize).min(STEPS - 2);
        let t = place - step as f32;
        let base = if wet { step } else { STEPS + step };
        let (a, b) = (self.table[base], self.table[base + 1]);
        [0, 1, 2].map(|c| a[c] + (b[c] - a[c]) * t)
    }
}

/// Returns the colour of rivers and lakes on a map, as linear RGB.
#[must_use]
pub fn open_water() -> [f32; 3] {
    linear(Srgb::hex(0x3f_7f_b5)).map(|v| v as f32)
}

/// Returns the colour between anchors, linear in OKLab, as linear RGB.
fn at(anchors: &[(f64, u32)], place: f64) -> [f32; 3] {
    let next = anchors.iter().position(|(p, _)| *p >= place).unwrap_or(anchors.len() - 1).max(1);
    let ((p, from), (q, to)) = (anchors[next - 1], anchors[next]);
    let t = (place - p) / (q - p);
    let (from, to) = (oklab(linear(Srgb::hex(from))), oklab(linear(Srgb::hex(to))));
    rgb([0, 1, 2].map(|c| from[c] + (to[c] - from[c]) * t)).map(|v| v.clamp(0.0, 1.0) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elevations_beyond_the_range_have_the_end_colours() {
        let tints = Tints::new(100.0, 2000.0, Some(0.0));
        assert_eq!(tints.of(9000.0), tints.of(2100.0));
        assert_eq!(tints.of(3.0), tints.of(100.0));
        assert_eq!(tints.of(-2000.0), tints.of(-1e30));
        let dry = Tints::new(100.0, 2000.0, None);
        assert!(tints.of(-1.0) != dry.of(-1.0) && dry.of(-1.0) == dry.of(100.0));
        let high = Tints::new(100.0, 2000.0, Some(500.0));
        assert_eq!((high.of(499.0), high.of(500.0)), (tints.of(-1.0), tints.of(500.0)));
        assert!(tints.of(f32::NAN).iter().all(|v| v.is_nan()));
        let level = Tints::new(5.0, 5.0, Some(0.0));
        assert!(level.of(5.0).iter().chain(&level.of(6.0)).all(|v| (0.0..=1.0).contains(v)));
    }
}
