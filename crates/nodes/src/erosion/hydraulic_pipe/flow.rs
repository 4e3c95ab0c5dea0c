//! Water: discharge through the faces between cells, and what it leaves in them.
//!
//! A face has one signed discharge per metre of width, positive eastward or southward. Differences of depth and of bed
//! are taken apart, so that a level lake stays level to the last bit on a bed far above zero.

use super::physics::Pace;
use crate::{
    math::lane::{inverse, inverse_root},
    simd::simd,
};

/// Depth of water over a face, in metres, below which nothing flows.
const DRY_M: f32 = 1e-4;
/// Outflow of a cell in a step, in metres, that is not worth limiting.
const LEAST_M: f32 = 1e-30;
/// Differences of the water surface from here on, in metres, are edges of holes in the data.
pub(super) const HIGHEST: f32 = 1e15;

/// What is no land is NaN.
#[inline(always)]
fn height(height_m: f32) -> f32 {
    if height_m.abs() < HIGHEST { height_m } else { f32::NAN }
}

simd! {
    /// Bed and water of a row at the start of a step: the land and its change so far, and what stands there and rains. What
    /// is no land has a bed of NaN and no water.
    pub fn load(bed: &mut [f32], wet: &mut [f32], land: [&[f32]; 2], water: [&[f32]; 2], pace: &Pace) {
        let n = bed.len();
        let ([land, change], [before, rain_mm_h]) = (land.map(|row| &row[..n]), water.map(|row| &row[..n]));
        let wet = &mut wet[..n];
        for i in 0..n {
            let height = height(land[i] + change[i]);
            let rain = if rain_mm_h[i] > 0.0 { rain_mm_h[i] } else { 0.0 };
            let depth = before[i] + rain * pace.rain_m;
            bed[i] = height;
            wet[i] = if height.is_nan() { 0.0 } else { depth };
        }
    }
}

simd! {
    /// The bed alone.
    pub fn bed(bed: &mut [f32], land: &[f32], change: &[f32]) {
        let n = bed.len();
        let (land, change) = (&land[..n], &change[..n]);
        for i in 0..n {
            bed[i] = height(land[i] + change[i]);
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

/// x to the power of -1/6, for x of [`DRY_M`] and more, within 6e-6 of its value: a first guess from the exponent, and
/// two steps of Newton's method, which needs no division; the constants centre the error.
#[inline(always)]
fn inverse_sixth_root(x: f32) -> f32 {
    const SHIFT: f32 = 12_582_912.0; // 1.5 · 2²³: a sum with it is rounded to a whole number, kept in the low bits
    let sixth = ((x.to_bits() >> 9) as i32 as f32) * (1.0 / 6.0) + SHIFT;
    let sixth = (sixth.to_bits() << 9).wrapping_sub(SHIFT.to_bits() << 9);
    let part = x * (1.0 / 6.0);
    let newton = |t: f32, centre: f32| {
        let cube = t * t * t;
        t * (centre - part * (cube * cube))
    };
    let guess = f32::from_bits(0x4a0e_1d03_u32.wrapping_sub(sixth));
    newton(newton(guess, 1.168_266_7), 1.166_671_2)
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
    let root2 = root * root;
    let root3 = root2 * root;
    let root6 = root3 * root3;
    let root12 = root6 * root6;
    let root24 = root12 * root12;
    // squares, so that one root does for both directions of slope and of flow
    let rough = pace.friction * (root24 * (root2 * root2));
    let steep = pace.steep * (fall * fall + along[1] * along[1]) * root24;
    let square = (if rough > steep { rough } else { steep }) * (q * q + along[0] * along[0]);
    let square = if square < 1e30 { square } else { 1e30 };
    let friction = square * inverse_root(square);
    let moved = (q + pace.push * depth * fall) * inverse(1.0 + friction);
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
    /// Discharge through the faces north of a row after a step, m²/s, not yet limited to the water there is. `bed` and
    /// `water` are those two rows and one row north of it, and here; `west` the discharge before the step, and `fall` the
    /// fall eastward, of the row north and here. Keeps the discharge `before` the step, and gives the fall southward of the
    /// row north.
    #[expect(clippy::too_many_arguments, reason = "only arguments are known not to overlap, which makes it vectorise")]
    pub fn inertial_north(
        discharge: &mut [f32], before: &mut [f32], south: &mut [f32], bed: [&[f32]; 3], water: [&[f32]; 3],
        west: [&[f32]; 2], fall: [&[f32]; 2], pace: &Pace,
    ) {
        let n = discharge.len();
        let (before, south) = (&mut before[..n], &mut south[..n]);
        let ([bed0, bed1, bed2], [water0, water1, water2]) = (bed.map(|row| &row[..n]), water.map(|row| &row[..n]));
        let ([fall0, fall1], [west0, west1]) = (fall.map(|row| &row[..n]), west.map(|row| &row[..n]));
        let [east0, east1] = west.map(|row| &row[1..=n]);
        for i in 0..n {
            let q = discharge[i];
            before[i] = q;
            south[i] = half_fall([bed0[i], bed2[i]], [water0[i], water2[i]]);
            let flowing = 0.25 * ((west0[i] + east0[i]) + (west1[i] + east1[i]));
            let falling = 0.5 * (fall0[i] + fall1[i]);
            discharge[i] = inertial(q, [flowing, falling], [bed1[i], bed2[i]], [water1[i], water2[i]], pace);
        }
    }
}

simd! {
    /// The same through the faces within a row: `bed`, `water` and the southward `fall` of the cells west and east of each
    /// face, `north` the discharge before the step through the faces north and south of the cell west of it, then of that
    /// east of it.
    pub fn inertial_west(
        discharge: &mut [f32], bed: [&[f32]; 2], water: [&[f32]; 2], fall: [&[f32]; 2], north: [&[f32]; 4], pace: &Pace,
    ) {
        let n = discharge.len();
        let ([bed0, bed1], [water0, water1]) = (bed.map(|row| &row[..n]), water.map(|row| &row[..n]));
        let ([fall0, fall1], [north0, south0, north1, south1]) = (fall.map(|row| &row[..n]), north.map(|row| &row[..n]));
        for i in 0..n {
            let flowing = 0.25 * ((north0[i] + south0[i]) + (north1[i] + south1[i]));
            let falling = 0.5 * (fall0[i] + fall1[i]);
            let along = [flowing, falling];
            discharge[i] = inertial(discharge[i], along, [bed0[i], bed1[i]], [water0[i], water1[i]], pace);
        }
    }
}

simd! {
    /// The same for pipes, through any faces: `bed` and `water` of the cells before and after each.
    pub fn pipes(discharge: &mut [f32], bed: [&[f32]; 2], water: [&[f32]; 2], pace: &Pace) {
        let n = discharge.len();
        let ([bed0, bed1], [water0, water1]) = (bed.map(|row| &row[..n]), water.map(|row| &row[..n]));
        for i in 0..n {
            discharge[i] = pipe(discharge[i], [bed0[i], bed1[i]], [water0[i], water1[i]], pace);
        }
    }
}

/// Half the fall of the water surface between the cells on both sides of one, 0 beside what is no land.
#[inline(always)]
fn half_fall(bed: [f32; 2], water: [f32; 2]) -> f32 {
    let fall = 0.5 * ((bed[0] - bed[1]) + (water[0] - water[1]));
    if fall.abs() < HIGHEST { fall } else { 0.0 }
}

simd! {
    /// Half the fall of the water surface from the cells `before` to those `after`, 0 beside what is no land.
    pub fn fall(out: &mut [f32], bed: [&[f32]; 2], water: [&[f32]; 2]) {
        let n = out.len();
        let ([bed0, bed1], [water0, water1]) = (bed.map(|row| &row[..n]), water.map(|row| &row[..n]));
        for i in 0..n {
            out[i] = half_fall([bed0[i], bed1[i]], [water0[i], water1[i]]);
        }
    }
}

simd! {
    /// The share of its outflow that a cell can give in a step, a hair below all its water, more than the error of the
    /// inverse. `faces` are those on its
    /// west, east, north and south.
    pub fn shares(share: &mut [f32], water: &[f32], faces: [&[f32]; 4], pace: &Pace) {
        let n = share.len();
        let (water, [west, east, north, south]) = (&water[..n], faces.map(|row| &row[..n]));
        let positive = |q: f32| if q > 0.0 { q } else { 0.0 };
        for i in 0..n {
            let out = (positive(east[i]) + positive(-west[i])) + (positive(south[i]) + positive(-north[i]));
            let out_m = out * pace.step;
            let most_m = water[i] * (1.0 - 1e-5);
            share[i] = if out_m > most_m.max(LEAST_M) { most_m * inverse(out_m) } else { 1.0 };
        }
    }
}

/// Discharge limited to the share its cell of origin can give: `shares` of the cell before the face and after it.
#[inline(always)]
pub(super) fn limited(discharge: f32, shares: [f32; 2]) -> f32 {
    discharge * if discharge > 0.0 { shares[0] } else { shares[1] }
}

simd! {
    /// The same for a row of faces.
    pub fn limit(discharge: &mut [f32], shares: [&[f32]; 2]) {
        let n = discharge.len();
        let [before, after] = shares.map(|row| &row[..n]);
        for i in 0..n {
            discharge[i] = limited(discharge[i], [before[i], after[i]]);
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
    /// Evaporation and infiltration of a step.
    pub fn dry(depth: &mut [f32], pace: &Pace) {
        for depth in depth {
            let left = *depth * pace.evaporation - pace.infiltration_m;
            *depth = if left > 0.0 { left } else { 0.0 };
        }
    }
}
