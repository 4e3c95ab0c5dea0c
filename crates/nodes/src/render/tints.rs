//! Hypsometric tints: colours of elevations, from lowland green to snow and from shallow water to the deep.
//!
//! The anchors follow the custom of physical maps since the nineteenth century, brightened with height as in Imhof's
//! relief maps (E. Imhof, 1965, Kartographische Geländedarstellung). Between them colours run straight in OKLab
//! (B. Ottosson, 2020), where equal steps look equal, so no band stands out.

use crate::math;

/// Colours in the table, for water and for land each.
const STEPS: usize = 256;

/// Land from low to high: place between 0 and 1, sRGB.
const LAND: [(f64, u32); 8] = [
    (0.0, 0x7a9e77),
    (0.12, 0xa3b97f),
    (0.27, 0xd3cd96),
    (0.45, 0xd2b280),
    (0.62, 0xb58d68),
    (0.78, 0xa48f82),
    (0.9, 0xcfc8c3),
    (1.0, 0xfbfaf8),
];

/// Water from the shore to the deep: place between 0 and 1, sRGB.
const WATER: [(f64, u32); 4] = [(0.0, 0xb4d8e0), (0.12, 0x86bcd2), (0.5, 0x4b86b0), (1.0, 0x24507f)];

/// A table of linear RGB by elevation.
#[derive(Clone, Debug)]
pub struct Tints {
    table: Vec<[f32; 3]>,
    low_m: f32,
    per_m: f32,
    water: bool,
}

impl Tints {
    /// Land tints from `low_m` to `high_m`; with `water`, what lies below 0 m is coloured as water, down to as far below
    /// 0 m as `high_m` is above `low_m`.
    #[must_use]
    pub fn new(low_m: f64, high_m: f64, water: bool) -> Self {
        let row = |anchors: &[(f64, u32)]| -> Vec<[f32; 3]> {
            (0..STEPS).map(|i| at(anchors, i as f64 / (STEPS - 1) as f64)).collect()
        };
        let table = [row(&WATER), row(&LAND)].concat();
        Self { table, low_m: low_m as f32, per_m: (1.0 / (high_m - low_m).max(1e-6)) as f32, water }
    }

    /// The colour of an elevation in linear RGB.
    #[must_use]
    #[inline]
    pub fn of(&self, height_m: f32) -> [f32; 3] {
        let wet = self.water && height_m < 0.0;
        let place = if wet { -height_m * self.per_m } else { (height_m - self.low_m) * self.per_m };
        let place = place.clamp(0.0, 1.0) * (STEPS - 1) as f32;
        let step = (place as usize).min(STEPS - 2);
        let t = place - step as f32;
        let base = if wet { step } else { STEPS + step };
        let (a, b) = (self.table[base], self.table[base + 1]);
        [0, 1, 2].map(|c| a[c] + (b[c] - a[c]) * t)
    }
}

/// The colour of rivers and lakes on a map, as linear RGB.
#[must_use]
pub fn open_water() -> [f32; 3] {
    linear(0x3f_7f_b5).map(|v| v as f32)
}

/// The colour between anchors, straight in OKLab, as linear RGB.
fn at(anchors: &[(f64, u32)], place: f64) -> [f32; 3] {
    let next = anchors.iter().position(|(p, _)| *p >= place).unwrap_or(anchors.len() - 1).max(1);
    let ((p, from), (q, to)) = (anchors[next - 1], anchors[next]);
    let t = (place - p) / (q - p);
    let (from, to) = (oklab(linear(from)), oklab(linear(to)));
    rgb([0, 1, 2].map(|c| from[c] + (to[c] - from[c]) * t)).map(|v| v.clamp(0.0, 1.0) as f32)
}

/// Linear RGB of an sRGB colour `0xRRGGBB`.
fn linear(srgb: u32) -> [f64; 3] {
    [16, 8, 0].map(|shift| {
        let v = f64::from((srgb >> shift) & 255) / 255.0;
        if v <= 0.04045 { v / 12.92 } else { math::pow((v + 0.055) / 1.055, 2.4) }
    })
}

fn oklab([r, g, b]: [f64; 3]) -> [f64; 3] {
    let cone = [
        0.412_221_470_8 * r + 0.536_332_536_3 * g + 0.051_445_992_9 * b,
        0.211_903_498_2 * r + 0.680_699_545_1 * g + 0.107_396_956_6 * b,
        0.088_302_461_9 * r + 0.281_718_837_6 * g + 0.629_978_700_5 * b,
    ];
    let [l, m, s] = cone.map(|v| math::pow(v, 1.0 / 3.0));
    [
        0.210_454_255_3 * l + 0.793_617_785_0 * m - 0.004_072_046_8 * s,
        1.977_998_495_1 * l - 2.428_592_205_0 * m + 0.450_593_709_9 * s,
        0.025_904_037_1 * l + 0.782_771_766_2 * m - 0.808_675_766_0 * s,
    ]
}

fn rgb([l, a, b]: [f64; 3]) -> [f64; 3] {
    let cone = [
        l + 0.396_337_777_4 * a + 0.215_803_757_3 * b,
        l - 0.105_561_345_8 * a - 0.063_854_172_8 * b,
        l - 0.089_484_177_5 * a - 1.291_485_548_0 * b,
    ];
    let [l, m, s] = cone.map(|v| v * v * v);
    [
        4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s,
        -1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s,
        -0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701_0 * s,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_survive_the_way_through_oklab() {
        for (_, colour) in LAND.iter().chain(&WATER) {
            let linear = linear(*colour);
            for (there, back) in linear.into_iter().zip(rgb(oklab(linear))) {
                assert!((there - back).abs() < 1e-6); // the matrices have ten digits and are inverses to seven
            }
        }
    }

    #[test]
    fn elevations_beyond_the_range_have_the_end_colours() {
        let tints = Tints::new(100.0, 2000.0, true);
        assert_eq!(tints.of(9000.0), tints.of(2100.0));
        assert_eq!(tints.of(3.0), tints.of(100.0));
        assert_eq!(tints.of(-2000.0), tints.of(-1e30));
        assert_ne!(tints.of(-1.0), Tints::new(100.0, 2000.0, false).of(-1.0));
        assert!(tints.of(f32::NAN).iter().all(|v| v.is_nan()));
        let level = Tints::new(5.0, 5.0, true);
        assert!(level.of(5.0).iter().chain(&level.of(6.0)).all(|v| (0.0..=1.0).contains(v)));
    }
}
