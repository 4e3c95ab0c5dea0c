//! A block of cells with its halo, sorted by value.

use super::{Padded, circle::Steps};
use crate::numerics::math::{from_ordered, ordered};

/// Maximum number of members of a run.
pub const MEMBERS: usize = 64;
/// Number of equal values from which they form a run of their own.
const LEVEL: usize = 2 * MEMBERS;
/// Adjacent cells whose neighbourhoods are counted at once.
pub const LANES: usize = 32;
/// Maximum number of bits of a digit of the radix sort.
const DIGIT: u32 = 13;

/// A block of cells with its halo, whose neighbourhoods are ranked together.
#[derive(Default)]
pub struct Block {
    /// True if the block is transposed: its rows are columns of the terrain.
    pub turned: bool,
    /// Columns, including the halo.
    pub width: usize,
    /// Values in ascending order.
    pub values: Vec<f32>,
    /// Runs of that order.
    pub runs: Vec<Run>,
    /// True if any run is level.
    pub level: bool,
    /// The run of each cell, padded for reads beyond the last.
    pub of: Vec<i16>,
    order: Vec<u64>,
    spare: Vec<u64>,
}

/// A range of the sorted values.
#[repr(C, align(64))]
pub struct Run {
    /// Positions of the members in the block, along x and y, padded with positions that no circle contains. Unused in a
    /// level run.
    pub xs: [i16; MEMBERS],
    pub ys: [i16; MEMBERS],
    /// The rank of the first member.
    pub first: u32,
    /// True if all values are equal; the number of members is then not limited.
    pub level: bool,
}

impl Block {
    /// Loads the values around cells from [x, y] on, and sorts them.
    ///
    /// The block is transposed if the terrain slopes along its columns rather than its rows, since ranks change least
    /// along contours.
    pub fn load(&mut self, from: &Padded, [x, y]: [usize; 2], cells: [usize; 2], steps: &Steps) {
        let [width, height] = cells.map(|count| count + 2 * steps.reach());
        let at = |i: usize, j: usize| from.samples[(y + j) * from.width + x + i];
        let pace = (steps.reach() / 2).max(1);
        let mut falls = 0_i32;
        for j in (0..height - pace).step_by(pace) {
            for i in (0..width - pace).step_by(pace) {
                let (here, right, down) = (at(i, j), at(i + pace, j), at(i, j + pace));
                falls += if (down - here).abs() > (right - here).abs() { 1 } else { -1 };
            }
        }
        self.turned = falls > 0;
        self.width = if self.turned { height } else { width };
        let [along, down] = if self.turned { [16, 0] } else { [0, 16] };
        self.order.clear();
        for j in 0..height {
            let row = &from.samples[(y + j) * from.width + x..][..width];
            self.order.extend(row.iter().enumerate().map(|(i, v)| ordered(*v) << 32 | (i << along | j << down) as u64));
        }
        sort(&mut self.order, &mut self.spare);
        self.divide();
    }

    /// Divides the sorted values into runs.
    fn divide(&mut self) {
        let count = self.order.len();
        self.of.resize(count + LANES, 0);
        self.values.clear();
        self.values.extend(self.order.iter().map(|entry| from_ordered(entry >> 32)));
        self.runs.clear();
        self.level = false;
        let mut first = 0;
        while first < count {
            let rest = &self.order[first..];
            let equal = rest.iter().take_while(|entry| *entry >> 32 == rest[0] >> 32).count();
            let level = equal >= LEVEL;
            let members = &rest[..if level { equal } else { MEMBERS.min(rest.len()) }];
            let number = self.runs.len() as i16;
            let mut run = Run { xs: [i16::MAX / 2; MEMBERS], ys: [i16::MAX / 2; MEMBERS], first: first as u32, level };
            for (k, entry) in members.iter().enumerate() {
                let (x, y) = (*entry as u16, (*entry >> 16) as u16);
                if !level {
                    (run.xs[k], run.ys[k]) = (x as i16, y as i16);
                }
                self.of[usize::from(y) * self.width + usize::from(x)] = number;
            }
            self.runs.push(run);
            self.level |= level;
            first += members.len();
        }
    }
}

/// Stable radix sort by the upper halves of numbers, least significant digit first, over the bits in which they differ.
fn sort(numbers: &mut Vec<u64>, spare: &mut Vec<u64>) {
    let (least, most) = numbers.iter().fold((u64::MAX, 0), |(least, most), n| (least.min(*n), most.max(*n)));
    let least = least >> 32 << 32;
    let bits = u64::BITS - ((most - least) >> 32).leading_zeros();
    let digits = bits.div_ceil(DIGIT);
    spare.resize(numbers.len(), 0);
    for at in 0..digits {
        let bits = bits.div_ceil(digits);
        let digit = |number: u64| ((number - least) >> (32 + at * bits)) as usize & ((1 << bits) - 1);
        let mut places = [0_u32; 1 << DIGIT];
        for &number in numbers.iter() {
            places[digit(number)] += 1;
        }
        let mut before = 0;
        for place in &mut places[..1 << bits] {
            (*place, before) = (before, before + *place);
        }
        for &number in numbers.iter() {
            let place = &mut places[digit(number)];
            spare[*place as usize] = number;
            *place += 1;
        }
        std::mem::swap(numbers, spare);
    }
}
