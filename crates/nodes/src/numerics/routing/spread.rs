//! Dispersed flow over several receivers, and its drainage area.
//!
//! - [`Spread::DInfinity`] (Tarboton 1997): the two neighbours that bound the steepest of the eight triangular facets
//!   around the cell, divided by the angle of steepest descent between them.
//! - [`Spread::Freeman`] (Freeman 1991): every lower neighbour, in proportion to a power of its slope.
//!
//! Where no neighbour is lower, as on the surface of a lake, all water goes to the receiver of the cell's code. On a
//! filled surface with carved codes flow has no cycles: it leads downhill, or over flats along a tree.
//!
//! Fractions are computed row by row in SIMD lanes (module `shares`) and stored with the receiving cell; then each cell
//! sums its inflow (module `gather`).

use orograph_graph::{
    Job, NodeError,
    memory::{copied, zeroed},
};

mod gather;
mod shares;

use self::{
    gather::Links,
    shares::{LANES, Lanes},
};
use super::{
    Grid,
    code::{OUTLET, STEPS, opposite},
};
use crate::numerics::par;

/// Rows of a band, whose fractions one task computes.
const BAND_ROWS: usize = 64;

/// Distribution of water to neighbours.
#[derive(Clone, Copy, Debug)]
pub enum Spread {
    /// Between two neighbours, by direction.
    DInfinity,
    /// Among all lower neighbours, by slope to the power of `exponent`.
    Freeman {
        /// 0 distributes evenly; large values approach steepest descent.
        exponent: f64,
    },
}

/// Accumulates `amounts` downstream: afterwards each is the cell's own amount plus its inflow.
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
    let mut links = links(job, grid, heights, codes, spread)?;
    gather::accumulate(job, grid, codes, &mut links, amounts, &|_, amount| amount)
}

/// Moves `amounts` downstream: what a cell has and gets beyond `most(cell)` moves on. Afterwards each is what stays.
/// Returns the amounts that leave at outlets, by rows. Sums are conserved to the rounding of double precision.
///
/// # Errors
/// [`NodeError::Cancelled`], or not enough memory.
pub fn overflow(
    job: &Job<'_>,
    grid: &Grid,
    heights: &[f32],
    codes: &[u8],
    spread: Spread,
    most: impl Fn(usize) -> f64 + Sync,
    amounts: &mut [f64],
) -> Result<Vec<f64>, NodeError> {
    let mut links = links(job, grid, heights, codes, spread)?;
    let mut passed = copied(amounts)?;
    gather::accumulate(job, grid, codes, &mut links, &mut passed, &|cell, amount| (amount - most(cell)).max(0.0))?;
    let Links { incoming, gives, .. } = links;
    par::collect(amounts.chunks_mut(grid.nx), |y, amounts| {
        job.check()?;
        let mut left = 0.0;
        for (x, amount) in amounts.iter_mut().enumerate() {
            let cell = y * grid.nx + x;
            let (mut inflow, mut share) = (0.0, 0.0);
            for way in 0..STEPS.len() {
                if incoming[cell][way] == 0.0 && gives[cell] >> way & 1 == 0 {
                    continue;
                }
                let Some(other) = grid.neighbour(cell as u32, way) else { continue };
                inflow += f64::from(incoming[cell][way]) * passed[other as usize];
                // what the receivers get: fractions in single precision do not quite add up to 1
                share += f64::from(incoming[other as usize][opposite(way)]);
            }
            let whole = *amount + inflow;
            if codes[cell] & OUTLET != 0 {
                *amount = whole.min(most(cell));
                left += whole - *amount;
            } else {
                // below 0 only by rounding
                *amount = (whole - share * passed[cell]).max(0.0);
            }
        }
        Ok::<_, NodeError>(left)
    })
}

/// Computes the fractions of all cells.
fn links(job: &Job<'_>, grid: &Grid, heights: &[f32], codes: &[u8], spread: Spread) -> Result<Links, NodeError> {
    let (nx, cells, band) = (grid.nx, grid.cells(), BAND_ROWS * grid.nx);
    let mut links = Links { incoming: zeroed(cells)?, gives: zeroed(cells)?, missing: zeroed(cells)? };
    let bands = links.incoming.chunks_mut(band).zip(links.gives.chunks_mut(band)).zip(links.missing.chunks_mut(band));
    par::each(bands, |at, ((incoming, gives), missing)| -> Result<(), NodeError> {
        let source = Source { grid, heights, codes, spread };
        let mut rows: [Row; 3] = std::array::from_fn(|_| Row::new(nx));
        let top = at * BAND_ROWS;
        source.give(grid.row_above(top), &mut rows[1]);
        source.give(Some(top), &mut rows[2]);
        for (line, incoming) in incoming.chunks_mut(nx).enumerate() {
            job.check()?;
            rows.rotate_left(1);
            source.give(grid.row_below(top + line), &mut rows[2]);
            let here = line * nx..(line + 1) * nx;
            shares::ways(rows[1].shares.each_ref().map(|shares| &shares[1..]), &mut gives[here.clone()]);
            let given = std::array::from_fn(|direction| {
                let (dx, dy) = STEPS[direction];
                &rows[(1 + dy) as usize].shares[opposite(direction)][(1 + dx) as usize..]
            });
            shares::count(given, &mut missing[here]);
            shares::interleave(given, incoming);
        }
        Ok(())
    })?;
    Ok(links)
}

/// Inputs of the fractions.
struct Source<'a> {
    grid: &'a Grid,
    heights: &'a [f32],
    codes: &'a [u8],
    spread: Spread,
}

/// Fractions that the cells of a row give in each direction, with one more cell at either end.
struct Row {
    shares: [Vec<f32>; 8],
}

impl Row {
    fn new(nx: usize) -> Self {
        Self { shares: std::array::from_fn(|_| vec![0.0; nx + 2]) }
    }
}

impl Source<'_> {
    /// Computes the fractions of a row; a row beyond the raster gives nothing.
    fn give(&self, y: Option<usize>, row: &mut Row) {
        let nx = self.grid.nx;
        let Some(y) = y else {
            row.shares.iter_mut().for_each(|shares| shares.fill(0.0));
            return;
        };
        // heights of three rows with one more column at either end, +∞ beyond the raster
        let lines = [self.grid.row_above(y), Some(y), self.grid.row_below(y)].map(|y| {
            let Some(y) = y else { return vec![f32::INFINITY; nx + 2] };
            let line = &self.heights[y * nx..(y + 1) * nx];
            let beyond = |x: Option<usize>| x.map_or(f32::INFINITY, |x| line[x]);
            [&[beyond(self.grid.column_before(0))], line, &[beyond(self.grid.column_after(nx - 1))]].concat()
        });
        for first in (0..nx).step_by(LANES) {
            let len = LANES.min(nx - first);
            let mut around: [Lanes; 9] = [[0.0; LANES]; 9];
            let mut codes = [OUTLET; LANES];
            codes[..len].copy_from_slice(&self.codes[y * nx + first..][..len]);
            let steps = [(0, 0)].into_iter().chain(STEPS);
            for (lanes, (dx, dy)) in around.iter_mut().zip(steps) {
                let line = &lines[(1 + dy) as usize][first + (1 + dx) as usize..];
                lanes[..len].copy_from_slice(&line[..len]);
            }
            let mut shares: [Lanes; 8] = [[0.0; LANES]; 8];
            match self.spread {
                Spread::DInfinity => shares::d_infinity(&around, &mut shares),
                Spread::Freeman { exponent } => shares::freeman(&around, exponent as f32, &mut shares),
            }
            shares::follow_codes(&codes, &mut shares);
            for (row, lanes) in row.shares.iter_mut().zip(&shares) {
                row[1 + first..][..len].copy_from_slice(&lanes[..len]);
            }
        }
        for shares in &mut row.shares {
            shares[0] = self.grid.column_before(0).map_or(0.0, |x| shares[1 + x]);
            shares[nx + 1] = self.grid.column_after(nx - 1).map_or(0.0, |x| shares[1 + x]);
        }
    }
}
