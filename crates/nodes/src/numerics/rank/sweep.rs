//! Sweeps down a block: the values of a rank in one row follow from those in the row before.

use super::{
    block::{Block, LANES, MEMBERS, Run},
    circle::Steps,
};
use crate::numerics::simd::simd;

/// Approximate number of cells of a circle that the first guess samples.
const GUESS: usize = 256;
/// A one in each byte.
const ONES: u64 = 0x0101_0101_0101_0101;

/// The members of a run inside a circle: a byte of 1 or 0 for each.
type Inside = [u64; MEMBERS / 8];

/// Returns the values of a rank around the cells of a block, row by row.
pub fn ranked(block: &Block, [nx, ny]: [usize; 2], steps: &Steps, rank: u16) -> Vec<f32> {
    let mut out = vec![0.0; nx * ny];
    // offsets in `out` from one column of the block to the next, and from one row to the next
    let (across, down, pace) = if block.turned { (ny, nx, [nx, 1]) } else { (nx, ny, [1, nx]) };
    for first in (0..across).step_by(LANES) {
        let lanes = LANES.min(across - first);
        sweep(&mut out[first * pace[0]..], pace, block, [first, lanes, down], steps, rank);
    }
    out
}

simd! {
    /// Writes the values of a rank for adjacent columns of the block; `part` is the first column, the number of columns
    /// and the number of rows.
    ///
    /// Each lane has a current run and the number of cells of its circle in the runs before it; in a block with level
    /// runs also the number up to and including it. For the next row, the cells that enter and leave the circle update
    /// the counts, for all lanes at once; then each lane moves from run to run to the one with the rank.
    fn sweep(out: &mut [f32], pace: [usize; 2], block: &Block, part: [usize; 3], steps: &Steps, rank: u16) {
        let [first, lanes, rows] = part;
        let (width, reach, last) = (block.width, steps.reach(), block.runs.len() - 1);
        let total: usize = steps.rows().map(|(_, half)| 2 * half + 1).sum();
        let stretches = steps.stretches();
        let mut at = guess(block, first, steps, total, rank);
        let (mut before, mut up_to) = ([0; LANES], [0; LANES]);
        for j in 0..rows {
            let y = j + reach;
            let next = at.map(|run| run + 1);
            if j == 0 {
                for (row, half) in steps.rows() {
                    let from = row * width + first + reach - half;
                    count(&mut before, &at, block, from, 2 * half + 1);
                    if block.level {
                        count(&mut up_to, &next, block, from, 2 * half + 1);
                    }
                }
            } else {
                for [x, columns, half] in stretches {
                    let ends = [y + half, y - half - 1].map(|row| row * width + first + x);
                    go_on(&mut before, &at, block, ends, columns);
                    if block.level {
                        go_on(&mut up_to, &next, block, ends, columns);
                    }
                }
            }
            for lane in 0..lanes {
                let place = [first + lane + reach, y];
                let (mut low, mut high) = (before[lane], up_to[lane]);
                let mut number = at[lane] as usize;
                let mut run = &block.runs[number];
                let mut inside = Inside::default();
                if !run.level {
                    inside = members(run, place, steps);
                    high = low + sum(&inside);
                }
                while rank >= high {
                    number += 1;
                    (run, low) = (&block.runs[number], high);
                    high += if !run.level {
                        inside = members(run, place, steps);
                        sum(&inside)
                    } else if number == last {
                        total as u16 - low
                    } else {
                        level(block, number as i16, place, steps)
                    };
                }
                while rank < low {
                    number -= 1;
                    (run, high) = (&block.runs[number], low);
                    low -= if !run.level {
                        inside = members(run, place, steps);
                        sum(&inside)
                    } else if number == 0 {
                        high
                    } else {
                        level(block, number as i16, place, steps)
                    };
                }
                (at[lane], before[lane], up_to[lane]) = (number as i16, low, high);
                let member = if run.level { 0 } else { select(&inside, rank - low) };
                out[j * pace[1] + lane * pace[0]] = block.values[run.first as usize + member];
            }
        }
    }
}

/// Estimates the run with the rank around each cell of the first row, by bisection, from some cells of the circle.
#[inline(always)]
fn guess(block: &Block, first: usize, steps: &Steps, total: usize, rank: u16) -> [i16; LANES] {
    let apart = (total / GUESS).isqrt() + 1;
    let some = steps.rows().step_by(apart).flat_map(|(row, half)| {
        let middle = row * block.width + first + steps.reach();
        (middle - half..=middle + half).step_by(apart)
    });
    let some: Vec<usize> = some.collect();
    let rank = (usize::from(rank) * some.len() / total) as u16;
    let last = block.runs.len() as i16 - 1;
    let mut at = [0_i16; LANES];
    let mut step = (block.runs.len().next_power_of_two() / 2) as i16;
    while step > 0 {
        let further = at.map(|run| (run + step).min(last));
        let mut before = [0; LANES];
        for &from in &some {
            count(&mut before, &further, block, from, 1);
        }
        for lane in 0..LANES {
            at[lane] = if before[lane] <= rank { further[lane] } else { at[lane] };
        }
        step /= 2;
    }
    at
}

/// Adds the cells of a part of a row that lie in runs before that of each lane. The part begins at `from` for the first
/// lane and one cell further for each following lane.
#[inline(always)]
fn count(counts: &mut [u16; LANES], runs: &[i16; LANES], block: &Block, from: usize, cells: usize) {
    let mut sums = *counts;
    for these in block.of[from..from + cells + LANES - 1].array_windows::<LANES>() {
        for lane in 0..LANES {
            sums[lane] = sums[lane].wrapping_add(u16::from(these[lane] < runs[lane]));
        }
    }
    *counts = sums;
}

/// Adds the cells of one part of a row and subtracts those of another.
#[inline(always)]
fn go_on(counts: &mut [u16; LANES], runs: &[i16; LANES], block: &Block, [more, less]: [usize; 2], cells: usize) {
    let mut sums = *counts;
    let [more, less] = [more, less].map(|from| block.of[from..from + cells + LANES - 1].array_windows::<LANES>());
    for (more, less) in more.zip(less) {
        for lane in 0..LANES {
            let more = u16::from(more[lane] < runs[lane]);
            sums[lane] = sums[lane].wrapping_add(more).wrapping_sub(u16::from(less[lane] < runs[lane]));
        }
    }
    *counts = sums;
}

simd! {
    /// Counts the cells of a run in the circle around a place, row by row.
    fn level(block: &Block, run: i16, place: [usize; 2], steps: &Steps) -> u16 {
        let reach = steps.reach();
        let mut sum = 0;
        for (row, half) in steps.rows() {
            let from = (place[1] + row - reach) * block.width + place[0] - half;
            let mut line = 0_u16;
            for this in &block.of[from..=from + 2 * half] {
                line = line.wrapping_add(u16::from(*this == run));
            }
            sum += line;
        }
        sum
    }
}

/// Returns the members of a run in the circle around a place.
#[inline(always)]
fn members(run: &Run, place: [usize; 2], steps: &Steps) -> Inside {
    let [x, y] = place.map(|at| at as i16);
    let mut inside = [0; MEMBERS];
    for ((inside, px), py) in inside.iter_mut().zip(&run.xs).zip(&run.ys) {
        *inside = u8::from(steps.contains(px.wrapping_sub(x).wrapping_abs(), py.wrapping_sub(y).wrapping_abs()));
    }
    let mut words = Inside::default();
    for (word, eight) in words.iter_mut().zip(inside.as_chunks().0) {
        *word = u64::from_le_bytes(*eight);
    }
    words
}

/// Returns the number of members inside the circle.
#[inline(always)]
fn sum(inside: &Inside) -> u16 {
    // no byte of the sum is above 8, and the highest byte of the product is the sum of all
    (inside.iter().sum::<u64>().wrapping_mul(ONES) >> 56) as u16
}

/// Returns the member of a given rank among them.
#[inline(always)]
fn select(inside: &Inside, rank: u16) -> usize {
    const TOPS: u64 = ONES << 7;
    // each byte is the number of members of the word up to and including it
    let sums = inside.map(|word| word.wrapping_mul(ONES));
    let rank = u64::from(rank);
    let (mut word, mut before, mut seen) = (0, 0, 0);
    for sums in &sums[..sums.len() - 1] {
        seen += sums >> 56;
        let past = seen <= rank;
        word += usize::from(past);
        before = if past { seen } else { before };
    }
    // the top bit remains in bytes that exceed the remaining rank
    let more = ((sums[word] | TOPS) - (rank - before + 1) * ONES) & TOPS;
    8 * word + (more.trailing_zeros() / 8) as usize
}
