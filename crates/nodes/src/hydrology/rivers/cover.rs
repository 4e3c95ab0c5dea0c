//! Fraction of each cell that rivers cover.

use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use orograph_graph::{Job, Lines, NodeError, Vertex};

use crate::numerics::{par, routing::Grid, segment::Cells};

/// Draws lines with their widths. A cell gets the fraction of its own width, across the line, that the river covers;
/// the maximum over several segments counts.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn draw(job: &Job<'_>, grid: &Grid, lines: &Lines) -> Result<Vec<f32>, NodeError> {
    // fractions are not negative, so that their bits have the same order, and the maximum does not depend on the order
    // of segments
    let cells: Vec<AtomicU32> = (0..grid.cells()).map(|_| AtomicU32::new(0)).collect();
    par::each(&lines.lines, |_, line| {
        for (at, pair) in line.vertices.windows(2).enumerate() {
            if at.is_multiple_of(256) {
                job.check()?;
            }
            piece(grid, job.cell_m(), &pair[0], &pair[1], |cell, share| {
                cells[cell].fetch_max(share.to_bits(), Relaxed);
            });
        }
        Ok::<_, NodeError>(())
    })?;
    Ok(cells.into_iter().map(|share| f32::from_bits(share.into_inner())).collect())
}

/// Calls `cover` with the cells that a segment of a line covers, and the fraction of each.
fn piece(grid: &Grid, cell_m: f64, from: &Vertex, to: &Vertex, cover: impl Fn(usize, f32)) {
    let cells = Cells {
        counts: [grid.nx as i64, grid.ny as i64],
        wraps: [grid.column_before(0).is_some(), grid.row_above(0).is_some()],
        cell_m,
    };
    let reach_m = 0.5 * (cell_m + from.width_m.max(to.width_m));
    cells.near([from.position_m, to.position_m], reach_m, |[i, j], distance_m, t| {
        let half_m = 0.5 * (from.width_m + (to.width_m - from.width_m) * t);
        let covered_m = (distance_m + 0.5 * cell_m).min(half_m) - (distance_m - 0.5 * cell_m).max(-half_m);
        if covered_m > 0.0 {
            cover((j * cells.counts[0] + i) as usize, (covered_m / cell_m).min(1.0) as f32);
        }
    });
}
