//! Barrancos: gullies that run down the flanks, deepen, and end on the apron at the foot.
//!
//! C. A. Cotton (1952), "Volcanoes as Landscape Forms": gullies on a young cone radiate at nearly equal distances. As
//! the flank widens downslope, new gullies begin between the old ones. Smaller ones enter them at an acute angle.

use std::f64::consts::TAU;

use crate::numerics::{
    math::smoothstep,
    noise::place::{self, along, unit},
};

/// Distance of the heads from the centre in radii, and the depth relative to the first generation, of each generation
/// of gullies. Each has twice as many as the one before.
const GENERATIONS: [[f64; 2]; 3] = [[0.09, 1.0], [0.33, 0.7], [0.56, 0.45]];
/// Distance from the centre, in radii, at which the spacing of the first generation is the one asked for.
const EVEN: f64 = 0.3;
/// Depth of the deepest gully as a fraction of the spacing, for gullies of 1.
const DEPTH: f64 = 0.46;
/// Spacing of side gullies as a fraction of that of gullies.
const SIDE: f64 = 0.3;
/// Farthest that a gully winds to either side, in spacings.
const STRAY: f64 = 0.3;

/// The gullies of a volcano.
#[derive(Clone, Debug)]
pub(super) struct Gullies {
    spacing_m: f64,
    radius_m: f64,
    /// Fraction of side gullies that the cells can show.
    sides: f64,
    generations: Vec<Vec<Gully>>,
}

#[derive(Clone, Copy, Debug)]
struct Gully {
    key: u32,
    /// Direction of its middle, in spacings from the first one.
    middle: f64,
    /// Half width as a fraction of the spacing.
    half: f64,
    /// Distances of its head and its foot in radii.
    head: f64,
    foot: f64,
    deep_m: f64,
}

impl Gullies {
    /// Draws the gullies; there are none at a depth of 0.
    pub fn new(depth: f64, spacing_m: f64, radius_m: f64, cell_m: f64, seed: u32) -> Self {
        let first = (TAU * EVEN * radius_m / spacing_m).round().clamp(5.0, 4096.0) as u32;
        let generation = |(k, [head, share]): (u32, &[f64; 2])| {
            let seed = place::key(seed, i64::from(k) + 71);
            let gully = |index: u32| {
                let key = place::key(seed, i64::from(index));
                Gully {
                    key,
                    middle: f64::from(index) + 0.5 + 0.5 * (unit(key, 1) - 0.5),
                    half: 0.34 + 0.3 * unit(key, 2),
                    head: head * (0.75 + 0.7 * unit(key, 3)),
                    foot: 0.78 + 0.3 * unit(key, 4),
                    deep_m: DEPTH * depth * spacing_m * share * (0.3 + 0.7 * unit(key, 5)),
                }
            };
            (0..first << k).map(gully).collect()
        };
        let generations = (0..).zip(&GENERATIONS).filter(|_| depth > 0.0).map(generation).collect();
        Self { spacing_m, radius_m, sides: place::visible(SIDE * spacing_m, cell_m), generations }
    }

    /// Returns true if there are gullies.
    pub fn any(&self) -> bool {
        !self.generations.is_empty()
    }

    /// Returns how far the flank is cut at an angle and distance from the centre.
    pub fn cut(&self, angle: f64, distance_m: f64) -> f64 {
        let share = distance_m / self.radius_m;
        if !(0.02..1.15).contains(&share) {
            return 0.0;
        }
        // the deepest gully here: its cut, the gully, the distance from its middle in half widths and in metres
        let mut deepest: Option<(f64, &Gully, f64, f64)> = None;
        for gullies in &self.generations {
            let count = gullies.len() as f64;
            let apart_m = distance_m * TAU / count;
            let turn = (angle / TAU * count).rem_euclid(count);
            let own = turn.floor();
            let wide = (1.3 * self.spacing_m / apart_m).min(1.0);
            for index in [own - 1.0, own, own + 1.0] {
                let gully = &gullies[index.rem_euclid(count) as usize % gullies.len()];
                // from the even middle, across the seam of the circle
                let even = turn - gully.middle - count * ((turn - gully.middle) / count).round();
                if even.abs() > STRAY + wide * gully.half || share < gully.head {
                    continue;
                }
                let wander = 0.22 * along(distance_m / (2.5 * self.spacing_m), gully.key)
                    + 0.08 * along(distance_m / (0.7 * self.spacing_m), gully.key ^ 1);
                let x = (even - wander) / (wide * gully.half);
                if x.abs() >= 1.0 {
                    continue;
                }
                let length = gully.foot - gully.head;
                let grown = smoothstep((share - gully.head) / (0.5 * length)).sqrt()
                    * (1.0 - smoothstep((share - 0.5 * (gully.foot + gully.head)) / (0.5 * length + 0.08)));
                // a sharp bed and rounded shoulders
                let rest = 1.0 - x.abs();
                let here = gully.deep_m * grown * rest * (0.62 + 0.38 * rest);
                if deepest.is_none_or(|(cut, ..)| here > cut) {
                    deepest = Some((here, gully, x, x * wide * gully.half * apart_m));
                }
            }
        }
        let Some((cut, gully, x, across_m)) = deepest else { return 0.0 };
        if self.sides == 0.0 {
            return cut;
        }
        // side gullies enter at an acute angle: lines of constant `u` approach the middle downslope
        let bend = place::at([distance_m / (0.9 * self.spacing_m), across_m / (0.5 * self.spacing_m)], gully.key ^ 3);
        let u = (across_m.abs() + 0.45 * distance_m) / (SIDE * self.spacing_m) + 1.6 * bend;
        let bank = if x > 0.0 { gully.key ^ 11 } else { gully.key ^ 12 };
        let side = furrow(u, bank) * x.abs() * (1.0 - x.abs()) * self.sides;
        cut + 0.16 * DEPTH * self.spacing_m * (cut / (0.1 * self.spacing_m)).min(1.0) * side
    }
}

/// Returns furrows one unit apart, of different depths: 1 in the middle of the deepest, 0 on the ribs.
fn furrow(u: f64, seed: u32) -> f64 {
    let u = u.clamp(-1e9, 1e9);
    let cell = u.floor();
    let depth = |index: i64| 0.1 + 0.9 * unit(place::key(seed, index), 9);
    let x = (2.0 * (u - cell) - 1.0).abs();
    (1.0 - x * (2.0 - x)) * depth(cell as i64)
}
