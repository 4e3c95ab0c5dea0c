//! Conversion of colours to linear light and to OKLab, in which equal distances look equal.
//!
//! Sources: IEC 61966-2-1 (sRGB); B. Ottosson, 2020, A perceptual color space for image processing.

use orograph_graph::Srgb;

use super::math;

/// Returns the linear RGB of a colour, 0 to 1.
#[must_use]
pub fn linear(colour: Srgb) -> [f64; 3] {
    colour.0.map(|code| {
        let v = f64::from(code) / 255.0;
        if v <= 0.04045 { v / 12.92 } else { math::pow((v + 0.055) / 1.055, 2.4) }
    })
}

/// Converts linear RGB to OKLab: lightness and the two axes of hue.
#[must_use]
pub fn oklab([r, g, b]: [f64; 3]) -> [f64; 3] {
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

/// Returns the linear RGB of a colour in OKLab; outside 0 to 1 for colours outside the sRGB gamut.
#[must_use]
pub fn rgb([l, a, b]: [f64; 3]) -> [f64; 3] {
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
        for code in (0..0x0100_0000).step_by(70_001) {
            let linear = linear(Srgb::hex(code));
            for (there, back) in linear.into_iter().zip(rgb(oklab(linear))) {
                assert!((there - back).abs() < 1e-6); // the matrices have ten digits and are inverses to seven
            }
        }
    }

    #[test]
    fn grey_has_its_lightness_and_no_hue() {
        for (code, light) in [(0x00, 0.0), (0xff, 1.0)] {
            let [l, a, b] = oklab(linear(Srgb([code; 3])));
            assert!((l - light).abs() < 1e-6 && a.abs() < 1e-6 && b.abs() < 1e-6, "{l} {a} {b}");
        }
    }
}
