//! Water that spreads over several receivers, and the land it drains.
//!
//! - [`Spread::DInfinity`] (Tarboton 1997): the two neighbours that bound the steepest of the eight triangular facets
//!   around the cell, each by how near the direction of steepest descent is to it.
//! - [`Spread::Freeman`] (Freeman 1991): every lower neighbour, in proportion to a power of its slope.
//!
//! Where no neighbour is lower, as on the surface of a lake, all water goes to the one receiver of the cell's code. On a
//! filled surface with carved codes water cannot go in circles: it goes down, or level along a tree.

use orograph_graph::{Job, NodeError};
use rayon::prelude::*;

use super::{
    Grid,
    code::{self, OUTLET, has_receiver, is_diagonal, opposite},
};
use crate::math;

/// How water is shared among neighbours.
#[derive(Clone, Copy, Debug)]
pub enum Spread {
    /// Between two, by direction.
    DInfinity,
    /// Among all that are lower, by slope to the power of `exponent`.
    Freeman {
        /// 0 shares evenly; large ones come near the steepest descent.
        exponent: f64,
    },
}

/// What each neighbour gets, in the order of the codes. They need not add up to 1.
type Shares = [f32; 8];

impl Spread {
    /// The shares of a cell `around` which the heights are: its own, then its neighbours'.
    fn shares(self, around: [f64; 9]) -> Shares {
        match self {
            Self::DInfinity => d_infinity(around),
            Self::Freeman { exponent } => freeman(around, exponent),
        }
    }
}

fn d_infinity([here, around @ ..]: [f64; 9]) -> Shares {
    /// Directions across a side and across a corner that bound a facet.
    const FACETS: [(usize, usize); 8] = [(0, 1), (2, 1), (2, 3), (4, 3), (4, 5), (6, 5), (6, 7), (0, 7)];
    let mut steepest = 0.0;
    let mut best = None;
    for (side, corner) in FACETS {
        let (drop_1, drop_2) = (here - around[side], around[side] - around[corner]);
        // The square of the slope, and the angle from the side in units of 45°, as a tangent.
        let (square, tangent) = if drop_2 <= 0.0 {
            (if drop_1 > 0.0 { drop_1 * drop_1 } else { 0.0 }, 0.0)
        } else if drop_2 >= drop_1 {
            let drop = here - around[corner];
            (if drop > 0.0 { 0.5 * drop * drop } else { 0.0 }, 1.0)
        } else {
            (drop_1 * drop_1 + drop_2 * drop_2, drop_2 / drop_1)
        };
        if square > steepest {
            steepest = square;
            best = Some((side, corner, tangent));
        }
    }
    let mut shares = [0.0; 8];
    if let Some((side, corner, tangent)) = best {
        let across = math::atan(tangent) / std::f64::consts::FRAC_PI_4;
        shares[corner] = across as f32;
        shares[side] = (1.0 - across) as f32;
    }
    shares
}

fn freeman([here, around @ ..]: [f64; 9], exponent: f64) -> Shares {
    let distance = |direction| if is_diagonal(direction) { std::f64::consts::SQRT_2 } else { 1.0 };
    let slopes: [f64; 8] = std::array::from_fn(|direction| (here - around[direction]) / distance(direction));
    let steepest = slopes.iter().fold(0.0, |steepest, &slope| if slope > steepest { slope } else { steepest });
    slopes.map(|slope| if slope > 0.0 { math::pow(slope / steepest, exponent) as f32 } else { 0.0 })
}

/// Adds `amounts` up downstream: afterwards each is the sum over the cell and all that it receives.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn accumulate(
    job: &Job<'_>,
    grid: &Grid,
    heights: &[f32],
    codes: &[u8],
    spread: Spread,
    amounts: &mut [f64],
) -> Result<(), NodeError> {
    let nx = grid.nx;
    let mut shares: Vec<Shares> = vec![[0.0; 8]; grid.cells()];
    shares.par_chunks_mut(nx).enumerate().try_for_each(|(y, shares)| -> Result<(), NodeError> {
        job.check()?;
        for (x, shares) in shares.iter_mut().enumerate() {
            let cell = y * nx + x;
            let code = codes[cell];
            if code & OUTLET != 0 {
                continue;
            }
            let height = |cell: u32| f64::from(heights[cell as usize]);
            let around = std::array::from_fn(|at| match at {
                0 => height(cell as u32),
                _ => grid.beside(cell as u32, code, at - 1).map_or(f64::INFINITY, height),
            });
            *shares = spread.shares(around);
            if has_receiver(code) && !shares.iter().any(|&share| share > 0.0) {
                shares[code::direction(code)] = 1.0;
            }
        }
        Ok(())
    })?;
    // How many neighbours each cell still waits for.
    let mut missing = vec![0_u8; grid.cells()];
    missing.par_chunks_mut(nx).enumerate().try_for_each(|(y, missing)| -> Result<(), NodeError> {
        job.check()?;
        for (x, missing) in missing.iter_mut().enumerate() {
            let cell = (y * nx + x) as u32;
            let gives = |&direction: &usize| {
                let donor = grid.beside(cell, codes[cell as usize], direction);
                donor.is_some_and(|donor| shares[donor as usize][opposite(direction)] > 0.0)
            };
            *missing = (0..8).filter(gives).count() as u8;
        }
        Ok(())
    })?;
    const VISITED: u8 = u8::MAX;
    let mut ready = Vec::new();
    for source in 0..missing.len() {
        if source.is_multiple_of(1 << 14) {
            job.check()?;
        }
        if missing[source] == 0 {
            ready.push(source as u32);
        }
        while let Some(cell) = ready.pop() {
            missing[cell as usize] = VISITED;
            let shares = &shares[cell as usize];
            let whole: f64 = shares.iter().map(|&share| f64::from(share)).sum();
            for (direction, &share) in shares.iter().enumerate().filter(|(_, share)| **share > 0.0) {
                if let Some(receiver) = grid.beside(cell, codes[cell as usize], direction) {
                    let receiver = receiver as usize;
                    amounts[receiver] += amounts[cell as usize] * (f64::from(share) / whole);
                    missing[receiver] -= 1;
                    if missing[receiver] == 0 {
                        ready.push(receiver as u32);
                    }
                }
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The heights of a plane that falls 0.3 in the direction of an angle, around a cell.
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
            let shares = d_infinity(plane(f64::from(degrees)));
            let across = f64::from(degrees % 90 - 45).abs();
            let (corner, side) = (degrees / 90 * 2 + 1, (degrees + 45) / 90 * 2 % 8);
            // 1e-6: shares are in f32.
            assert!((f64::from(shares[corner as usize]) - (1.0 - across / 45.0)).abs() < 1e-6, "{degrees}: {shares:?}");
            assert!((f64::from(shares[side as usize]) - across / 45.0).abs() < 1e-6, "{degrees}: {shares:?}");
        }
    }

    /// A case of Landlab's tests: the plane x + 2 y, with rows to the south.
    #[test]
    fn a_plane_of_whole_numbers_shares_as_others_say() {
        let around = std::array::from_fn(|at| match at {
            0 => 0.0,
            _ => f64::from(code::STEPS[at - 1].0 + 2 * code::STEPS[at - 1].1),
        });
        let shares = d_infinity(around);
        assert!((shares[2] - 0.409_665_53).abs() < 1e-7 && (shares[3] - 0.590_334_5).abs() < 1e-7, "{shares:?}");
    }

    /// A case of fastscapelib's tests: a peak where the squares of the diagonal slopes are twice the others.
    #[test]
    fn a_peak_is_shared_by_powers_of_slopes() {
        let diagonal = 2.0 * std::f64::consts::SQRT_2;
        let around = std::array::from_fn(|at| match at {
            0 => diagonal,
            _ if is_diagonal(at - 1) => 0.0,
            _ => std::f64::consts::SQRT_2,
        });
        for (exponent, side, corner) in [(0.0, 0.125, 0.125), (2.0, 1.0 / 12.0, 1.0 / 6.0)] {
            let shares = freeman(around, exponent);
            let whole: f32 = shares.iter().sum();
            for (direction, share) in shares.iter().enumerate() {
                let expected: f32 = if is_diagonal(direction) { corner } else { side };
                assert!((share / whole - expected).abs() < 1e-6, "{exponent}: {shares:?}");
            }
        }
    }
}
