//! Fraction of each cell that lines cover.

use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use orograph_graph::{Edge, Job, Lines, NodeError, Vertex, Window};

use super::{par, segment::Cells};

/// Draws lines with their widths. A cell gets the fraction of its own width, across the line, that the line covers;
/// the maximum over several segments counts. In a window, the result equals that part of the whole world.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn draw(job: &Job<'_>, lines: &Lines) -> Result<Vec<f32>, NodeError> {
    let window = job.window();
    // fractions are not negative, so that their bits have the same order, and the maximum does not depend on the order
    // of segments
    let cells: Vec<AtomicU32> = (0..window.len()).map(|_| AtomicU32::new(0)).collect();
    let within = Within::new(&window);
    par::each(&lines.lines, |_, line| {
        for (at, pair) in line.vertices.windows(2).enumerate() {
            if at.is_multiple_of(256) {
                job.check()?;
            }
            within.cover(&pair[0], &pair[1], |cell, share| {
                cells[cell].fetch_max(share.to_bits(), Relaxed);
            });
        }
        Ok::<_, NodeError>(())
    })?;
    Ok(cells.into_iter().map(|share| f32::from_bits(share.into_inner())).collect())
}

/// The cells of the world, and the window of those that are drawn.
struct Within {
    world: Cells,
    first: [i64; 2],
    counts: [i64; 2],
}

impl Within {
    fn new(window: &Window) -> Self {
        let sides = window.world.boundary;
        let wraps = [[sides.west, sides.east], [sides.north, sides.south]].map(|pair| pair.contains(&Edge::Periodic));
        let world = Cells { counts: window.world.cells.map(i64::from), wraps, cell_m: window.cell_m() };
        Self { world, first: window.origin.map(i64::from), counts: window.cells.map(i64::from) }
    }

    /// Calls `cover` with the cells of the window that a segment of a line covers, and the fraction of each.
    fn cover(&self, from: &Vertex, to: &Vertex, cover: impl Fn(usize, f32)) {
        let cell_m = self.world.cell_m;
        let reach_m = 0.5 * (cell_m + from.width_m.max(to.width_m));
        self.world.near([from.position_m, to.position_m], reach_m, |at, distance_m, t| {
            let [i, j] = [0, 1].map(|axis| at[axis] - self.first[axis]);
            if i < 0 || j < 0 || i >= self.counts[0] || j >= self.counts[1] {
                return;
            }
            let half_m = 0.5 * (from.width_m + (to.width_m - from.width_m) * t);
            let covered_m = (distance_m + 0.5 * cell_m).min(half_m) - (distance_m - 0.5 * cell_m).max(-half_m);
            if covered_m > 0.0 {
                cover((j * self.counts[0] + i) as usize, (covered_m / cell_m).min(1.0) as f32);
            }
        });
    }
}
