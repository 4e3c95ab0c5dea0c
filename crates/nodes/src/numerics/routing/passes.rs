//! Passes between basins.
//!
//! A pass is a link between two cells of different basins; its height is that of the higher cell. Only the lowest pass
//! between two basins matters. Most links are excluded by a local test: a cell adjacent to both ends belongs to one of
//! the two basins and has a lower link to the other. The remaining links are local minima along the divides, a small
//! fraction of all, which the spanning tree takes as they are.

use orograph_graph::{Job, NodeError};

use super::{Elevation, Grid, Outlet, basins::OUTSIDE};
use crate::numerics::{par, simd::simd};

/// Directions of the links that a cell numbers; the other four belong to its neighbours.
pub const FORWARD: [usize; 4] = [0, 5, 6, 7];
/// Number of the link out of the world from a cell on an open side, after those of [`FORWARD`].
pub const LEAVES: u32 = 4;

/// A pass between two basins.
#[derive(Clone, Copy, Debug)]
pub struct Edge<P> {
    /// Labels of the two basins.
    pub basins: [u32; 2],
    /// Height and number of the link.
    pub pass: P,
}

/// Computes, for the inner cells of a row, the set of [`FORWARD`] links that may be lowest passes. `heights` and
/// `labels` are those of the rows above, here and below.
macro_rules! passes_body {
    ($float:ty, $int:ty, $heights:ident, $labels:ident, $links:ident) => {{
        let len = $links.len();
        let [[_, n, ne], [w, here, e], [sw, s, se]] =
            $heights.map(|row| [&row[..len], &row[1..1 + len], &row[2..2 + len]]);
        let [[_, n_label, ne_label], [w_label, label, e_label], [sw_label, s_label, se_label]] =
            $labels.map(|row| [&row[..len], &row[1..1 + len], &row[2..2 + len]]);
        for x in 0..len {
            let (height, label) = (here[x], label[x] as $int);
            let [n, ne, w] = [(n[x], n_label[x] as $int), (ne[x], ne_label[x] as $int), (w[x], w_label[x] as $int)];
            let [e, sw] = [(e[x], e_label[x] as $int), (sw[x], sw_label[x] as $int)];
            let [s, se] = [(s[x], s_label[x] as $int), (se[x], se_label[x] as $int)];
            // returns true if a third cell makes the link redundant; never for NaN heights
            let lower = |other: ($float, $int), third: ($float, $int)| {
                let pass = if height > other.0 { height } else { other.0 };
                let from_here = if height > third.0 { height } else { third.0 };
                let from_other = if other.0 > third.0 { other.0 } else { third.0 };
                (third.1 == label) & (from_other < pass) | (third.1 == other.1) & (from_here < pass)
            };
            let link = |bit: $int, other: ($float, $int), superfluous: bool| {
                if (other.1 != label) & !superfluous { bit } else { 0 }
            };
            $links[x] = (link(1, e, lower(e, n) | lower(e, ne) | lower(e, s) | lower(e, se))
                | link(2, sw, lower(sw, w) | lower(sw, s))
                | link(4, s, lower(s, w) | lower(s, sw) | lower(s, e) | lower(s, se))
                | link(8, se, lower(se, e) | lower(se, s))) as u8;
        }
    }};
}

simd! {
    /// A row of passes in single precision.
    pub(super) fn passes_row_single(heights: [&[f32]; 3], labels: [&[u32]; 3], links: &mut [u8]) {
        passes_body!(f32, u32, heights, labels, links)
    }
}

simd! {
    /// A row of passes in double precision.
    pub(super) fn passes_row_double(heights: [&[f64]; 3], labels: [&[u32]; 3], links: &mut [u8]) {
        passes_body!(f64, u64, heights, labels, links)
    }
}

/// Finds passes between basins, row by row, which include the lowest of each two adjacent basins.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn find<T: Elevation>(
    job: &Job<'_>,
    grid: &Grid,
    heights: &[T],
    labels: &[u32],
) -> Result<Vec<Edge<T::Pass>>, NodeError> {
    let nx = grid.nx;
    let rows = par::collect_with(
        0..grid.ny,
        || vec![0_u8; nx],
        |links, _, y| {
            job.check()?;
            let here = y * nx;
            let [above, below] = [grid.row_above(y), grid.row_below(y)].map(|y| y.map_or(here, |y| y * nx));
            let basin = |first: usize| labels[first..first + nx].iter().any(|&label| label != OUTSIDE);
            let mut edges = Vec::new();
            if !basin(here) && !basin(below) {
                return Ok(edges);
            }
            // only links to the east if there is no row below; all links at the sides
            let exist = if grid.row_below(y).is_some() { 0b1111 } else { 0b0001 };
            if nx > 2 {
                let around = [above, here, below];
                let (heights, labels) =
                    (around.map(|row| &heights[row..row + nx]), around.map(|row| &labels[row..row + nx]));
                T::passes_row(heights, labels, &mut links[1..nx - 1]);
            }
            links[0] = 0b1111;
            links[nx - 1] = 0b1111;
            for (x, links) in links.iter().enumerate() {
                let mut links = links & exist;
                let cell = (here + x) as u32;
                while links != 0 {
                    let number = links.trailing_zeros();
                    links &= links - 1;
                    let direction = FORWARD[number as usize];
                    let side = x == 0 || x + 1 == nx || grid.is_border_row(y);
                    let other = if side {
                        grid.neighbour(cell, direction)
                    } else {
                        Some(grid.inner_neighbour(cell, direction))
                    };
                    let Some(other) = other else { continue };
                    let basins = [labels[cell as usize], labels[other as usize]];
                    if basins[0] != basins[1] {
                        let pass = heights[cell as usize].pass(heights[other as usize], cell << 3 | number);
                        edges.push(Edge { basins, pass });
                    }
                }
            }
            if grid.has_open_side() {
                let all = grid.is_border_row(y);
                for x in (0..nx).filter(|&x| all || x == 0 || x + 1 == nx) {
                    let cell = here + x;
                    if labels[cell] != OUTSIDE && grid.outlet(x, y) == Outlet::Open {
                        let pass = heights[cell].pass(heights[cell], (cell as u32) << 3 | LEAVES);
                        edges.push(Edge { basins: [labels[cell], OUTSIDE], pass });
                    }
                }
            }
            Ok::<_, NodeError>(edges)
        },
    )?;
    Ok(rows.concat())
}
