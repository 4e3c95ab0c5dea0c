//! The exchange between the bed and the water above it.

use super::physics::Pace;
use crate::simd::simd;

/// 1 - e^(-x) for x of 0 and more, within 1 %, by the Padé approximant of order 1 over 2: never above 1.
#[inline(always)]
fn reached(x: f32) -> f32 {
    let x2 = x * x * (1.0 / 6.0);
    (x + x2) / (1.0 + (2.0 / 3.0) * x + x2)
}

/// The difference between two neighbours, one of which may be a hole: then that to the cell itself.
#[inline(always)]
fn rise(before: f32, here: f32, after: f32) -> f32 {
    let before = if before.is_nan() { here } else { before };
    let after = if after.is_nan() { here } else { after };
    after - before
}

simd! {
    /// Sediment that the water could carry, in metres: capacity · sine of the bed's tilt · speed (· depth), falling to 0
    /// in deep water.
    ///
    /// `bed` is the cell, then those on its west, east, north and south; `speed` is overwritten.
    pub fn capacity(speed: &mut [f32], bed: [&[f32]; 5], before: &[f32], after: &[f32], pace: &Pace) {
        let n = speed.len();
        let ([here, west, east, north, south], before, after) = (bed.map(|row| &row[..n]), &before[..n], &after[..n]);
        for i in 0..n {
            let x = rise(west[i], here[i], east[i]) * pace.tilt;
            let y = rise(north[i], here[i], south[i]) * pace.tilt;
            let squared = x * x + y * y;
            let sine2 = squared / (1.0 + squared);
            let sine2 = if sine2 > pace.tilt_floor { sine2 } else { pace.tilt_floor };
            let depth = 0.5 * (before[i] + after[i]);
            let shallow = 1.0 - depth * pace.per_deep;
            let shallow = if shallow > 0.0 { shallow } else { 0.0 };
            let most = pace.capacity * sine2.sqrt() * speed[i] * shallow;
            let most = if pace.by_depth {
                let most = if most < pace.thickest { most } else { pace.thickest };
                most * depth
            } else {
                most
            };
            speed[i] = if most > 0.0 { most } else { 0.0 };
        }
    }
}

simd! {
    /// Brings the load of the water nearer to its capacity: takes ground, loose before rock, or leaves it.
    ///
    /// Changes the bed's `change` and the `loose` ground by `acceleration` times what the `load` gains. `mobile` is the
    /// factor on the rate of entrainment, below 0 where the bed is held. `row` is capacity, mobility, and depth before
    /// and after.
    pub fn exchange(change: &mut [f32], loose: &mut [f32], load: &mut [f32], sediment: &[f32], row: [&[f32]; 4], pace: &Pace) {
        let n = change.len();
        let (loose, load, sediment) = (&mut loose[..n], &mut load[..n], &sediment[..n]);
        let [capacity, mobile, before, after] = row.map(|row| &row[..n]);
        for i in 0..n {
            let depth = 0.5 * (before[i] + after[i]);
            let missing = capacity[i] - sediment[i];
            let rate = if mobile[i] > 0.0 { mobile[i] } else { 0.0 };
            let thin = if depth > 1e-6 { depth } else { 1e-6 };
            let settled = if pace.by_depth { pace.settling / thin } else { pace.settling };
            let exponent = if missing > 0.0 { pace.entrainment * rate } else { settled };
            let exponent = if exponent < 1e4 { exponent } else { 1e4 };
            let taken = pace.acceleration * missing * reached(exponent);
            let most = 0.01 + 0.1 * depth;
            let most = if most < pace.most_m { most } else { pace.most_m };
            let taken = if taken < most { taken } else { most };
            let taken = if taken > -most { taken } else { -most };
            // of what is below the loose ground only as much as rock gives
            let beyond = taken - loose[i];
            let taken = if beyond > 0.0 { loose[i] + beyond * pace.rock } else { taken };
            // no more than the water carries
            let carried = -sediment[i] * pace.acceleration;
            let taken = if taken > carried { taken } else { carried };
            let taken = if mobile[i] >= 0.0 { taken } else { 0.0 };
            let left = loose[i] - taken;
            change[i] -= taken;
            loose[i] = if left > 0.0 { left } else { 0.0 };
            load[i] = sediment[i] + taken * pace.per_acceleration;
        }
    }
}
