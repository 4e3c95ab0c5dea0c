//! Separable filters: a function on lines of cells, applied along x and then along y.
//!
//! Lines are processed [`LANES`] at a time, so that a loop along them is a loop over vectors. Each is extended beyond
//! its ends: mirrored at the edge of its last cell, or wrapped in a periodic world. Where a window is a part of the
//! world the extension is arbitrary, and the halo absorbs its effect.

use orograph_graph::{Boundary, Edge, memory::copied};

use crate::numerics::par;
use crate::prelude::*;

/// Lines that are filtered at once.
pub const LANES: usize = 16;

/// One value of each line.
pub type Lanes = [f64; LANES];

/// Extension of lines beyond their ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ends {
    /// The same cells in reverse order: zero gradient across the edge.
    Mirror,
    /// The other end of the line: periodic.
    Wrap,
}

impl Ends {
    /// Returns the extension of a window's lines along x (0) or y (1).
    #[must_use]
    pub fn of(window: &Window, axis: usize) -> Self {
        let Boundary { west, east, north, south } = window.world.boundary;
        let periodic = [[west, east], [north, south]][axis].contains(&Edge::Periodic);
        if periodic && window.cells[axis] == window.world.cells[axis] { Self::Wrap } else { Self::Mirror }
    }

    /// Returns the cell of a line of `n` cells for the place `at`, which may be beyond its ends.
    #[must_use]
    pub fn index(self, at: i64, n: usize) -> usize {
        let n = n as i64;
        if (0..n).contains(&at) {
            return at as usize;
        }
        let inside = match self {
            Self::Wrap => at.rem_euclid(n),
            Self::Mirror => {
                let at = at.rem_euclid(2 * n);
                if at < n { at } else { 2 * n - 1 - at }
            }
        };
        inside as usize
    }

    /// Returns the number of cells after which a line of `n` cells repeats: there and back if it is mirrored.
    #[must_use]
    pub const fn period(self, n: usize) -> usize {
        match self {
            Self::Wrap => n,
            Self::Mirror => 2 * n,
        }
    }
}

/// A filter on lines. `scratch` may be reused between calls.
pub trait LineFilter: Sync {
    /// Returns the number of cells that it reads beyond a cell on either side.
    fn reach(&self) -> usize;

    /// Filters lines in place. `lines` has their cells and [`Self::reach`] more at either end; the result is left at
    /// its beginning. `first` is the position in the world of the first of `lines`, negative before the world's edge.
    fn apply(&self, lines: &mut [Lanes], scratch: &mut Vec<Lanes>, first: i64);

    /// Returns true if it is wider than a line of that many cells. Then [`Self::apply_to_period`] is called, and lines
    /// need no room for the reach, which is without bound.
    fn exceeds(&self, cells: usize) -> bool;

    /// Filters lines that repeat for ever in place. `period` has their cells before they repeat.
    fn apply_to_period(&self, period: &mut [Lanes], scratch: &mut Vec<Lanes>);
}

/// Filters lines of `n` cells in place. `lines` has room for them; `fill` writes them, and the result is left at the
/// beginning of `lines`. `world` is the number of cells of the world along the lines, and `first` the place of their
/// first cell in it.
fn filtered(
    [lines, scratch]: [&mut Vec<Lanes>; 2],
    filter: &impl LineFilter,
    ends: Ends,
    [n, world, first]: [usize; 3],
    fill: impl FnOnce(&mut [Lanes]),
) {
    lines.clear();
    if filter.exceeds(world) {
        // the window is as long as the world here: the filter reads all of it
        lines.resize(ends.period(n), [0.0; LANES]);
        fill(lines);
        for at in n..lines.len() {
            lines[at] = lines[ends.index(at as i64, n)];
        }
        filter.apply_to_period(lines, scratch);
        return;
    }
    let reach = filter.reach();
    lines.resize(n + 2 * reach, [0.0; LANES]);
    fill(&mut lines[reach..]);
    go_on(lines, reach, ends);
    filter.apply(lines, scratch, first as i64 - reach as i64);
}

/// Filters the samples of a window along both axes. `share` is the start and end of this part of the job's progress.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn separable(
    job: &Job<'_>,
    share: [f32; 2],
    samples: &[f32],
    filter: &impl LineFilter,
) -> Result<Vec<f32>, NodeError> {
    let window = job.window();
    let mut out = copied(samples)?;
    along_x(job, &window, &mut out, filter)?;
    job.advance(0.5 * (share[0] + share[1]))?;
    along_y(job, &window, &mut out, filter)?;
    job.advance(share[1])?;
    Ok(out)
}

fn along_x(job: &Job<'_>, window: &Window, samples: &mut [f32], filter: &impl LineFilter) -> Result<(), NodeError> {
    let nx = window.nx();
    let (ends, place) = (Ends::of(window, 0), [nx, window.world.cells[0] as usize, window.origin[0] as usize]);
    par::each_with(
        samples.chunks_mut(nx * LANES),
        || (Vec::new(), Vec::new()),
        |(lines, scratch), _, rows| {
            job.check()?;
            filtered([lines, scratch], filter, ends, place, |lines| into_lanes(rows, nx, lines));
            out_of_lanes(lines, rows, nx);
            Ok(())
        },
    )
}

/// Cells of a line that are transposed at once: few enough for the first-level cache.
const TILE: usize = 64;

/// Interleaves up to [`LANES`] rows of `nx` cells.
fn into_lanes(rows: &[f32], nx: usize, lines: &mut [Lanes]) {
    for start in (0..nx).step_by(TILE) {
        let cells = &mut lines[start..(start + TILE).min(nx)];
        for (lane, row) in rows.chunks(nx).enumerate() {
            for (cell, &sample) in cells.iter_mut().zip(&row[start..]) {
                cell[lane] = f64::from(sample);
            }
        }
    }
}

/// The inverse of [`into_lanes`].
fn out_of_lanes(lines: &[Lanes], rows: &mut [f32], nx: usize) {
    for start in (0..nx).step_by(TILE) {
        let cells = &lines[start..(start + TILE).min(nx)];
        for (lane, row) in rows.chunks_mut(nx).enumerate() {
            for (sample, cell) in row[start..].iter_mut().zip(cells) {
                *sample = cell[lane] as f32;
            }
        }
    }
}

fn along_y(job: &Job<'_>, window: &Window, samples: &mut [f32], filter: &impl LineFilter) -> Result<(), NodeError> {
    let (nx, ny) = (window.nx(), window.ny());
    let (ends, place) = (Ends::of(window, 1), [ny, window.world.cells[1] as usize, window.origin[1] as usize]);
    // each task has its own columns of every row
    let mut columns: Vec<Vec<&mut [f32]>> = (0..nx.div_ceil(LANES)).map(|_| Vec::with_capacity(ny)).collect();
    for row in samples.chunks_mut(nx) {
        for (strip, cells) in columns.iter_mut().zip(row.chunks_mut(LANES)) {
            strip.push(cells);
        }
    }
    par::each_with(
        &mut columns,
        || (Vec::new(), Vec::new()),
        |(lines, scratch), _, strip| {
            job.check()?;
            filtered([lines, scratch], filter, ends, place, |lines| {
                for (cell, row) in lines.iter_mut().zip(strip.iter()) {
                    for (value, &sample) in cell.iter_mut().zip(row.iter()) {
                        *value = f64::from(sample);
                    }
                }
            });
            for (row, cell) in strip.iter_mut().zip(lines.iter()) {
                for (sample, &value) in row.iter_mut().zip(cell) {
                    *sample = value as f32;
                }
            }
            Ok(())
        },
    )
}

/// Fills the places beyond both ends of lines.
fn go_on(lines: &mut [Lanes], reach: usize, ends: Ends) {
    let n = lines.len() - 2 * reach;
    for k in 1..=reach {
        lines[reach - k] = lines[reach + ends.index(-(k as i64), n)];
        lines[reach + n - 1 + k] = lines[reach + ends.index((n - 1 + k) as i64, n)];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_go_on_as_their_ends_say() {
        let line = |ends: Ends| (-5..8).map(|at| ends.index(at, 3)).collect::<Vec<_>>();
        assert_eq!(line(Ends::Mirror), [1, 2, 2, 1, 0, 0, 1, 2, 2, 1, 0, 0, 1]);
        assert_eq!(line(Ends::Wrap), [1, 2, 0, 1, 2, 0, 1, 2, 0, 1, 2, 0, 1]);
        assert_eq!(Ends::Mirror.index(-7, 1), 0);
    }
}
