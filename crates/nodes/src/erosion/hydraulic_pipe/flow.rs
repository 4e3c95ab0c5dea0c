//! Water: discharge through the faces between cells, and the depth in them.
//!
//! A face has one signed discharge per metre of width, positive eastward or southward. Differences of depth and of
//! bed are computed separately, so that a level lake stays exactly level on a bed far above zero.

use super::physics::Pace;
use crate::numerics::{
    math::lane::{inverse, inverse_root},
    simd::simd,
};

/// Depth of water over a face, in metres, below which nothing flows.
pub(super) const DRY_M: f32 = 1e-4;
/// Outflow of a cell in a step, in metres, that is not worth limiting.
const LEAST_M: f32 = 1e-30;
/// Larger differences of the water surface, in metres, are edges of holes in the data.
pub(super) const HIGHEST: f32 = 1e15;

/// Cells outside the terrain are NaN.
#[inline(always)]
fn height(height_m: f32) -> f32 {
    if height_m.abs() < HIGHEST { height_m } else { f32::NAN }
}

simd! {
    /// Computes bed and water of a row at the start of a step: the terrain and its change so far, the water and the
    /// rain. Cells outside the terrain have a bed of NaN and no water.
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

/// Depth of water over a face and the fall of its surface across it: the higher surface above the higher bed, made
/// deeper by the `lean` of the water on the higher side.
#[inline(always)]
fn face(bed: [f32; 2], water: [f32; 2], lean: [f32; 2]) -> (f32, f32) {
    let step = bed[0] - bed[1];
    let fall = step + (water[0] - water[1]);
    let here = water[0] + if step < 0.0 { step } else { 0.0 };
    let there = water[1] - if step > 0.0 { step } else { 0.0 };
    let deeper = if fall > 0.0 { 1.0 + lean[0] } else { 1.0 - lean[1] };
    (if here > there { here } else { there } * deeper, fall)
}

simd! {
    /// Computes by how much the water at a cell's far face on an axis is deeper than in its middle, as a fraction: half
    /// the slope of the depth, limited as by van Leer (1974). `water` is of the cells before, here and after.
    pub fn lean(out: &mut [f32], water: [&[f32]; 3]) {
        let n = out.len();
        let [before, here, after] = water.map(|row| &row[..n]);
        for i in 0..n {
            let (rise, next) = (here[i] - before[i], after[i] - here[i]);
            let (product, sum) = (rise * next, rise + next);
            let whole = sum.abs() * here[i];
            let lean = (product * inverse(if whole > LEAST_M { whole } else { LEAST_M })).copysign(sum);
            out[i] = if (product > 0.0) & (here[i] > DRY_M) { lean } else { 0.0 };
        }
    }
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

/// Returns the discharge after a step of inertia and gravity, before friction.
#[inline(always)]
fn driven(q: f32, bed: [f32; 2], water: [f32; 2], lean: [f32; 2], pace: &Pace) -> f32 {
    let (depth, fall) = face(bed, water, lean);
    let open = (depth > DRY_M) & (fall.abs() < HIGHEST);
    let fall = if fall > pace.steepest_m { pace.steepest_m } else { fall };
    let fall = if fall < -pace.steepest_m { -pace.steepest_m } else { fall };
    let moved = q + pace.push * depth * fall;
    if open { moved } else { 0.0 }
}

/// Applies Manning's friction to the discharge Q that is `driven` through a face with `across` along it: returns the
/// q that solves q (1 + k |q|) = Q with k = g Δt n² / h^(7/3), limited to critical flow.
///
/// Both use the norm of the vector, so neither turns the flow (de Almeida and Bates 2013). With the discharge before
/// the step instead of that after it (Bates, Horritt and Fewtrell 2010, equation 11), thin water on steep ground
/// would oscillate between two discharges from step to step.
#[inline(always)]
fn rubbed(driven: f32, across: f32, bed: [f32; 2], water: [f32; 2], lean: [f32; 2], pace: &Pace) -> f32 {
    let (depth, _) = face(bed, water, lean);
    let depth = if depth > DRY_M { depth } else { DRY_M };
    let root = inverse_sixth_root(depth);
    let root2 = root * root;
    let root3 = root2 * root;
    let root6 = root3 * root3;
    let square = driven * driven + across * across;
    let square = if square < 1e30 { square } else { 1e30 };
    let per_norm = inverse_root(square);
    let drag = 1.0 + pace.friction * (root6 * root6 * root2) * (square * per_norm);
    let left = 2.0 * inverse(1.0 + drag * inverse_root(drag));
    let critical = pace.critical * (depth * depth) * root3 * per_norm;
    driven * if left < critical { left } else { critical }
}

/// A pipe between the two columns (O'Brien and Hodgins 1995, Mei, Decaudin and Hu 2007) as wide as the face, and as
/// high as the water over it or `pace.section_m`.
#[inline(always)]
fn pipe(q: f32, bed: [f32; 2], water: [f32; 2], pace: &Pace) -> f32 {
    let (depth, fall) = face(bed, water, [0.0; 2]);
    let open = (depth > DRY_M) & (fall.abs() < HIGHEST);
    let section = if pace.section_m > 0.0 { pace.section_m } else { depth };
    let moved = q * pace.damping + pace.push * section * fall;
    if open { moved } else { 0.0 }
}

simd! {
    /// Discharge that inertia and gravity give in a step, before friction, m²/s: through any faces, from that `before`.
    /// `bed`, `water` and
    /// `lean` are of the cells before and after each.
    pub fn drive(
        discharge: &mut [f32], before: &[f32], bed: [&[f32]; 2], water: [&[f32]; 2], lean: [&[f32]; 2], pace: &Pace,
    ) {
        let n = discharge.len();
        let ([bed0, bed1], [water0, water1]) = (bed.map(|row| &row[..n]), water.map(|row| &row[..n]));
        let (before, [lean0, lean1]) = (&before[..n], lean.map(|row| &row[..n]));
        for i in 0..n {
            let (bed, water) = ([bed0[i], bed1[i]], [water0[i], water1[i]]);
            discharge[i] = driven(before[i], bed, water, [lean0[i], lean1[i]], pace);
        }
    }
}

simd! {
    /// Applies friction to the discharge `through` faces, not yet limited to the available water. `along` is that
    /// through the four faces of the other direction around each: both of the cell before it, and both of that after
    /// it.
    pub fn rub(
        discharge: &mut [f32], through: &[f32], along: [&[f32]; 4], bed: [&[f32]; 2], water: [&[f32]; 2],
        lean: [&[f32]; 2], pace: &Pace,
    ) {
        let n = discharge.len();
        let ([bed0, bed1], [water0, water1]) = (bed.map(|row| &row[..n]), water.map(|row| &row[..n]));
        let [lean0, lean1] = lean.map(|row| &row[..n]);
        let (through, [along0, along1, along2, along3]) = (&through[..n], along.map(|row| &row[..n]));
        for i in 0..n {
            let along = 0.25 * ((along0[i] + along1[i]) + (along2[i] + along3[i]));
            let (bed, water) = ([bed0[i], bed1[i]], [water0[i], water1[i]]);
            discharge[i] = rubbed(through[i], along, bed, water, [lean0[i], lean1[i]], pace);
        }
    }
}

simd! {
    /// Discharge through any faces after a step, for pipes: `bed` and `water` of the cells before and after each.
    pub fn pipes(discharge: &mut [f32], bed: [&[f32]; 2], water: [&[f32]; 2], pace: &Pace) {
        let n = discharge.len();
        let ([bed0, bed1], [water0, water1]) = (bed.map(|row| &row[..n]), water.map(|row| &row[..n]));
        for i in 0..n {
            discharge[i] = pipe(discharge[i], [bed0[i], bed1[i]], [water0[i], water1[i]], pace);
        }
    }
}

simd! {
    /// Computes the fraction of its outflow that a cell can supply in a step, slightly less than all its water, by
    /// more than the error of the inverse. `faces` are those on its west, east, north and south.
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

/// Returns that of the numbers `before` and `after` a face which belongs to the cell of origin of its discharge. By its
/// bits: with a branch, the compiler selects one of two addresses and gathers from them, which takes several times as
/// long.
#[inline(always)]
pub(super) fn origin(discharge: f32, before: f32, after: f32) -> f32 {
    let is_before = 0_u32.wrapping_sub(u32::from(discharge > 0.0));
    f32::from_bits((before.to_bits() & is_before) | (after.to_bits() & !is_before))
}

simd! {
    /// Limits the discharge through a row of faces to the fraction that its cell of origin can supply: `shares` of the
    /// cells before and after each.
    pub fn limit(discharge: &mut [f32], shares: [&[f32]; 2]) {
        let n = discharge.len();
        let [before, after] = shares.map(|row| &row[..n]);
        for i in 0..n {
            discharge[i] *= origin(discharge[i], before[i], after[i]);
        }
    }
}

/// Depth over which a film of water reaches its full speed, as multiples of the film's depth.
const FILM: [f32; 2] = [1.0, 3.0];

/// 0 for water thinner than the film, 1 from three times its depth on.
#[inline(always)]
pub(super) fn film(depth_m: f32, pace: &Pace) -> f32 {
    crate::numerics::math::lane::smoothstep((depth_m * pace.per_film - FILM[0]) * (1.0 / (FILM[1] - FILM[0])))
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
