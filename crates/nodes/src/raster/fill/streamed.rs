//! Fills the voids of a raster whose rows come one after another, twice; the same as [`fill_voids`](super::fill_voids),
//! bit for bit.
//!
//! The first time, the rows are averaged up to a level that is small enough to stay in memory, and which the levels
//! above complete. The second time, each strip of rows is filled from that level and from the levels between, which are
//! made again for the strip and for the rows beside it. A row needs one row more of each level at either side, so of
//! the raster half as many rows as a cell of the level in memory has.

use orograph_graph::{
    NodeError,
    memory::{copied, with_capacity},
};

use super::{Check, Level};

/// Samples of a strip, which has more if they are needed.
const STRIP: usize = 1 << 16;
/// The most levels below the one in memory.
const MOST_LEVELS: u32 = 12;

/// How a raster is divided.
#[derive(Clone, Copy, Debug)]
struct Plan {
    columns: usize,
    rows: usize,
    /// The level in memory; the raster itself is level 0.
    depth: u32,
    /// Rows of a strip: a multiple of those in a cell of the level in memory.
    strip: usize,
}

impl Plan {
    /// Returns the plan that takes the least memory.
    fn new(columns: usize, rows: usize) -> Self {
        let plan = |depth: u32| {
            let unit = 1 << depth;
            Self { columns, rows, depth, strip: unit * STRIP.div_ceil(columns * unit) }
        };
        let depths = (1..=MOST_LEVELS).take_while(|depth| Self::exists(columns, rows, *depth));
        depths.map(plan).min_by_key(Self::bytes).unwrap_or_else(|| plan(1))
    }

    /// Returns true if the pyramid over a raster has that level: it ends at a level of one cell.
    fn exists(columns: usize, rows: usize, depth: u32) -> bool {
        depth == 1 || [columns, rows].iter().any(|side| side.div_ceil(1 << (depth - 1)) > 1)
    }

    /// Returns the cells of the level in memory.
    fn cells(&self) -> usize {
        self.columns.div_ceil(1 << self.depth) * self.rows.div_ceil(1 << self.depth)
    }

    /// Returns the rows on either side of a strip that are needed to fill it.
    fn beside(&self) -> usize {
        1 << (self.depth - 1)
    }

    /// Returns the bytes of the pass that needs more.
    fn bytes(&self) -> u64 {
        let cells = self.cells() as u64;
        let of_rows = |rows: usize| 4 * (self.columns * rows.min(self.rows)) as u64;
        let unit = 1 << self.depth;
        // the levels over rows are a third as large, with a weight for each value
        let first = cells * 32 / 3 + of_rows(self.strip) * 5 / 3;
        let second = 4 * cells + of_rows(self.strip + 2 * unit) + of_rows(self.strip);
        first.max(second + if self.depth > 1 { of_rows(self.strip + unit) * 2 / 3 } else { 0 })
    }
}

/// Returns about the number of bytes that filling needs.
#[must_use]
pub fn filling_bytes(columns: usize, rows: usize) -> u64 {
    Plan::new(columns, rows).bytes()
}

/// Returns about the number of rows that `Filling` passes on at a time.
#[must_use]
pub fn filling_rows(columns: usize, rows: usize) -> usize {
    Plan::new(columns, rows).strip.min(rows)
}

/// The first pass over a raster: its level in memory.
pub struct Coarse {
    plan: Plan,
    level: Level,
    /// Rows that do not fill a strip yet, and how many came before them.
    rows: Vec<f32>,
    done: usize,
}

impl Coarse {
    /// Begins a raster.
    ///
    /// # Errors
    /// [`NodeError::OutOfMemory`].
    pub fn new(columns: usize, rows: usize) -> Result<Self, NodeError> {
        Self::of(Plan::new(columns, rows))
    }

    fn of(plan: Plan) -> Result<Self, NodeError> {
        let Plan { columns, rows, .. } = plan;
        let side = |cells: usize| cells.div_ceil(1 << plan.depth);
        let (values, weights) = (with_capacity(plan.cells())?, with_capacity(plan.cells())?);
        let level = Level { columns: side(columns), rows: side(rows), first: 0, values, weights };
        Ok(Self { plan, level, rows: with_capacity(columns * plan.strip.min(rows))?, done: 0 })
    }

    /// Takes the next rows.
    ///
    /// # Errors
    /// The error of `check`, or [`NodeError::OutOfMemory`].
    pub fn take(&mut self, mut samples: &[f32], check: Check<'_>) -> Result<(), NodeError> {
        let Plan { columns, rows, strip, .. } = self.plan;
        while !samples.is_empty() {
            let strip = strip.min(rows - self.done);
            let (next, rest) = samples.split_at((columns * strip - self.rows.len()).min(samples.len()));
            self.rows.extend_from_slice(next);
            samples = rest;
            if self.rows.len() == columns * strip {
                self.average(check)?;
                self.done += strip;
                self.rows.clear();
            }
        }
        Ok(())
    }

    /// Adds the rows of a strip to the level in memory.
    fn average(&mut self, check: Check<'_>) -> Result<(), NodeError> {
        let Plan { columns, rows, depth, .. } = self.plan;
        let mut level = Level::over(columns, rows, self.done, &self.rows, check)?;
        for _ in 1..depth {
            level = level.next(check)?;
        }
        self.level.values.extend(level.values);
        self.level.weights.extend(level.weights);
        Ok(())
    }

    /// Ends the first pass.
    ///
    /// # Errors
    /// The error of `check`, or [`NodeError::OutOfMemory`].
    ///
    /// # Panics
    /// If rows are missing.
    pub fn complete(self, check: Check<'_>) -> Result<Filling, NodeError> {
        let Self { plan, mut level, done, .. } = self;
        assert_eq!(done, plan.rows, "all rows were given");
        level.complete(check)?;
        level.weights = Vec::new();
        let most = (plan.strip + (2 << plan.depth)).min(plan.rows);
        Ok(Filling { plan, level, rows: with_capacity(plan.columns * most)?, first: 0, done: 0 })
    }
}

/// Receives whole rows without voids, and the number of the first one.
pub type Filled<'f> = dyn FnMut(usize, &[f32]) -> Result<(), NodeError> + 'f;

/// The second pass over a raster: its voids are filled.
pub struct Filling {
    plan: Plan,
    /// The level in memory, complete.
    level: Level,
    /// Rows from `first` on.
    rows: Vec<f32>,
    first: usize,
    /// The number of rows that have been passed on.
    done: usize,
}

impl Filling {
    /// Takes the next rows, and passes on those that can be filled, with the number of the first one.
    ///
    /// # Errors
    /// The error of `check` or of `each`, or [`NodeError::OutOfMemory`].
    pub fn take(&mut self, samples: &[f32], check: Check<'_>, each: &mut Filled<'_>) -> Result<(), NodeError> {
        let Plan { columns, rows, depth, strip } = self.plan;
        let beside = self.plan.beside();
        for samples in samples.chunks(columns * strip) {
            self.rows.extend_from_slice(samples);
            let end = self.first + self.rows.len() / columns;
            // whole cells of the level in memory, with the rows beside them
            let ready = if end == rows { rows } else { end.saturating_sub(beside) >> depth << depth };
            if ready > self.done {
                let filled = self.filled(ready, check)?;
                each(self.done, &filled)?;
                self.done = ready;
                let kept = ready.saturating_sub(beside).max(self.first);
                self.rows.drain(..(kept - self.first) * columns);
                self.first = kept;
            }
        }
        Ok(())
    }

    /// Returns the rows that have not been passed on, up to row `end`, with their voids filled.
    fn filled(&self, end: usize, check: Check<'_>) -> Result<Vec<f32>, NodeError> {
        let Plan { columns, rows, depth, .. } = self.plan;
        let within = columns * (self.done - self.first)..columns * (end - self.first);
        let mut filled = copied(&self.rows[within])?;
        if !filled.iter().any(|v| v.is_nan()) {
            return Ok(filled);
        }
        let given = columns * ((end + self.plan.beside()).min(rows) - self.first);
        let mut between: Vec<Level> = Vec::new();
        for _ in 1..depth {
            between.push(match between.last() {
                None => Level::over(columns, rows, self.first, &self.rows[..given], check)?,
                Some(fine) => fine.next(check)?,
            });
        }
        let mut coarse = None;
        for (depth, mut level) in (1..depth).zip(between).rev() {
            let first = (self.done >> depth).saturating_sub(1);
            let end = (end.div_ceil(1 << depth) + 1).min(level.rows);
            level.blend(first..end, coarse.as_ref().unwrap_or(&self.level), check)?;
            coarse = Some(level);
        }
        coarse.as_ref().unwrap_or(&self.level).fill(self.done, &mut filled, columns, check)?;
        Ok(filled)
    }
}

#[cfg(test)]
mod tests {
    use super::{super::fill_voids, *};

    /// In blocks of any number of rows, with voids of all sizes, and levels in memory of any depth.
    #[test]
    fn rows_that_come_in_blocks_are_filled_to_the_same_bits() {
        let check = || Ok(());
        for (columns, rows) in [(1, 1), (1, 40), (40, 1), (7, 5), (61, 83), (128, 64), (300, 217)] {
            for share in [1, 3, 40] {
                let source: Vec<f32> = (0..columns * rows)
                    .map(|at| {
                        let (i, j) = (at % columns, at / columns);
                        let hole = (i / 9 + j / 11) % share != 0 || orograph_graph::mix(at as u32).is_multiple_of(7);
                        if hole && at != columns * rows / 2 { f32::NAN } else { (at * 7919 % 1009) as f32 * 0.37 }
                    })
                    .collect();
                let mut whole = source.clone();
                fill_voids(columns, rows, &mut whole, &check).expect("filled");
                let most = (1..=MOST_LEVELS).take_while(|depth| Plan::exists(columns, rows, *depth));
                for (depth, block) in most.flat_map(|depth| [1, 3, 64].map(|block| (depth, block))) {
                    for strips in [1, 2] {
                        let plan = Plan { columns, rows, depth, strip: strips << depth };
                        let mut coarse = Coarse::of(plan).expect("memory");
                        for part in source.chunks(block * columns) {
                            coarse.take(part, &check).expect("averaged");
                        }
                        let (mut filling, mut filled) = (coarse.complete(&check).expect("complete"), Vec::new());
                        for part in source.chunks(block * columns) {
                            filling
                                .take(part, &check, &mut |first, rows| {
                                    assert_eq!(first, filled.len() / columns);
                                    filled.extend_from_slice(rows);
                                    Ok(())
                                })
                                .expect("filled");
                        }
                        let bits = |samples: &[f32]| samples.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
                        assert_eq!(bits(&filled), bits(&whole), "{plan:?} {block} {share}");
                    }
                }
            }
        }
    }

    #[test]
    fn large_rasters_need_little_memory() {
        for (columns, rows) in [(1 << 15, 1 << 15), (1 << 16, 1 << 14), (1 << 10, 1 << 20), (10_000, 10_000)] {
            assert!(filling_bytes(columns, rows) < 48 << 20, "{columns} x {rows}: {}", filling_bytes(columns, rows));
        }
    }
}
