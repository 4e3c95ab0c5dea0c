//! Relaxation in time: the slopes that are stable after a given duration.

use orograph_graph::NodeError;

use super::Land;
use crate::{numerics::par, prelude::Job};

/// Returns the stable rises when the fraction `left` of all excess over repose remains: the present rises at 1, those
/// at repose at 0, and never less than repose.
///
/// The excess decays as `d|∇h|/dt = -k (|∇h| - S)₊`, so that `left = exp(-k t)`. Sliding to these rises gives the state
/// at that time: cliffs lean back, and debris that falls off them rests at repose.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn relaxed(land: &Land<'_>, left: f32, job: &Job<'_>) -> Result<Vec<f32>, NodeError> {
    let mut out = land.rise.to_vec();
    if left > 0.0 {
        let nx = land.cells[0];
        par::rows_within(job, [0.0, 0.0], &mut out, |j, row| {
            for (i, rise) in row.iter_mut().enumerate().filter(|(_, rise)| rise.is_finite()) {
                let excess = steepest(land, j * nx + i) - *rise;
                *rise += left * excess.max(0.0);
            }
        })?;
    }
    Ok(out)
}

/// Returns a position on an axis with those before and after it; clamped at a side that is not joined.
pub fn beside(at: usize, n: usize, wraps: bool) -> [usize; 3] {
    if wraps { [(at + n - 1) % n, at, (at + 1) % n] } else { [at.saturating_sub(1), at, (at + 1).min(n - 1)] }
}

/// Returns the steepest rise at a cell, over its faces and across its corners, in metres.
fn steepest(land: &Land<'_>, at: usize) -> f32 {
    let [nx, ny] = land.cells;
    let columns = beside(at % nx, nx, land.wraps[0]);
    let heights = beside(at / nx, ny, land.wraps[1]).map(|j| {
        columns.map(|i| {
            // closed cells mirror the cell itself
            let near = j * nx + i;
            land.height[if land.rise[near].is_finite() { near } else { at }]
        })
    });
    let mut most = 0.0_f32;
    for (north, south) in [(heights[0], heights[1]), (heights[1], heights[2])] {
        for i in 0..2 {
            let (x, xs) = (north[i + 1] - north[i], south[i + 1] - south[i]);
            let (y, ye) = (south[i] - north[i], south[i + 1] - north[i + 1]);
            let (gx, gy) = (0.5 * (x + xs), 0.5 * (y + ye));
            most = most.max((gx * gx + gy * gy).sqrt());
        }
    }
    for beside in [heights[0][1], heights[2][1], heights[1][0], heights[1][2]] {
        most = most.max((beside - heights[1][1]).abs());
    }
    most
}
