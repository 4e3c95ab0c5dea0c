//! Accumulates dispersed flow, each cell after all its donors. What a cell passes on is a function of what it has and
//! gets.
//!
//! The raster is divided into strips of rows. In each strip, walks start at cells that wait for no donor and continue
//! at cells whose last donor has been visited. Flow across strips is sent as messages. Strips are walked in parallel,
//! in rounds, until no message is left. A cell sums its whole inflow at once, in the order of directions, so the sums
//! do not depend on the strips or on the order of the walk.

use orograph_graph::{Job, NodeError};

use crate::numerics::{
    par,
    routing::{Grid, code::BORDER},
};

/// Minimum rows of a strip.
const MIN_ROWS: usize = 64;
/// Strips per thread. Fewer strips send fewer messages; more strips balance the threads better.
const STRIPS_PER_THREAD: usize = 2;
/// Marks a cell that has been visited.
const VISITED: u8 = u8::MAX;

/// The graph of dispersed flow.
pub struct Links {
    /// Fraction of its water that each neighbour gives to a cell, in the order of directions.
    pub incoming: Vec<[f32; 8]>,
    /// Set of directions in which a cell gives water.
    pub gives: Vec<u8>,
    /// Number of donors of a cell that have not been visited.
    pub missing: Vec<u8>,
}

/// The amount of a cell, sent to a receiver in another strip.
struct Message {
    from: u32,
    to: u32,
    amount: f64,
}

/// A strip and the state of its walk.
struct Strip<'a, P> {
    grid: &'a Grid,
    pass: &'a P,
    codes: &'a [u8],
    incoming: &'a [[f32; 8]],
    gives: &'a [u8],
    missing: &'a mut [u8],
    amounts: &'a mut [f64],
    /// Index of the first cell.
    first: usize,
    /// The adjacent rows to the north and south if they are in another strip, with the amounts received from them.
    beside: [Option<(usize, Vec<f64>)>; 2],
    /// Offsets to the neighbours of a cell that is not at an edge.
    steps: [isize; 8],
    /// Stack of cells that are ready; `waiting` is its height.
    ready: Vec<u32>,
    waiting: usize,
    sent: Vec<Message>,
    started: bool,
}

/// Accumulates `amounts` along the links: afterwards each is `pass(cell, amount)` of the cell's own amount plus its
/// inflow from all donors, which is what the cell distributes to its receivers.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn accumulate<P: Fn(usize, f64) -> f64 + Sync>(
    job: &Job<'_>,
    grid: &Grid,
    codes: &[u8],
    links: &mut Links,
    amounts: &mut [f64],
    pass: &P,
) -> Result<(), NodeError> {
    let threads = rayon::current_num_threads();
    let strips = if threads > 1 { STRIPS_PER_THREAD * threads } else { 1 };
    let rows = grid.ny.div_ceil(strips).max(MIN_ROWS);
    let size = rows * grid.nx;
    let mut strips: Vec<Strip<'_, P>> = (links.missing.chunks_mut(size))
        .zip(amounts.chunks_mut(size))
        .zip(links.incoming.chunks(size).zip(links.gives.chunks(size)).zip(codes.chunks(size)))
        .enumerate()
        .map(|(at, ((missing, amounts), ((incoming, gives), codes)))| {
            let (top, bottom) = (at * rows, at * rows + missing.len() / grid.nx - 1);
            let beside = [grid.row_above(top), grid.row_below(bottom)]
                .map(|y| y.filter(|y| !(top..=bottom).contains(y)).map(|y| (y, vec![0.0; grid.nx])));
            Strip {
                grid,
                pass,
                codes,
                incoming,
                gives,
                missing,
                amounts,
                first: at * size,
                beside,
                steps: std::array::from_fn(|way| grid.inner_neighbour(0, way) as i32 as isize),
                ready: Vec::new(),
                waiting: 0,
                sent: Vec::new(),
                started: false,
            }
        })
        .collect();
    let mut inboxes: Vec<Vec<Message>> = strips.iter().map(|_| Vec::new()).collect();
    loop {
        job.check()?;
        let awake = strips.iter_mut().zip(&mut inboxes).filter(|(strip, inbox)| !strip.started || !inbox.is_empty());
        par::each(awake, |_, (strip, inbox)| strip.walk(job, inbox))?;
        let mut sent = false;
        for strip in &mut strips {
            for message in strip.sent.drain(..) {
                sent = true;
                inboxes[message.to as usize / size].push(message);
            }
        }
        if !sent {
            return Ok(());
        }
    }
}

impl<P: Fn(usize, f64) -> f64> Strip<'_, P> {
    /// Processes received messages and visits all cells that become ready.
    fn walk(&mut self, job: &Job<'_>, inbox: &mut Vec<Message>) -> Result<(), NodeError> {
        let nx = self.grid.nx;
        if !self.started {
            self.started = true;
            for source in 0..self.missing.len() {
                if source.is_multiple_of(1 << 14) {
                    job.check()?;
                }
                if self.missing[source] == 0 {
                    self.run(job, source)?;
                }
            }
        }
        for Message { from, to, amount } in inbox.drain(..) {
            for (row, amounts) in self.beside.iter_mut().flatten() {
                if *row == from as usize / nx {
                    amounts[from as usize % nx] = amount;
                }
            }
            let at = to as usize - self.first;
            self.missing[at] -= 1;
            if self.missing[at] == 0 {
                self.run(job, at)?;
            }
        }
        Ok(())
    }

    /// Visits a cell that is ready, and all cells that become ready with it.
    fn run(&mut self, job: &Job<'_>, cell: usize) -> Result<(), NodeError> {
        let nx = self.grid.nx;
        let inside = nx..self.missing.len().saturating_sub(nx);
        self.push(cell as u32);
        let mut visited = 0_u32;
        while self.waiting > 0 {
            self.waiting -= 1;
            visited += 1;
            if visited.is_multiple_of(1 << 14) {
                job.check()?;
            }
            let at = self.ready[self.waiting] as usize;
            self.missing[at] = VISITED;
            if self.codes[at] & BORDER != 0 || !inside.contains(&at) {
                self.visit_at_edge(at);
                continue;
            }
            let around = self.steps.map(|step| at.wrapping_add_signed(step));
            let (shares, amounts) = (&self.incoming[at], &mut *self.amounts);
            let inflow = sum(std::array::from_fn(|way| f64::from(shares[way]) * amounts[around[way]]));
            amounts[at] = (self.pass)(self.first + at, amounts[at] + inflow);
            if self.ready.len() < self.waiting + 8 {
                self.ready.resize(2 * self.waiting + 8, 0);
            }
            let (mut gives, missing, ready) = (self.gives[at], &mut *self.missing, &mut self.ready[self.waiting..]);
            let mut end = 0;
            if gives.count_ones() < 3 {
                while gives != 0 {
                    let to = around[gives.trailing_zeros() as usize];
                    gives &= gives - 1;
                    missing[to] -= 1;
                    ready[end] = to as u32;
                    end += usize::from(missing[to] == 0);
                }
            } else {
                // branch-free: every neighbour is written, and the next one overwrites those that are not ready
                for (way, to) in around.into_iter().enumerate() {
                    let given = gives >> way & 1;
                    let left = missing[to] - given;
                    missing[to] = left;
                    ready[end & 7] = to as u32;
                    end += usize::from((given == 1) & (left == 0));
                }
            }
            self.waiting += end;
        }
        Ok(())
    }

    fn push(&mut self, at: u32) {
        if self.waiting == self.ready.len() {
            self.ready.push(at);
        } else {
            self.ready[self.waiting] = at;
        }
        self.waiting += 1;
    }

    /// Visits a cell at the edge of the strip or the raster.
    fn visit_at_edge(&mut self, at: usize) {
        let (nx, cell) = (self.grid.nx, (self.first + at) as u32);
        let around: [Option<u32>; 8] = std::array::from_fn(|way| self.grid.neighbour(cell, way));
        let amount = |cell: u32| {
            let within = self.amounts.get((cell as usize).wrapping_sub(self.first)).copied();
            within.or_else(|| {
                let (row, x) = (cell as usize / nx, cell as usize % nx);
                self.beside.iter().flatten().find(|(beside, _)| *beside == row).map(|(_, amounts)| amounts[x])
            })
        };
        let given = std::array::from_fn(|way| {
            let share = f64::from(self.incoming[at][way]);
            around[way].and_then(amount).map_or(0.0, |amount| share * amount)
        });
        self.amounts[at] = (self.pass)(cell as usize, self.amounts[at] + sum(given));
        for (way, to) in around.into_iter().enumerate() {
            let Some(to) = to.filter(|_| self.gives[at] >> way & 1 == 1) else { continue };
            let local = (to as usize).wrapping_sub(self.first);
            match self.missing.get_mut(local) {
                Some(missing) => {
                    *missing -= 1;
                    if *missing == 0 {
                        self.push(local as u32);
                    }
                }
                None => self.sent.push(Message { from: cell, to, amount: self.amounts[at] }),
            }
        }
    }
}

/// Sums in a fixed order.
#[inline(always)]
fn sum([a, b, c, d, e, f, g, h]: [f64; 8]) -> f64 {
    ((a + b) + (c + d)) + ((e + f) + (g + h))
}
