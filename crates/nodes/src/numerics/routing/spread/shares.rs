//! Fractions of a cell's water for each neighbour, in SIMD lanes.
//!
//! They are computed in single precision with a small relative error, and add up to 1 within a unit in the last place.

use std::f32::consts::{FRAC_1_SQRT_2, FRAC_PI_4};

use crate::numerics::{
    math::lane,
    routing::code::{LINK, OUTLET, is_diagonal},
    simd::simd,
};

/// Cells that are computed at once.
pub const LANES: usize = 64;
/// A number for each of these cells.
pub type Lanes = [f32; LANES];

simd! {
    /// Shares in proportion to slope to the power of `exponent` (Freeman 1991). `around` are the heights of the cells,
    /// then of their neighbours in the order of the codes.
    pub fn freeman(around: &[Lanes; 9], exponent: f32, shares: &mut [Lanes; 8]) {
        let [here, around @ ..] = around;
        let mut slopes = [[0.0; LANES]; 8];
        let mut steepest = [0.0_f32; LANES];
        for direction in 0..8 {
            let per_distance = if is_diagonal(direction) { FRAC_1_SQRT_2 } else { 1.0 };
            for x in 0..LANES {
                let slope = (here[x] - around[direction][x]) * per_distance;
                slopes[direction][x] = slope;
                steepest[x] = if slope > steepest[x] { slope } else { steepest[x] };
            }
        }
        let mut whole = [0.0; LANES];
        for direction in 0..8 {
            for x in 0..LANES {
                let slope = slopes[direction][x];
                let ratio = if slope >= steepest[x] { 1.0 } else { slope / steepest[x] };
                let power = if slope > 0.0 { lane::pow(ratio, exponent) } else { 0.0 };
                shares[direction][x] = power;
                whole[x] += power;
            }
        }
        let mut rest = [1.0; LANES];
        for shares in shares.iter_mut() {
            for x in 0..LANES {
                shares[x] = if whole[x] > 0.0 { shares[x] / whole[x] } else { 0.0 };
                rest[x] -= shares[x];
            }
        }
        for direction in 0..8 {
            for x in 0..LANES {
                let takes = (slopes[direction][x] >= steepest[x]) & (steepest[x] > 0.0);
                shares[direction][x] += if takes { rest[x] } else { 0.0 };
                rest[x] = if takes { 0.0 } else { rest[x] };
            }
        }
    }
}

/// Face and corner neighbour that bound a facet, as directions.
const FACETS: [(usize, usize); 8] = [(0, 1), (2, 1), (2, 3), (4, 3), (4, 5), (6, 5), (6, 7), (0, 7)];
/// An invalid direction.
const NOWHERE: u32 = 8;

simd! {
    /// Shares of the two neighbours that bound the steepest facet, by angle (Tarboton 1997).
    pub fn d_infinity(around: &[Lanes; 9], shares: &mut [Lanes; 8]) {
        let [here, around @ ..] = around;
        // for the steepest facet: the square of its slope, the drops along its two legs, its two neighbours; in double
        // precision, since the slopes of adjacent facets differ only by the square of a small fraction
        let mut steepest = [0.0_f64; LANES];
        let (mut leg_1, mut leg_2) = ([1.0_f32; LANES], [0.0_f32; LANES]);
        let (mut beside, mut across) = ([NOWHERE; LANES], [NOWHERE; LANES]);
        for (side, corner) in FACETS {
            for x in 0..LANES {
                let (drop_1, drop_2) = (here[x] - around[side][x], around[side][x] - around[corner][x]);
                let diagonal = here[x] - around[corner][x];
                let (diagonal, wide_1, wide_2) = (f64::from(diagonal), f64::from(drop_1), f64::from(drop_2));
                let along_side = if drop_1 > 0.0 { wide_1 * wide_1 } else { 0.0 };
                let along_diagonal = if diagonal > 0.0 { 0.5 * diagonal * diagonal } else { 0.0 };
                let inside = wide_1 * wide_1 + wide_2 * wide_2;
                let falling = if drop_2 >= drop_1 { along_diagonal } else { inside };
                let square = if drop_2 <= 0.0 { along_side } else { falling };
                let steeper = square > steepest[x];
                steepest[x] = if steeper { square } else { steepest[x] };
                leg_1[x] = if steeper { drop_1 } else { leg_1[x] };
                leg_2[x] = if steeper { drop_2 } else { leg_2[x] };
                beside[x] = if steeper { side as u32 } else { beside[x] };
                across[x] = if steeper { corner as u32 } else { across[x] };
            }
        }
        let (mut side_share, mut corner_share) = ([0.0; LANES], [0.0; LANES]);
        for x in 0..LANES {
            // the smaller of the angles to the two neighbours, from which the larger follows
            const TAN_EIGHTH: f32 = 0.414_213_57;
            let near_side = leg_2[x] < TAN_EIGHTH * leg_1[x];
            let opposite = if near_side { leg_2[x] } else { leg_1[x] - leg_2[x] };
            let adjacent = if near_side { leg_1[x] } else { leg_1[x] + leg_2[x] };
            let smaller = lane::atan(opposite / adjacent) * (1.0 / FRAC_PI_4);
            let inside = if near_side { smaller } else { 1.0 - smaller };
            let (only_side, only_corner) = (leg_2[x] <= 0.0, leg_2[x] >= leg_1[x]);
            let corner = if only_corner { 1.0 } else { inside };
            corner_share[x] = if only_side { 0.0 } else { corner };
            let side = if near_side { 1.0 - smaller } else { smaller };
            let side = if only_corner { 0.0 } else { side };
            side_share[x] = if only_side { 1.0 } else { side };
        }
        for (direction, shares) in shares.iter_mut().enumerate() {
            for x in 0..LANES {
                let at_side = if beside[x] == direction as u32 { side_share[x] } else { 0.0 };
                shares[x] = if across[x] == direction as u32 { corner_share[x] } else { at_side };
            }
        }
    }
}

simd! {
    /// Where no neighbour is lower, as on the surface of a lake, all water goes to the receiver of the cell's code, if
    /// it has one. Outlets give nothing.
    pub fn follow_codes(codes: &[u8; LANES], shares: &mut [Lanes; 8]) {
        let mut whole = [0.0; LANES];
        for shares in shares.iter() {
            for x in 0..LANES {
                whole[x] += shares[x];
            }
        }
        for (direction, shares) in shares.iter_mut().enumerate() {
            for x in 0..LANES {
                let followed = if codes[x] & LINK == direction as u8 { 1.0 } else { 0.0 };
                let share = if whole[x] > 0.0 { shares[x] } else { followed };
                shares[x] = if codes[x] & OUTLET != 0 { 0.0 } else { share };
            }
        }
    }
}

simd! {
    /// Computes the set of directions in which each cell gives water.
    pub fn ways(shares: [&[f32]; 8], ways: &mut [u8]) {
        let len = ways.len();
        let shares = shares.map(|shares| &shares[..len]);
        for x in 0..len {
            let mut set = 0;
            for (direction, shares) in shares.iter().enumerate() {
                set |= u32::from(shares[x] > 0.0) << direction;
            }
            ways[x] = set as u8;
        }
    }
}

simd! {
    /// Counts the fractions above 0 of each cell.
    pub fn count(shares: [&[f32]; 8], counts: &mut [u8]) {
        let len = counts.len();
        let shares = shares.map(|shares| &shares[..len]);
        for x in 0..len {
            let mut count = 0;
            for shares in shares {
                count += u32::from(shares[x] > 0.0);
            }
            counts[x] = count as u8;
        }
    }
}

/// Interleaves the fractions of a cell.
pub fn interleave(shares: [&[f32]; 8], cells: &mut [[f32; 8]]) {
    let len = cells.len();
    let shares = shares.map(|shares| &shares[..len]);
    for (x, cell) in cells.iter_mut().enumerate() {
        *cell = shares.map(|shares| shares[x]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::{math, routing::code};

    /// Returns the fractions of a cell, given its own height and those of its neighbours.
    fn of(around: [f64; 9], kernel: impl Fn(&[Lanes; 9], &mut [Lanes; 8])) -> [f32; 8] {
        let mut shares = [[f32::NAN; LANES]; 8];
        kernel(&around.map(|height| [height as f32; LANES]), &mut shares);
        for shares in &shares {
            assert!(shares.iter().all(|share| share == &shares[0]));
        }
        shares.map(|shares| shares[0])
    }

    /// Returns the heights of a cell and its neighbours on a plane that falls by 0.3 per cell in the given direction.
    fn plane(degrees: f64) -> [f64; 9] {
        let (sin, cos) = (math::sin(degrees.to_radians()), math::cos(degrees.to_radians()));
        std::array::from_fn(|at| match at {
            0 => 0.0,
            _ => {
                let (dx, dy) = code::STEPS[at - 1];
                -0.3 * (f64::from(dx) * cos - f64::from(dy) * sin)
            }
        })
    }

    #[test]
    fn on_a_plane_two_receivers_share_by_angle() {
        for degrees in 0..360 {
            let shares = of(plane(f64::from(degrees)), d_infinity);
            let across = f64::from(degrees % 90 - 45).abs();
            let (corner, side) = (degrees / 90 * 2 + 1, (degrees + 45) / 90 * 2 % 8);
            // heights and fractions in single precision
            assert!((f64::from(shares[corner as usize]) - (1.0 - across / 45.0)).abs() < 1e-6, "{degrees}: {shares:?}");
            assert!((f64::from(shares[side as usize]) - across / 45.0).abs() < 1e-6, "{degrees}: {shares:?}");
        }
    }

    /// A test case of Landlab: the plane x + 2 y, with rows to the south.
    #[test]
    fn a_plane_of_whole_numbers_shares_as_others_say() {
        let around = std::array::from_fn(|at| match at {
            0 => 0.0,
            _ => f64::from(code::STEPS[at - 1].0 + 2 * code::STEPS[at - 1].1),
        });
        let shares = of(around, d_infinity);
        assert!((shares[2] - 0.409_665_53).abs() < 1e-7 && (shares[3] - 0.590_334_5).abs() < 1e-7, "{shares:?}");
    }

    /// A test case of fastscapelib: a peak whose squared diagonal slopes are twice the others.
    #[test]
    fn a_peak_is_shared_by_powers_of_slopes() {
        let diagonal = 2.0 * std::f64::consts::SQRT_2;
        let around = std::array::from_fn(|at| match at {
            0 => diagonal,
            _ if is_diagonal(at - 1) => 0.0,
            _ => std::f64::consts::SQRT_2,
        });
        for (exponent, side, corner) in [(0.0, 0.125, 0.125), (2.0, 1.0 / 12.0, 1.0 / 6.0)] {
            let shares = of(around, |around, shares| freeman(around, exponent, shares));
            assert!((shares.iter().sum::<f32>() - 1.0).abs() <= f32::EPSILON, "{shares:?}");
            for (direction, share) in shares.iter().enumerate() {
                let expected: f32 = if is_diagonal(direction) { corner } else { side };
                assert!((share - expected).abs() < 1e-6, "{exponent}: {shares:?}");
            }
        }
    }

    #[test]
    fn flats_follow_their_code_and_outlets_give_nothing() {
        for (code, expected) in [(3, Some(3)), (3 | code::TURNED, Some(3)), (code::PIT, None), (OUTLET, None)] {
            let mut shares = [[0.0; LANES]; 8];
            follow_codes(&[code; LANES], &mut shares);
            let found = shares.map(|shares| shares[0]);
            assert_eq!(found, std::array::from_fn(|direction| if Some(direction) == expected { 1.0 } else { 0.0 }));
        }
    }

    #[test]
    fn heights_that_are_not_numbers_leave_shares_that_are() {
        for odd in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            for at in 0..9 {
                let mut around = plane(77.0);
                around[at] = odd;
                for shares in [of(around, d_infinity), of(around, |around, shares| freeman(around, 1.1, shares))] {
                    let whole: f32 = shares.iter().sum();
                    assert!(whole == 0.0 || (whole - 1.0).abs() <= f32::EPSILON, "{odd} at {at}: {shares:?}");
                }
            }
        }
    }
}
