//! The exact Euclidean distance of every cell to the nearest cell of a set, in linear time.
//!
//! Two sweeps along columns, down and up; then, along rows, the lower envelope of one parabola per column, in integers
//! throughout (A. Meijster, J. Roerdink, W. Hesselink, 2000, A general algorithm for computing distance transforms in
//! linear time). Distances are between the centres of cells, also across the joined sides of a periodic world.

use orograph_graph::{Job, NodeError, Window, memory::filled};

use super::lines::Ends;
use crate::numerics::par;

/// Marks a distance beyond the limit.
pub const FAR: u32 = u32::MAX;

/// The largest limit in cells: the longest side of a world.
pub const MOST_CELLS: u32 = 65_535;

/// Columns swept at once.
const STRIP: usize = 64;

/// Returns the squared distance in cells of each cell of the job's window to the nearest one for which `set(index)` is
/// true, or [`FAR`] if that is more than `limit_cells` away, at most [`MOST_CELLS`]. `share` is the part of the job's
/// progress.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn squared(
    job: &Job<'_>,
    share: [f32; 2],
    limit_cells: u32,
    set: impl Fn(usize) -> bool + Sync,
) -> Result<Vec<u32>, NodeError> {
    let window = job.window();
    let limit = limit_cells.min(MOST_CELLS);
    let nx = window.nx();
    let mut out = filled(window.len(), FAR)?;
    par::each(out.chunks_mut(nx), |j, row| {
        row.iter_mut().enumerate().for_each(|(i, cell)| *cell = if set(j * nx + i) { 0 } else { FAR });
        job.check()
    })?;
    columns(job, &window, &mut out)?;
    job.advance(0.5 * (share[0] + share[1]))?;
    let wrap = Ends::of(&window, 0) == Ends::Wrap;
    par::each_with(out.chunks_mut(nx), Envelope::default, |envelope, _, row| {
        job.check()?;
        envelope.row(row, limit, wrap);
        Ok::<_, NodeError>(())
    })?;
    job.advance(share[1])?;
    Ok(out)
}

/// Returns the reach in cells for a limit in metres.
#[must_use]
pub fn cells(limit_m: f64, cell_m: f64) -> u32 {
    (limit_m / cell_m).ceil().clamp(0.0, f64::from(MOST_CELLS)) as u32
}

/// Replaces zeros and [`FAR`] by distances in cells along the column.
fn columns(job: &Job<'_>, window: &Window, cells: &mut [u32]) -> Result<(), NodeError> {
    let (nx, ny) = (window.nx(), window.ny());
    let wrap = Ends::of(window, 1) == Ends::Wrap;
    let mut strips: Vec<Vec<&mut [u32]>> = (0..nx.div_ceil(STRIP)).map(|_| Vec::with_capacity(ny)).collect();
    for row in cells.chunks_mut(nx) {
        strips.iter_mut().zip(row.chunks_mut(STRIP)).for_each(|(strip, cells)| strip.push(cells));
    }
    par::each(&mut strips, |_, rows| {
        job.check()?;
        // in a periodic world, a second round starts with the distances at the end of the first
        let mut before = [FAR; STRIP];
        for _ in 0..=usize::from(wrap) {
            rows.iter_mut().for_each(|row| step(row, &mut before));
        }
        let mut before = [FAR; STRIP];
        for _ in 0..=usize::from(wrap) {
            rows.iter_mut().rev().for_each(|row| step(row, &mut before));
        }
        Ok(())
    })
}

/// One row of a sweep: the distance is at most that of the previous row plus one.
fn step(row: &mut [u32], before: &mut [u32; STRIP]) {
    for (cell, before) in row.iter_mut().zip(before) {
        *cell = (*cell).min(before.saturating_add(1));
        *before = *cell;
    }
}

/// The lower envelope of parabolas along a row.
#[derive(Default)]
struct Envelope {
    /// Position of each parabola's vertex, and its height there.
    vertices: Vec<(i64, i64)>,
    /// The last position at which the previous parabola is not above it.
    begins: Vec<i64>,
}

impl Envelope {
    /// Replaces distances along the columns by squared distances in the plane.
    fn row(&mut self, row: &mut [u32], limit: u32, wrap: bool) {
        let n = row.len() as i64;
        self.vertices.clear();
        self.begins.clear();
        let beyond = if wrap { i64::from(limit).min(n / 2 + 1) } else { 0 };
        for place in -beyond..n + beyond {
            let distance = row[place.rem_euclid(n) as usize];
            if distance <= limit {
                self.add(place, i64::from(distance) * i64::from(distance));
            }
        }
        let most = i64::from(limit) * i64::from(limit);
        let mut at = 0;
        for (place, cell) in (0..n).zip(row) {
            while at + 1 < self.begins.len() && self.begins[at + 1] < place {
                at += 1;
            }
            let nearest = self.vertices.get(at).map(|&(vertex, height)| (place - vertex) * (place - vertex) + height);
            *cell = nearest.filter(|squared| *squared <= most).map_or(FAR, |squared| squared as u32);
        }
    }

    fn add(&mut self, place: i64, height: i64) {
        while let Some(&(vertex, low)) = self.vertices.last() {
            let begins = (place * place - vertex * vertex + height - low).div_euclid(2 * (place - vertex));
            if begins > *self.begins.last().unwrap_or(&i64::MIN) {
                self.vertices.push((place, height));
                self.begins.push(begins);
                return;
            }
            self.vertices.pop();
            self.begins.pop();
        }
        self.vertices.push((place, height));
        self.begins.push(i64::MIN);
    }
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Boundary, Edge, World, mix};

    use super::*;
    use crate::testing::{with_job, world};

    /// Reference: every pair of cells.
    fn brute_force(window: &Window, set: &[bool], limit: u32) -> Vec<u32> {
        let (nx, ny) = (window.nx() as i64, window.ny() as i64);
        let periodic = window.world.boundary.west == Edge::Periodic;
        let apart = |a: i64, b: i64, n: i64| {
            let d = (a - b).abs();
            if periodic { d.min(n - d) } else { d }
        };
        let nearest = |at: i64| {
            let all = set.iter().enumerate().filter(|(_, set)| **set).map(|(other, _)| {
                let (dx, dy) = (apart(at % nx, other as i64 % nx, nx), apart(at / nx, other as i64 / nx, ny));
                (dx * dx + dy * dy) as u32
            });
            all.min().filter(|squared| *squared <= limit * limit).unwrap_or(FAR)
        };
        (0..nx * ny).map(nearest).collect()
    }

    #[test]
    fn distances_are_those_of_every_pair() {
        for (nx, ny) in [(64, 64), (1, 40), (53, 1), (7, 31)] {
            for (edge, share, limit) in [
                (Edge::Base, 50, 200),
                (Edge::Base, 7, 5),
                (Edge::Periodic, 900, 200),
                (Edge::Periodic, 300, 9),
                (Edge::Wall, 1, 200),
            ] {
                let window = Window::whole(World { boundary: Boundary::all(edge), ..world(nx, ny, 1.0) });
                let set: Vec<bool> = (0..nx * ny).map(|at| mix(at + share).is_multiple_of(share)).collect();
                let found = with_job(window, |job| squared(job, [0.0, 1.0], limit, |at| set[at])).expect("a result");
                assert_eq!(found, brute_force(&window, &set, limit), "{nx} x {ny} {edge:?} {share} {limit}");
            }
        }
    }
}
