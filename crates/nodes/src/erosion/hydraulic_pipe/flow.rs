//! Water: discharge through the faces between cells, and what it leaves in them.
//!
//! A face has one signed discharge per metre of width, positive eastward or southward. Differences of depth and of bed
//! are taken apart, so that a level lake stays level to the last bit on a bed far above zero.

use super::physics::{Pace, Scheme};
use crate::simd::simd;

/// Depth of water over a face, in metres, below which nothing flows.
const DRY_M: f32 = 1e-4;
/// Differences of the water surface from here on, in metres, are edges of holes in the data.
pub(super) const HIGHEST: f32 = 1e15;

simd! {
    /// Adds the rain of a step to the depth of water; none falls on holes.
    pub fn rain(water: &mut [f32], before: &[f32], rain_mm_h: &[f32], bed: &[f32], pace: &Pace) {
        let n = water.len();
        let (before, rain_mm_h, bed) = (&before[..n], &rain_mm_h[..n], &bed[..n]);
        for i in 0..n {
            let rain = rain_mm_h[i];
            let rain = if rain > 0.0 { rain } else { 0.0 };
            let wet = before[i] + rain * pace.rain_m;
            water[i] = if bed[i].abs() < HIGHEST { wet } else { 0.0 };
        }
    }
}

simd! {
    /// The bed: the land and its change so far. What is no land is NaN.
    pub fn bed(bed: &mut [f32], land: &[f32], change: &[f32]) {
        let n = bed.len();
        let (land, change) = (&land[..n], &change[..n]);
        for i in 0..n {
            let height = land[i] + change[i];
            bed[i] = if height.abs() < HIGHEST { height } else { f32::NAN };
        }
    }
}

/// Depth of water over a face and the fall of its surface across it: the higher surface above the higher bed.
#[inline(always)]
fn face(bed: [f32; 2], water: [f32; 2]) -> (f32, f32) {
    let step = bed[0] - bed[1];
    let fall = step + (water[0] - water[1]);
    let here = water[0] + if step < 0.0 { step } else { 0.0 };
    let there = water[1] - if step > 0.0 { step } else { 0.0 };
    (if here > there { here } else { there }, fall)
}

/// x to the power of -1/6, for x of [`DRY_M`] and more, within 3e-6 of its value: a first guess from the exponent, and
/// three steps of Newton's method, which needs no division.
#[inline(always)]
fn inverse_sixth_root(x: f32) -> f32 {
    const SHIFT: f32 = 12_582_912.0; // 1.5 · 2²³: a sum with it is rounded to a whole number, kept in the low bits
    let sixth = ((x.to_bits() >> 9) as i32 as f32) * (1.0 / 6.0) + SHIFT;
    let sixth = (sixth.to_bits() << 9).wrapping_sub(SHIFT.to_bits() << 9);
    let mut t = f32::from_bits(0x4a0e_9d03_u32.wrapping_sub(sixth));
    for _ in 0..3 {
        let cube = t * t * t;
        t *= 7.0 / 6.0 - x * (1.0 / 6.0) * (cube * cube);
    }
    t
}

/// Local inertia with Manning's friction (Bates, Horritt and Fewtrell 2010, equation 11), at most critical flow.
///
/// `along` is the discharge along the face and the fall of the surface that way. Friction counts both directions, as de
/// Almeida et al. (2012) have it; on steep ground, where flow would be faster than its waves, it grows until it is not
/// (Grant 1997). With the face's own direction alone, water would turn towards the diagonals of the raster.
#[inline(always)]
fn inertial(q: f32, along: [f32; 2], bed: [f32; 2], water: [f32; 2], pace: &Pace) -> f32 {
    let (depth, fall) = face(bed, water);
    let open = (depth > DRY_M) & (fall.abs() < HIGHEST);
    let depth = if depth > DRY_M { depth } else { DRY_M };
    let fall = if fall > pace.steepest_m { pace.steepest_m } else { fall };
    let fall = if fall < -pace.steepest_m { -pace.steepest_m } else { fall };
    let root = inverse_sixth_root(depth);
    let root3 = root * root * root;
    let (root6, root7) = (root3 * root3, root3 * root3 * root);
    let rough = pace.friction * (root7 * root7);
    let steep = pace.step * (fall * fall + along[1] * along[1]).sqrt() * (root6 * root6);
    let friction = (if rough > steep { rough } else { steep }) * (q * q + along[0] * along[0]).sqrt();
    let moved = (q + pace.push * depth * fall) / (1.0 + friction);
    let critical = pace.critical * (depth * depth) * root3;
    let moved = if moved > critical { critical } else { moved };
    let moved = if moved < -critical { -critical } else { moved };
    if open { moved } else { 0.0 }
}

/// A pipe between the two columns (O'Brien and Hodgins 1995, Mei, Decaudin and Hu 2007) as wide as the face, and as
/// high as the water over it or `pace.section_m`.
#[inline(always)]
fn pipe(q: f32, bed: [f32; 2], water: [f32; 2], pace: &Pace) -> f32 {
    let (depth, fall) = face(bed, water);
    let open = (depth > DRY_M) & (fall.abs() < HIGHEST);
    let section = if pace.section_m > 0.0 { pace.section_m } else { depth };
    let moved = q * pace.damping + pace.push * section * fall;
    if open { moved } else { 0.0 }
}

simd! {
    /// Discharge through faces after a step, m²/s, not yet limited to the water there is. `bed` and `water` are those of
    /// the cells on the face's west and east, or north and south; `along` the discharge before the step and the fall in
    /// the face's direction of the same cells.
    pub fn faces(discharge: &mut [f32], along: [[&[f32]; 2]; 2], bed: [&[f32]; 2], water: [&[f32]; 2], pace: &Pace) {
        let n = discharge.len();
        let [flowing, falling, bed, water] = [along[0], along[1], bed, water].map(|rows| rows.map(|row| &row[..n]));
        match pace.scheme {
            Scheme::Inertial => {
                for i in 0..n {
                    let along = [flowing, falling].map(|[before, after]| 0.5 * (before[i] + after[i]));
                    discharge[i] = inertial(discharge[i], along, [bed[0][i], bed[1][i]], [water[0][i], water[1][i]], pace);
                }
            }
            Scheme::Pipes => {
                for i in 0..n {
                    discharge[i] = pipe(discharge[i], [bed[0][i], bed[1][i]], [water[0][i], water[1][i]], pace);
                }
            }
        }
    }
}

simd! {
    /// The mean of two rows of faces: discharge in the middle of cells.
    pub fn middle(out: &mut [f32], faces: [&[f32]; 2]) {
        let n = out.len();
        let [before, after] = faces.map(|row| &row[..n]);
        for i in 0..n {
            out[i] = 0.5 * (before[i] + after[i]);
        }
    }
}

simd! {
    /// Half the fall of the water surface from the cells `before` to those `after`, 0 beside what is no land.
    pub fn fall(out: &mut [f32], bed: [&[f32]; 2], water: [&[f32]; 2]) {
        let n = out.len();
        let [bed, water] = [bed, water].map(|rows| rows.map(|row| &row[..n]));
        for i in 0..n {
            let fall = 0.5 * ((bed[0][i] - bed[1][i]) + (water[0][i] - water[1][i]));
            out[i] = if fall.abs() < HIGHEST { fall } else { 0.0 };
        }
    }
}

simd! {
    /// The share of its outflow that a cell can give in a step, a hair below all its water. `faces` are those on its
    /// west, east, north and south.
    pub fn shares(share: &mut [f32], water: &[f32], faces: [&[f32]; 4], pace: &Pace) {
        let n = share.len();
        let (water, [west, east, north, south]) = (&water[..n], faces.map(|row| &row[..n]));
        let positive = |q: f32| if q > 0.0 { q } else { 0.0 };
        for i in 0..n {
            let out = (positive(east[i]) + positive(-west[i])) + (positive(south[i]) + positive(-north[i]));
            let out_m = out * pace.step;
            let most_m = water[i] * (1.0 - 1e-6);
            share[i] = if out_m > most_m { most_m / out_m } else { 1.0 };
        }
    }
}

simd! {
    /// Limits discharge to the share its cell of origin can give: `shares` of the cell before the face and after it.
    pub fn limit(discharge: &mut [f32], shares: [&[f32]; 2]) {
        let n = discharge.len();
        let [before, after] = shares.map(|row| &row[..n]);
        for i in 0..n {
            discharge[i] *= if discharge[i] > 0.0 { before[i] } else { after[i] };
        }
    }
}

/// Depth over which a film of water gains the speed it would have, as multiples of the film's depth.
const FILM: [f32; 2] = [1.0, 3.0];

/// 0 for water thinner than the film, 1 from three times its depth on.
#[inline(always)]
pub(super) fn film(depth_m: f32, pace: &Pace) -> f32 {
    let t = (depth_m * pace.per_film - FILM[0]) * (1.0 / (FILM[1] - FILM[0]));
    let t = if t > 0.0 { t } else { 0.0 };
    let t = if t < 1.0 { t } else { 1.0 };
    t * t * (3.0 - 2.0 * t)
}

simd! {
    /// Depth of water after a step, and what flowed meanwhile: adds |q| to `flow`, gives |q| in m²/s in `speed` times the
    /// film's damping. Returns the greatest depth. `faces` as in [`shares`].
    pub fn water(depth: &mut [f32], flow: &mut [f32], speed: &mut [f32], before: &[f32], faces: [&[f32]; 4], pace: &Pace)
        -> f32 {
        let n = depth.len();
        let (flow, speed) = (&mut flow[..n], &mut speed[..n]);
        let (before, [west, east, north, south]) = (&before[..n], faces.map(|row| &row[..n]));
        let mut deepest = 0;
        for i in 0..n {
            let gain = (west[i] - east[i]) + (north[i] - south[i]);
            let after = before[i] + pace.step * gain;
            let after = if after > 0.0 { after } else { 0.0 };
            let (east, south) = (0.5 * (west[i] + east[i]), 0.5 * (north[i] + south[i]));
            let q = (east * east + south * south).sqrt();
            let mean = 0.5 * (before[i] + after);
            depth[i] = after;
            flow[i] += q * pace.dt_s;
            speed[i] = q * film(mean, pace) / if mean > 1e-6 { mean } else { 1e-6 };
            // floats of one sign have the order of their bits
            deepest = deepest.max(after.to_bits() as i32);
        }
        f32::from_bits(deepest as u32)
    }
}

simd! {
    /// Evaporation and infiltration of a step.
    pub fn dry(depth: &mut [f32], pace: &Pace) {
        for depth in depth {
            let left = *depth * pace.evaporation - pace.infiltration_m;
            *depth = if left > 0.0 { left } else { 0.0 };
        }
    }
}
