//! One receiver per cell.
//!
//! - [`d8`]: the neighbour of steepest descent (O'Callaghan and Mark 1984). Ties are resolved in the order E, NE, N,
//!   NW, W, SW, S, SE.
//! - [`rho_infinity`]: one of the two neighbours that bound the steepest of the eight triangular facets around the cell
//!   (Tarboton 1997), drawn at random so that the expected direction is that of the facet. There is one receiver per
//!   cell, as implicit solvers need, without the preference of D8 for multiples of 45°. It combines the random choice
//!   of Fairfield and Leymarie (1991) with Tarboton's facets.

use orograph_graph::{Job, NodeError, mix};

use super::{
    Elevation, Grid, Outlet,
    code::{BORDER, OUTLET, PIT, is_diagonal},
};
use crate::numerics::{par, simd::simd};

/// Steepest descent for a row: `around` is the cell itself, then its neighbours in the order of the codes.
macro_rules! d8_body {
    ($float:ty, $int:ty, $around:ident, $codes:ident) => {{
        let len = $codes.len();
        let [centre, e, ne, n, nw, w, sw, s, se] = $around.map(|row| &row[..len]);
        for x in 0..len {
            let mut steepest: $float = 0.0;
            let mut code = PIT as $int;
            let mut consider = |height: $float, per_distance: $float, direction: $int| {
                let slope = (centre[x] - height) * per_distance;
                let steeper = slope > steepest;
                steepest = if steeper { slope } else { steepest };
                code = if steeper { direction } else { code };
            };
            const DIAGONAL: $float = std::f64::consts::FRAC_1_SQRT_2 as $float;
            consider(e[x], 1.0, 0);
            consider(ne[x], DIAGONAL, 1);
            consider(n[x], 1.0, 2);
            consider(nw[x], DIAGONAL, 3);
            consider(w[x], 1.0, 4);
            consider(sw[x], DIAGONAL, 5);
            consider(s[x], 1.0, 6);
            consider(se[x], DIAGONAL, 7);
            $codes[x] = code as u8;
        }
    }};
}

simd! {
    /// A row of steepest descents in single precision.
    pub(super) fn d8_row_single(around: [&[f32]; 9], codes: &mut [u8]) {
        d8_body!(f32, u32, around, codes)
    }
}

simd! {
    /// A row of steepest descents in double precision.
    pub(super) fn d8_row_double(around: [&[f64]; 9], codes: &mut [u8]) {
        d8_body!(f64, u64, around, codes)
    }
}

/// Fills `codes` with the receivers of steepest descent and marks outlets and pits.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn d8<T: Elevation>(job: &Job<'_>, grid: &Grid, heights: &[T], codes: &mut [u8]) -> Result<(), NodeError> {
    let out = codes.chunks_mut(grid.nx).map(|codes| (codes, &mut [][..]));
    rows(
        job,
        grid,
        heights,
        out,
        |_, around, codes, _| T::d8_row(around, codes),
        |_, around| {
            let mut steepest = 0.0;
            let mut code = PIT;
            for (direction, height) in around[1..].iter().enumerate() {
                let per_distance = if is_diagonal(direction) { std::f64::consts::FRAC_1_SQRT_2 } else { 1.0 };
                let slope = around[0].slope(*height, per_distance);
                if slope > steepest {
                    steepest = slope;
                    code = direction as u8;
                }
            }
            (code, 0)
        },
    )
}

/// Makes every cell below sea level an outlet.
pub fn end_at_sea(heights: &[f32], sea_level_m: f64, codes: &mut [u8]) {
    par::change_with(codes, heights, |code, &height| {
        if f64::from(height) < sea_level_m {
            *code = *code & BORDER | OUTLET;
        }
    });
}

/// Makes every cell without data an outlet, and lets water out of the cells beside them as at an open side: where no
/// neighbour is lower.
pub fn end_at_voids(grid: &Grid, is_void: impl Fn(usize) -> bool + Sync, codes: &mut [u8]) {
    par::all(codes.chunks_mut(grid.nx), |y, codes| {
        for (x, code) in codes.iter_mut().enumerate() {
            let cell = y * grid.nx + x;
            let beside = |way| grid.beside(cell as u32, *code, way).is_some_and(|beside| is_void(beside as usize));
            if is_void(cell) || *code & PIT != 0 && (0..8).any(beside) {
                *code = *code & BORDER | OUTLET;
            }
        }
    });
}

/// Fills `codes` with receivers drawn at random from the two neighbours that bound the steepest facet. `seed` selects
/// the draw; use a different one in every step.
///
/// `tangents` receives the direction of steepest descent on that facet: the tangent of its angle from the neighbour
/// across a side, 0 to 1, in units of 1 / 255. See [`length`].
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn rho_infinity(
    job: &Job<'_>,
    grid: &Grid,
    heights: &[f64],
    codes: &mut [u8],
    tangents: &mut [u8],
    seed: u32,
) -> Result<(), NodeError> {
    let row = |first: u32, around: [&[f64]; 9], codes: &mut [u8], tangents: &mut [u8]| {
        rho_row(around, first, seed, codes, tangents);
    };
    let single = |cell: u32, around: [f64; 9]| {
        let (mut code, mut tangent) = ([PIT], [0]);
        rho_row(std::array::from_fn(|at| &around[at..=at]), cell, seed, &mut code, &mut tangent);
        (code[0], tangent[0])
    };
    let out = codes.chunks_mut(grid.nx).zip(tangents.chunks_mut(grid.nx));
    rows(job, grid, heights, out, row, single)
}

/// Returns the length of a link projected on the direction of steepest descent, in cells, from a tangent of
/// [`rho_infinity`].
///
/// A plane of gradient S that falls at an angle to the link drops by S times this length along it. Slope-dependent laws
/// that use it instead of the distance are isotropic; with the distance, slopes would be regular octagons.
#[must_use]
pub fn length(diagonal: bool, tangent: u8) -> f64 {
    let tangent = f64::from(tangent) / 255.0;
    let cosine = 1.0 / (1.0 + tangent * tangent).sqrt();
    if diagonal { cosine * (1.0 + tangent) } else { cosine }
}

simd! {
    fn rho_row(around: [&[f64]; 9], first: u32, seed: u32, codes: &mut [u8], tangents: &mut [u8]) {
        let len = codes.len();
        let tangents = &mut tangents[..len];
        let [centre, e, ne, n, nw, w, sw, s, se] = around.map(|row| &row[..len]);
        for x in 0..len {
            let here = centre[x];
            // for the steepest facet: the square of its slope, the drops along its two legs and along its diagonal, its two
            // neighbours; a leg is as long as a cell, and the first leads to the neighbour across a side
            let mut steepest = 0.0_f64;
            let (mut leg_1, mut leg_2, mut diagonal) = (1.0_f64, 0.0_f64, 0.0_f64);
            let (mut beside, mut across) = (PIT as u64, PIT as u64);
            // of the two facets beside a side, the one with the lower corner is the steeper
            let mut facets = |side: f64, corners: [f64; 2], side_code: u64, corner_codes: [u64; 2]| {
                let second = corners[1] < corners[0];
                let corner = if second { corners[1] } else { corners[0] };
                let corner_code = if second { corner_codes[1] } else { corner_codes[0] };
                let (drop_1, drop_2, drop) = (here - side, side - corner, here - corner);
                let square = if drop_2 <= 0.0 {
                    if drop_1 > 0.0 { drop_1 * drop_1 } else { 0.0 }
                } else if drop_2 >= drop_1 {
                    if drop > 0.0 { 0.5 * drop * drop } else { 0.0 }
                } else {
                    drop_1 * drop_1 + drop_2 * drop_2
                };
                let steeper = square > steepest;
                steepest = if steeper { square } else { steepest };
                leg_1 = if steeper { drop_1 } else { leg_1 };
                leg_2 = if steeper { drop_2 } else { leg_2 };
                diagonal = if steeper { drop } else { diagonal };
                beside = if steeper { side_code } else { beside };
                across = if steeper { corner_code } else { across };
            };
            facets(e[x], [ne[x], se[x]], 0, [1, 7]);
            facets(n[x], [ne[x], nw[x]], 2, [1, 3]);
            facets(w[x], [nw[x], sw[x]], 4, [3, 5]);
            facets(s[x], [sw[x], se[x]], 6, [5, 7]);
            // angle from the first leg in units of 45°: atan(t) / 45° to 0.005 for t from 0 to 1
            let tangent = if leg_2 <= 0.0 { 0.0 } else if leg_2 >= leg_1 { 1.0 } else { leg_2 / leg_1 };
            let angle = tangent * (1.0 + 0.3476 * (1.0 - tangent));
            let draw = f64::from(mix((first + x as u32).wrapping_mul(0x9E37_79B9) ^ seed) >> 8) * (1.0 / 16_777_216.0);
            let choose_across = (draw < angle && diagonal > 0.0) || leg_1 <= 0.0;
            codes[x] = if choose_across { across as u8 } else { beside as u8 };
            tangents[x] = (tangent * 255.0 + 0.5) as u8;
        }
    }
}

/// Calls `row` for the inner columns of every row of `out`, with the index of the first cell, the cells and their
/// neighbours, and `single` for the cells of the first and last column. Neighbours beyond the raster are higher than
/// any height.
fn rows<'a, T: Elevation>(
    job: &Job<'_>,
    grid: &Grid,
    heights: &[T],
    out: impl Iterator<Item = (&'a mut [u8], &'a mut [u8])>,
    row: impl Fn(u32, [&[T]; 9], &mut [u8], &mut [u8]) + Sync,
    single: impl Fn(u32, [T; 9]) -> (u8, u8) + Sync,
) -> Result<(), NodeError> {
    let nx = grid.nx;
    let beyond = vec![T::TOP; nx];
    let line = |y: Option<usize>| y.map_or(&beyond[..], |y| &heights[y * nx..(y + 1) * nx]);
    par::each(out, |y, (codes, tangents)| {
        job.check()?;
        let (above, here, below) = (line(grid.row_above(y)), line(Some(y)), line(grid.row_below(y)));
        let first = (y * nx) as u32;
        if nx > 2 {
            let (west, mid, east) = (0..nx - 2, 1..nx - 1, 2..nx);
            let around = [
                &here[mid.clone()],
                &here[east.clone()],
                &above[east.clone()],
                &above[mid.clone()],
                &above[west.clone()],
                &here[west.clone()],
                &below[west],
                &below[mid],
                &below[east],
            ];
            let inner = if tangents.is_empty() { 0..0 } else { 1..nx - 1 };
            row(first + 1, around, &mut codes[1..nx - 1], &mut tangents[inner]);
        }
        for x in [0, nx - 1] {
            let cell = first + x as u32;
            let around = std::array::from_fn(|at| match at {
                0 => here[x],
                _ => grid.neighbour(cell, at - 1).map_or(T::TOP, |cell| heights[cell as usize]),
            });
            let (code, tangent) = single(cell, around);
            codes[x] = code | BORDER;
            if let Some(slot) = tangents.get_mut(x) {
                *slot = tangent;
            }
        }
        let mut mark = |x: usize| {
            codes[x] |= BORDER;
            match grid.outlet(x, y) {
                Outlet::Base => codes[x] = BORDER | OUTLET,
                Outlet::Open if codes[x] & PIT != 0 => codes[x] = BORDER | OUTLET,
                Outlet::Open | Outlet::No => {}
            }
        };
        if grid.is_border_row(y) {
            (0..nx).for_each(mark);
        } else {
            mark(0);
            mark(nx - 1);
        }
        Ok(())
    })
}
