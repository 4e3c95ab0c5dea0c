//! The water in each cell: its depth, and the exchange between the bed and the water above it.

use super::{
    flow::film,
    physics::{Capacity, Pace},
};
use crate::numerics::{
    math::lane::{inverse, inverse_root},
    simd::simd,
};

/// Minimum depth of water, in metres; thinner water counts as this deep.
const THIN_M: f32 = 1e-6;
/// Water below this depth, in metres, has no concentration.
const NONE_M: f32 = 1e-20;
/// Bound of the decay exponent of entrainment.
const FASTEST: f32 = 1e6;

/// 1 - e^(-x) for x = `part` / `whole` of 0 and more, within 1 %, by the Padé approximant of order 1 over 2: never
/// above 1.
#[inline(always)]
fn reached(part: f32, whole: f32) -> f32 {
    let sixth = part * (1.0 / 6.0);
    let above = part * (whole + sixth);
    above * inverse(whole * whole + part * ((2.0 / 3.0) * whole + sixth))
}

/// Returns the difference between two neighbours; if one is a hole, the difference to the cell itself.
#[inline(always)]
fn rise(before: f32, here: f32, after: f32) -> f32 {
    let before = if before.is_nan() { here } else { before };
    let after = if after.is_nan() { here } else { after };
    after - before
}

#[inline(always)]
fn least(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
fn most(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// The inputs of a row; rows with ghosts are marked.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row<'a> {
    /// Discharge through the faces on the west, the east, the north and the south, limited to the available water.
    pub faces: [&'a [f32]; 4],
    /// Depth of water before the step in the row north, with ghosts, in this one and in the one south.
    pub wets: [&'a [f32]; 3],
    /// Bed of the same rows.
    pub beds: [&'a [f32]; 3],
    /// Suspended sediment before the step.
    pub sediment: &'a [f32],
    /// Factor on the rate of entrainment, negative where the bed is fixed.
    pub mobile: &'a [f32],
    /// One over the hardness of the rock below the loose ground.
    pub weakness: &'a [f32],
}

simd! {
    /// Moves the water, and brings its load nearer to its capacity: erodes ground, loose before rock, or deposits it.
    /// Returns the greatest depth.
    ///
    /// Outputs the depth of water, adds |q| Δt to `flow`, changes the bed's `change` and the `loose` ground by
    /// `acceleration` times the change of the `load`, adds that to `taken`, and outputs the concentration of the load
    /// in the water before the step, `part`.
    #[expect(clippy::too_many_arguments, reason = "only arguments are known not to overlap, which makes it vectorise")]
    pub fn exchange(
        depth: &mut [f32], flow: &mut [f32], change: &mut [f32], loose: &mut [f32],
        taken: &mut [f32], load: &mut [f32], part: &mut [f32], row: &Row<'_>, pace: &Pace,
    ) -> f32 {
        match pace.law {
            Capacity::UnitPower => exchange_by::<{ Capacity::UnitPower as u8 }>(depth, flow, change, loose, taken, load, part, row, pace),
            Capacity::Shear => exchange_by::<{ Capacity::Shear as u8 }>(depth, flow, change, loose, taken, load, part, row, pace),
            Capacity::Speed => exchange_by::<{ Capacity::Speed as u8 }>(depth, flow, change, loose, taken, load, part, row, pace),
        }
    }
}

#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "as above")]
fn exchange_by<const LAW: u8>(
    depth: &mut [f32],
    flow: &mut [f32],
    change: &mut [f32],
    loose: &mut [f32],
    taken: &mut [f32],
    load: &mut [f32],
    part: &mut [f32],
    row: &Row<'_>,
    pace: &Pace,
) -> f32 {
    let n = depth.len();
    let (flow, change) = (&mut flow[..n], &mut change[..n]);
    let (loose, total, load, part) = (&mut loose[..n], &mut taken[..n], &mut load[..n], &mut part[..n]);
    let (sediment, mobile, weakness) = (&row.sediment[..n], &row.mobile[..n], &row.weakness[..n]);
    let [west, east, north, south] = row.faces.map(|faces| &faces[..n]);
    // each on its own: in arrays of slices the compiler loses their lengths, and leaves the end of a row to a scalar loop
    let (beds, wets) =
        (|j: usize, from: usize| &row.beds[j][from..][..n], |j: usize, from: usize| &row.wets[j][from..][..n]);
    let (bed_north_west, bed_north, bed_north_east) = (beds(0, 0), beds(0, 1), beds(0, 2));
    let (bed_west, bed, bed_east) = (beds(1, 0), beds(1, 1), beds(1, 2));
    let (bed_south_west, bed_south, bed_south_east) = (beds(2, 0), beds(2, 1), beds(2, 2));
    let (wet_north, wet_south) = (wets(0, 1), wets(2, 1));
    let (wet_west, wet, wet_east) = (wets(1, 0), wets(1, 1), wets(1, 2));
    let by_depth = LAW != Capacity::Speed as u8;
    let mut deepest = 0;
    for i in 0..n {
        let (from_west, to_east, from_north, to_south) = (west[i], east[i], north[i], south[i]);
        let before = wet[i];
        let after = most(before + pace.step * ((from_west - to_east) + (from_north - to_south)), 0.0);
        depth[i] = after;
        // floats of one sign have the order of their bits
        deepest = deepest.max(after.to_bits() as i32);
        let mean = 0.5 * (before + after);
        let (across, down) = (0.5 * (from_west + to_east), 0.5 * (from_north + to_south));
        let square = across * across + down * down;
        let q = square * inverse_root(square);
        flow[i] += q * pace.dt_s;

        let sine = if by_depth {
            // the work of gravity on the water: the mean of the fall through opposite faces
            let fall = |rise: f32, deeper: f32| most(least(rise + deeper, pace.steepest_m), -pace.steepest_m);
            let falls_x = from_west * fall(bed_west[i] - bed[i], wet_west[i] - before)
                + to_east * fall(bed[i] - bed_east[i], before - wet_east[i]);
            let falls_y = from_north * fall(bed_north[i] - bed[i], wet_north[i] - before)
                + to_south * fall(bed[i] - bed_south[i], before - wet_south[i]);
            let power = most((falls_x + falls_y) * pace.tilt, 0.0);
            power * inverse_root(square + power * power)
        } else {
            let x = rise(bed_west[i], bed[i], bed_east[i]) * pace.tilt;
            let y = rise(bed_north[i], bed[i], bed_south[i]) * pace.tilt;
            let slope2 = least(x * x + y * y, 1e12);
            let one = 1.0 + slope2;
            let sine = most(slope2, pace.tilt_floor * one);
            sine * inverse_root(sine * one)
        };
        let shallow = most(1.0 - mean * pace.per_deep, 0.0);
        let power = pace.capacity * (sine * q) * (film(mean, pace) * shallow);
        let thin = most(mean, THIN_M);
        let able = if by_depth { least(power, pace.thickest * mean) } else { power * inverse(thin) };
        let able = most(able, 0.0);

        let missing = able - sediment[i];
        let rate = pace.entrainment * most(mobile[i], 0.0);
        let rate = if LAW == Capacity::Shear as u8 { rate * most(pace.shear * mean * sine - 1.0, 0.0) } else { rate };
        let rate = least(rate, FASTEST);
        let takes = missing > 0.0;
        let whole = if by_depth & !takes { thin } else { 1.0 };
        let taken = pace.acceleration * missing * reached(if takes { rate } else { pace.settling }, whole);
        let limit = least(pace.bite_m[0] + pace.bite_m[1] * mean, pace.most_m);
        let taken = most(least(taken, limit), -limit);
        // do not dig pits
        let taken = if by_depth {
            let beside = least(least(bed_west[i], bed[i]), least(bed_east[i], bed[i]));
            let above = least(bed_north_west[i], least(bed_north[i], least(bed_north_east[i], bed[i])));
            let below = least(bed_south_west[i], least(bed_south[i], least(bed_south_east[i], bed[i])));
            let deepest = 0.25 * (bed[i] - least(beside, least(above, below)));
            if taken > deepest { deepest } else { taken }
        } else {
            taken
        };
        // below the loose ground, only at the rate of rock
        let beyond = taken - loose[i];
        let taken = if beyond > 0.0 { loose[i] + beyond * least(pace.rock * weakness[i], 1.0) } else { taken };
        // at most the load of the water
        let taken = most(taken, -sediment[i] * pace.acceleration);
        let taken = if mobile[i] >= 0.0 { taken } else { 0.0 };
        change[i] -= taken;
        total[i] += taken;
        loose[i] = most(loose[i] - taken, 0.0);
        let carried = sediment[i] + taken * pace.per_acceleration;
        load[i] = carried;
        part[i] = if before > NONE_M { carried * inverse(before) } else { 0.0 };
    }
    f32::from_bits(deepest as u32)
}
