//! Connected components of a selection.
//!
//! Rows are divided into runs of selected cells. Runs that touch are joined in a disjoint-set forest whose roots are
//! the first runs (A. Rosenfeld and J. L. Pfaltz, 1966, Sequential operations in digital picture processing). One pass
//! over cells and one over runs, always in the same order.

use orograph_graph::{Job, NodeError, memory::zeroed};

use super::lines::Ends;

/// The connected components of a selection.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Components {
    /// The component of each cell, 0 where nothing is selected. Components are numbered from 1 by their first cells,
    /// row by row from the north-west.
    pub of: Vec<u32>,
    /// Number of cells of each component; component 1 is at position 0.
    pub cells: Vec<u32>,
}

/// A run of selected cells in a row: the row, its first column, and the column after its last.
#[derive(Clone, Copy, Debug)]
struct Run {
    row: usize,
    start: usize,
    end: usize,
}

/// Returns the components of the cells of the job's window for which `set(index)` is true. Cells that share an edge
/// are connected, with `corners` also those that share a corner; in a periodic world across its joined sides too.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn components(job: &Job<'_>, corners: bool, set: impl Fn(usize) -> bool) -> Result<Components, NodeError> {
    let window = job.window();
    let (nx, ny) = (window.nx(), window.ny());
    let wrap = [0, 1].map(|axis| Ends::of(&window, axis) == Ends::Wrap);
    let mut runs: Vec<Run> = Vec::new();
    // index of the first run of each row
    let mut rows = vec![0];
    for row in 0..ny {
        job.check()?;
        let mut column = 0;
        while column < nx {
            if !set(row * nx + column) {
                column += 1;
                continue;
            }
            let start = column;
            while column < nx && set(row * nx + column) {
                column += 1;
            }
            runs.push(Run { row, start, end: column });
        }
        rows.push(runs.len());
    }

    let mut above: Vec<u32> = (0..runs.len() as u32).collect();
    for row in 0..ny {
        job.check()?;
        let these = rows[row]..rows[row + 1];
        if wrap[0] && !these.is_empty() && runs[these.start].start == 0 && runs[these.end - 1].end == nx {
            join(&mut above, these.start, these.end - 1);
        }
        if row > 0 || wrap[1] {
            let before = (row + ny - 1) % ny;
            touch(&runs, rows[before]..rows[before + 1], these, corners, wrap[0].then_some(nx), &mut above);
        }
    }

    let mut found = Components { of: zeroed(nx * ny)?, cells: Vec::new() };
    let mut numbers = vec![0; runs.len()];
    for (at, run) in runs.iter().enumerate() {
        let root = root(&mut above, at as u32) as usize;
        if root == at {
            found.cells.push(0);
            numbers[at] = found.cells.len() as u32;
        }
        numbers[at] = numbers[root];
        found.cells[numbers[at] as usize - 1] += (run.end - run.start) as u32;
        found.of[run.row * nx..][run.start..run.end].fill(numbers[at]);
    }
    job.check()?;
    Ok(found)
}

/// Joins the touching runs of two rows. `around` is the length of a row whose ends are joined.
fn touch(
    runs: &[Run],
    before: std::ops::Range<usize>,
    these: std::ops::Range<usize>,
    corners: bool,
    around: Option<usize>,
    above: &mut [u32],
) {
    let reach = usize::from(corners);
    let mut first = before.start;
    for this in these.clone() {
        let Run { start, end, .. } = runs[this];
        while first < before.end && runs[first].end + reach <= start {
            first += 1;
        }
        let touching = (first..before.end).take_while(|other| runs[*other].start < end + reach);
        touching.for_each(|other| join(above, this, other));
    }
    if let Some(nx) = around.filter(|_| corners && !before.is_empty() && !these.is_empty()) {
        for [west, east] in [[before.start, these.end - 1], [these.start, before.end - 1]] {
            if runs[west].start == 0 && runs[east].end == nx {
                join(above, west, east);
            }
        }
    }
}

fn join(above: &mut [u32], a: usize, b: usize) {
    let [a, b] = [a, b].map(|run| root(above, run as u32));
    above[a.max(b) as usize] = a.min(b);
}

/// Returns the first run of a tree, with path halving.
fn root(above: &mut [u32], mut run: u32) -> u32 {
    while above[run as usize] != run {
        let next = above[above[run as usize] as usize];
        above[run as usize] = next;
        run = next;
    }
    run
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Boundary, Edge, Window, World, mix};

    use super::*;
    use crate::testing::{with_job, world};

    /// Reference: a flood fill from each cell in turn.
    fn flooded(window: &Window, set: &[bool], corners: bool) -> Components {
        let (nx, ny) = (window.nx() as i64, window.ny() as i64);
        let wrap = window.world.boundary.west == Edge::Periodic;
        let mut found = Components { of: vec![0; set.len()], cells: Vec::new() };
        for first in 0..set.len() {
            if !set[first] || found.of[first] > 0 {
                continue;
            }
            found.cells.push(0);
            let number = found.cells.len() as u32;
            let mut open = vec![first as i64];
            found.of[first] = number;
            while let Some(cell) = open.pop() {
                found.cells[number as usize - 1] += 1;
                for (dx, dy) in (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (dx, dy))) {
                    let (mut x, mut y) = (cell % nx + dx, cell / nx + dy);
                    if wrap {
                        (x, y) = (x.rem_euclid(nx), y.rem_euclid(ny));
                    }
                    let inside = (0..nx).contains(&x) && (0..ny).contains(&y);
                    if inside && (corners || dx * dy == 0) {
                        let next = (y * nx + x) as usize;
                        if set[next] && found.of[next] == 0 {
                            found.of[next] = number;
                            open.push(next as i64);
                        }
                    }
                }
            }
        }
        found
    }

    #[test]
    fn components_are_those_of_a_flood() {
        for (nx, ny) in [(40, 30), (1, 40), (53, 1), (2, 9), (9, 2)] {
            for (edge, share) in
                [(Edge::Base, 2), (Edge::Base, 3), (Edge::Periodic, 2), (Edge::Periodic, 4), (Edge::Wall, 1)]
            {
                let window = Window::whole(World { boundary: Boundary::all(edge), ..world(nx, ny, 1.0) });
                let set: Vec<bool> = (0..nx * ny).map(|at| mix(at + share).is_multiple_of(share)).collect();
                for corners in [false, true] {
                    let found = with_job(window, |job| components(job, corners, |at| set[at])).expect("a result");
                    assert_eq!(found, flooded(&window, &set, corners), "{nx} x {ny} {edge:?} {share} {corners}");
                }
            }
        }
    }
}
