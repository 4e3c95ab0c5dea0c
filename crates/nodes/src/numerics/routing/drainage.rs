//! Flow order and drainage area.
//!
//! The raster is divided into strips of rows of a fixed height. A cell is *local* if its whole catchment is in its
//! strip; the others form the *trunk*: every receiver of a trunk cell is a trunk cell. Strips can therefore be
//! traversed in parallel: downstream, donors first, before the trunk; upstream, receivers first, after it. Within a
//! strip, walks start at cells without donors and continue at a receiver after its last donor. Receivers form a forest,
//! so each cell is visited once (Braun and Willett 2013 order the same forest by a depth-first search).

use orograph_graph::{Job, NodeError};

use super::{Depressions, Elevation, Grid, code::has_receiver, donors};
use crate::numerics::par;

/// Rows of a strip. The order of weighted sums depends on it, and with it their last bits.
const STRIP_ROWS: usize = 64;
/// Marks a cell that has been visited.
const VISITED: u8 = u8::MAX;

/// Donors-first order of the cells. Buffers are reused between calls.
#[derive(Debug, Default)]
pub struct Drainage {
    missing: Vec<u8>,
    /// The local cells of each strip in order; a strip's slot has as many places as the strip has cells.
    local: Vec<u32>,
    /// Number of local cells of each strip.
    counts: Vec<usize>,
    trunk: Vec<u32>,
}

/// Quantity accumulated along the flow.
pub trait Amount: Copy + Send + Sync {
    /// The sum.
    #[must_use]
    fn plus(self, other: Self) -> Self;
}

impl Amount for u32 {
    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        self + other
    }
}

impl Amount for f64 {
    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        self + other
    }
}

impl Amount for [f64; 2] {
    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        [self[0] + other[0], self[1] + other[1]]
    }
}

impl Drainage {
    /// Exchanges room with depressions: who needs their labels no more when the receivers lead out of them can order
    /// the cells where the labels were, and gives the room back before the next search.
    pub fn exchange_room<T: Elevation>(&mut self, depressions: &mut Depressions<T>) {
        std::mem::swap(&mut self.local, &mut depressions.labels);
        std::mem::swap(&mut self.missing, &mut depressions.donors);
    }

    /// Orders the cells and accumulates `amounts` downstream: afterwards each is the sum over the cell's catchment.
    /// With 1 everywhere, the result is the number of cells.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn accumulate<A: Amount>(
        &mut self,
        job: &Job<'_>,
        grid: &Grid,
        codes: &[u8],
        amounts: &mut [A],
    ) -> Result<(), NodeError> {
        let strip = STRIP_ROWS * grid.nx;
        self.missing.resize(grid.cells(), 0);
        self.local.resize(grid.cells(), 0);
        donors::sums(job, grid, codes, [1; 8], &mut self.missing)?;
        let strips = self.missing.chunks_mut(strip).zip(self.local.chunks_mut(strip)).zip(amounts.chunks_mut(strip));
        let walked = par::collect(strips, |at, ((missing, order), amounts)| {
            walk_strip(job, grid, codes, (at * strip) as u32, missing, order, amounts)
        })?;
        self.counts.clear();
        self.trunk.clear();
        // the trunk starts where flow crosses from one strip to another
        for (at, (count, exits)) in walked.into_iter().enumerate() {
            if at % 16 == 0 {
                job.check()?;
            }
            self.counts.push(count);
            for exit in exits {
                let mut cell = exit;
                loop {
                    let code = codes[cell as usize];
                    if !has_receiver(code) {
                        break;
                    }
                    let receiver = grid.receiver(cell, code);
                    let missing = &mut self.missing[receiver as usize];
                    *missing -= 1;
                    let ready = *missing == 0;
                    amounts[receiver as usize] = amounts[receiver as usize].plus(amounts[cell as usize]);
                    if !ready {
                        break;
                    }
                    self.trunk.push(receiver);
                    cell = receiver;
                }
            }
        }
        Ok(())
    }

    /// Visits every cell that has a receiver after all its donors, and adds its outflow, `link(cell, code, own
    /// amount)`, to the receiver's amount. The order is that of the last [`Self::accumulate`].
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn downstream<A: Amount>(
        &self,
        job: &Job<'_>,
        grid: &Grid,
        codes: &[u8],
        amounts: &mut [A],
        link: impl Fn(usize, u8, A) -> A + Sync,
    ) -> Result<(), NodeError> {
        let strip = STRIP_ROWS * grid.nx;
        let strips = amounts.chunks_mut(strip).zip(self.local.chunks(strip)).zip(&self.counts);
        let crossing = par::collect(strips, |at, ((amounts, order), &count)| {
            let first = (at * strip) as u32;
            let mut crossing = Vec::new();
            for cells in order[..count].chunks(1 << 14) {
                job.check()?;
                for &cell in cells {
                    let code = codes[cell as usize];
                    if !has_receiver(code) {
                        continue;
                    }
                    let passed_on = link(cell as usize, code, amounts[(cell - first) as usize]);
                    let receiver = grid.receiver(cell, code);
                    match amounts.get_mut(receiver.wrapping_sub(first) as usize) {
                        Some(amount) => *amount = amount.plus(passed_on),
                        None => crossing.push((receiver, passed_on)),
                    }
                }
            }
            Ok::<_, NodeError>(crossing)
        })?;
        for (receiver, passed_on) in crossing.into_iter().flatten() {
            amounts[receiver as usize] = amounts[receiver as usize].plus(passed_on);
        }
        for cells in self.trunk.chunks(1 << 16) {
            job.check()?;
            for &cell in cells {
                let code = codes[cell as usize];
                if has_receiver(code) {
                    let passed_on = link(cell as usize, code, amounts[cell as usize]);
                    let receiver = grid.receiver(cell, code) as usize;
                    amounts[receiver] = amounts[receiver].plus(passed_on);
                }
            }
        }
        Ok(())
    }

    /// Visits every cell that has a receiver after that receiver, and sets its value to `link(cell, code, own value,
    /// receiver's value)`. Cells without a receiver keep their values.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn upstream<V: Copy + Send + Sync>(
        &self,
        job: &Job<'_>,
        grid: &Grid,
        codes: &[u8],
        values: &mut [V],
        link: impl Fn(usize, u8, V, V) -> V + Sync,
    ) -> Result<(), NodeError> {
        self.upstream_prepared(
            job,
            grid,
            codes,
            values,
            |_, _| (),
            |cell, code, (), own, below| link(cell, code, own, below),
        )
    }

    /// As [`Self::upstream`], with `link(cell, code, prepare(cell, code), own value, receiver's value)`. What is
    /// prepared is computed row by row, which is faster than in the order of the flow where it reads many rasters.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn upstream_prepared<V: Copy + Send + Sync, P: Copy + Default + Send>(
        &self,
        job: &Job<'_>,
        grid: &Grid,
        codes: &[u8],
        values: &mut [V],
        prepare: impl Fn(usize, u8) -> P + Sync,
        link: impl Fn(usize, u8, P, V, V) -> V + Sync,
    ) -> Result<(), NodeError> {
        for cells in self.trunk.rchunks(1 << 16) {
            job.check()?;
            for &cell in cells.iter().rev() {
                let code = codes[cell as usize];
                if has_receiver(code) {
                    let below = values[grid.receiver(cell, code) as usize];
                    let prepared = prepare(cell as usize, code);
                    values[cell as usize] = link(cell as usize, code, prepared, values[cell as usize], below);
                }
            }
        }
        // the receiver of a local cell is local, or a trunk cell of this strip or of an adjacent row
        let (nx, strip) = (grid.nx, STRIP_ROWS * grid.nx);
        let row = |y: Option<usize>| y.map_or(&[][..], |y| &values[y * nx..(y + 1) * nx]).to_vec();
        let beside: Vec<[(Option<usize>, Vec<V>); 2]> = (0..grid.ny)
            .step_by(STRIP_ROWS)
            .map(|first| {
                let last = (first + STRIP_ROWS).min(grid.ny) - 1;
                [grid.row_above(first), grid.row_below(last)].map(|y| (y, row(y)))
            })
            .collect();
        let strips = values.chunks_mut(strip).zip(self.local.chunks(strip)).zip(&self.counts).zip(&beside);
        let room = || vec![P::default(); strip];
        par::each_with(strips, room, |prepared, at, (((values, order), &count), beside)| {
            let first = at * strip;
            for (row, prepared) in prepared[..values.len()].chunks_mut(nx).enumerate() {
                job.check()?;
                let first = first + row * nx;
                for ((cell, &code), prepared) in (first..).zip(&codes[first..]).zip(prepared) {
                    if has_receiver(code) {
                        *prepared = prepare(cell, code);
                    }
                }
            }
            for cells in order[..count].rchunks(1 << 14) {
                job.check()?;
                for &cell in cells.iter().rev() {
                    let code = codes[cell as usize];
                    if !has_receiver(code) {
                        continue;
                    }
                    let receiver = grid.receiver(cell, code) as usize;
                    let below = match values.get(receiver.wrapping_sub(first)) {
                        Some(value) => *value,
                        None => {
                            let [above, below] = beside;
                            let (_, row) = if above.0 == Some(receiver / nx) { above } else { below };
                            row[receiver % nx]
                        }
                    };
                    let (value, prepared) = (&mut values[cell as usize - first], prepared[cell as usize - first]);
                    *value = link(cell as usize, code, prepared, *value, below);
                }
            }
            Ok(())
        })
    }
}

/// Walks the local cells of a strip. Returns their number and the cells whose receiver is in another strip.
fn walk_strip<A: Amount>(
    job: &Job<'_>,
    grid: &Grid,
    codes: &[u8],
    first: u32,
    missing: &mut [u8],
    order: &mut [u32],
    amounts: &mut [A],
) -> Result<(usize, Vec<u32>), NodeError> {
    let mut count = 0;
    let mut exits = Vec::new();
    for source in 0..missing.len() {
        if source.is_multiple_of(1 << 14) {
            job.check()?;
        }
        if missing[source] != 0 {
            continue;
        }
        let mut at = source;
        loop {
            let cell = first + at as u32;
            order[count] = cell;
            count += 1;
            missing[at] = VISITED;
            let code = codes[cell as usize];
            if !has_receiver(code) {
                break;
            }
            let receiver = grid.receiver(cell, code).wrapping_sub(first) as usize;
            let Some(left) = missing.get_mut(receiver) else {
                exits.push(cell);
                break;
            };
            *left -= 1;
            let ready = *left == 0;
            amounts[receiver] = amounts[receiver].plus(amounts[at]);
            if !ready {
                break;
            }
            at = receiver;
        }
    }
    Ok((count, exits))
}
