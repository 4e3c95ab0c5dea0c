//! The course of a path: a smooth curve through its points that winds about them.
//!
//! L. B. Leopold and M. G. Wolman (1960), "River meanders": a meander is about eleven widths of its channel long. Here
//! a valley winds over seven widths with its banks, and smaller bends have the same proportions.

use super::Params;
use crate::numerics::{
    along::distance,
    noise::place::{self, along},
    spline::{hermite, tangent},
};

/// Wavelength of the largest bends, in widths of bed and banks, and their reach.
const BEND: [f64; 2] = [7.0, 2.0];
/// Octaves of bends, each half as long as the one before, and the ratio of their reaches.
const OCTAVES: i32 = 4;
const GAIN: f64 = 0.4;
/// Points over the largest bend, and maximum number of points.
const POINTS: f64 = 128.0;
const MOST: f64 = 50_000.0;

/// Returns points along the course; those of the path itself if it neither curves nor winds.
pub fn course(params: &Params, seed: u32) -> Vec<[f64; 2]> {
    let path = &params.path.0;
    if params.curve == 0.0 && params.wander == 0.0 {
        return path.clone();
    }
    let whole: f64 = path.windows(2).map(|pair| distance(pair[0], pair[1])).sum();
    let wide_m = params.width + params.bank;
    let wave_m = BEND[0] * wide_m.max(1e-3 * whole);
    let step = (wave_m / POINTS).max(whole / MOST);
    let mut points = Vec::new();
    let (mut way, mut seen) = (0.0, path[0]);
    for (k, pair) in path.windows(2).enumerate() {
        let long = distance(pair[0], pair[1]);
        if long <= 0.0 {
            continue;
        }
        let before = path[..k].iter().rev().find(|point| **point != pair[0]).copied();
        let after = path[k + 2..].iter().find(|point| **point != pair[1]).copied();
        let tangents = [tangent(before.unwrap_or(pair[0]), pair[1]), tangent(pair[0], after.unwrap_or(pair[1]))]
            .map(|t| t.map(|part| params.curve * long * part));
        let count = (long / step).ceil().max(1.0) as usize;
        for i in 0..=count {
            let t = i as f64 / count as f64;
            let [at, slope] = hermite([pair[0], pair[1]], tangents, t);
            if i == 0 && !points.is_empty() {
                continue;
            }
            way += distance(seen, at);
            seen = at;
            let ends = crate::numerics::math::smoothstep(2.0 * way.min((whole - way).max(0.0)) / wave_m);
            let aside = params.wander * BEND[1] * wide_m * ends * bends(way / wave_m, seed);
            let steep = (slope[0] * slope[0] + slope[1] * slope[1]).sqrt();
            let normal = if steep > 0.0 { [-slope[1] / steep, slope[0] / steep] } else { [0.0; 2] };
            points.push([at[0] + aside * normal[0], at[1] + aside * normal[1]]);
        }
    }
    if points.len() < 2 { path.clone() } else { points }
}

/// Returns the displacement at a way in wavelengths, within about ±1.
fn bends(way: f64, seed: u32) -> f64 {
    let octave = |k: i32| {
        let fine = f64::from(1 << k);
        place_gain(k) * along(2.0 * fine * way + 0.37 * fine, place::key(seed, i64::from(k)))
    };
    (0..OCTAVES).map(octave).sum()
}

fn place_gain(octave: i32) -> f64 {
    (0..octave).fold(1.0, |share, _| share * GAIN)
}
