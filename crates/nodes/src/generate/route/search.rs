//! The least-cost way between two cells of a grid.
//!
//! E. Galin, A. Peytavie, N. Maréchal and E. Guérin (2010), "Procedural generation of roads": a way steps to cells at a
//! distance, in many directions, and costs what its grade asks for. The search is A* with the straight distance, which
//! no way undercuts (P. E. Hart, N. J. Nilsson and B. Raphael, 1968).
//!
//! Turns cost too, so that a way zigzags in long stretches. What a turn costs depends on where a way comes from, and only
//! the cheapest way to each cell is kept: with turns, the way found is a good one, and not always the cheapest.

use std::{cmp::Reverse, collections::BinaryHeap};

use orograph_graph::memory::filled;

use crate::prelude::*;

/// Farthest cell of a step along either axis.
const FAR: i32 = 4;
/// Times the grade from which on ground is equally hard.
const STEEPEST: f64 = 100.0;
/// Cells between two checks for cancellation.
const CHECK: usize = 1 << 12;

/// Ground to be crossed.
pub struct Ground<'a> {
    pub columns: usize,
    pub rows: usize,
    /// Side of its cells.
    pub cell_m: f64,
    pub heights: &'a [f32],
    /// Factors of the cost, at least 1.
    pub factors: &'a [f32],
    /// Rise over run at which a metre costs twice as much as on level ground.
    pub grade: f64,
    /// Half of the cost of turning back, in metres of level ground.
    pub turn: f64,
}

/// A step to another cell, in pieces that end between two neighbouring cells.
struct Stride {
    by: [i32; 2],
    /// Length in cells.
    length: f64,
    /// The end of each piece: the offsets of two cells and the share of the second.
    ends: Vec<([isize; 2], f64)>,
}

/// What is known of the cells, for one search after the other.
pub struct Search<'a> {
    ground: Ground<'a>,
    strides: Vec<Stride>,
    /// The costs of a turn from each stride to each.
    turns: Vec<f64>,
    /// The least cost so far.
    costs: Vec<f64>,
    /// One more than the stride that leads to a cell; 0 where none does.
    strode: Vec<u8>,
}

impl<'a> Search<'a> {
    /// # Errors
    /// When there is not enough memory.
    pub fn new(ground: Ground<'a>) -> Result<Self, NodeError> {
        let count = ground.columns * ground.rows;
        let strides = strides(ground.columns);
        let cosine = |a: &Stride, b: &Stride| {
            let [x, y] = [0, 1].map(|axis| f64::from(a.by[axis] * b.by[axis]));
            (x + y) / (a.length * b.length)
        };
        let pairs = strides.iter().flat_map(|a| strides.iter().map(move |b| cosine(a, b)));
        let turns = pairs.map(|cosine| ground.turn * (1.0 - cosine).max(0.0)).collect();
        Ok(Self { strides, turns, costs: filled(count, f64::INFINITY)?, strode: filled(count, 0)?, ground })
    }

    /// The cells of the least-cost way, from the start to the goal.
    ///
    /// # Errors
    /// The error of `check`.
    pub fn way(
        &mut self,
        [start, goal]: [usize; 2],
        check: &dyn Fn() -> Result<(), NodeError>,
    ) -> Result<Vec<usize>, NodeError> {
        self.costs.fill(f64::INFINITY);
        self.strode.fill(0);
        self.costs[start] = 0.0;
        // costs are not negative, so that their bits have the same order; equal ones are taken by the number of the cell
        let mut most = (self.costs.len() / 2).max(CHECK);
        let mut open = BinaryHeap::from([Reverse((self.straight(start, goal).to_bits(), start))]);
        for turn in 0.. {
            if turn % CHECK == 0 {
                check()?;
            }
            let Some(Reverse((total, cell))) = open.pop() else { break };
            if cell == goal {
                break;
            }
            if f64::from_bits(total) > self.costs[cell] + self.straight(cell, goal) {
                // a cheaper way was found meanwhile
                continue;
            }
            self.stride_on(cell, goal, &mut open);
            if open.len() > most {
                open.retain(|Reverse((total, cell))| {
                    f64::from_bits(*total) <= self.costs[*cell] + self.straight(*cell, goal)
                });
                most = most.max(2 * open.len());
            }
        }
        let mut way = vec![goal];
        while let Some(last) = way.last().copied().filter(|last| *last != start) {
            let Some(stride) = usize::from(self.strode[last]).checked_sub(1) else { break };
            let [x, y] = self.strides[stride].by;
            way.push((last as isize - x as isize - y as isize * self.ground.columns as isize) as usize);
        }
        way.reverse();
        Ok(way)
    }

    /// Tries all strides from a cell.
    fn stride_on(&mut self, cell: usize, goal: usize, open: &mut BinaryHeap<Reverse<(u64, usize)>>) {
        let Ground { columns, rows, .. } = self.ground;
        let [column, row] = [(cell % columns) as i32, (cell / columns) as i32];
        let before = usize::from(self.strode[cell]).checked_sub(1);
        for (index, stride) in self.strides.iter().enumerate() {
            let [x, y] = [column + stride.by[0], row + stride.by[1]];
            if x < 0 || y < 0 || x >= columns as i32 || y >= rows as i32 {
                continue;
            }
            let next = y as usize * columns + x as usize;
            let turn = before.map_or(0.0, |before| self.turns[before * self.strides.len() + index]);
            let cost = self.costs[cell] + self.ground.cost(cell, stride) + turn;
            if cost < self.costs[next] {
                self.costs[next] = cost;
                self.strode[next] = index as u8 + 1;
                open.push(Reverse(((cost + self.straight(next, goal)).to_bits(), next)));
            }
        }
    }

    /// The straight distance between two cells in metres, a little less for rounding.
    fn straight(&self, from: usize, to: usize) -> f64 {
        let Ground { columns, cell_m, .. } = self.ground;
        let [x, y] = [(from % columns).abs_diff(to % columns), (from / columns).abs_diff(to / columns)];
        (1.0 - 1e-9) * cell_m * ((x * x + y * y) as f64).sqrt()
    }
}

impl Ground<'_> {
    /// The cost of a stride in metres of level ground: that of a metre is `1 + (slope / grade)⁴`, times the factor.
    fn cost(&self, cell: usize, stride: &Stride) -> f64 {
        let at = |values: &[f32], ([a, b], share): &([isize; 2], f64)| {
            let [a, b] = [a, b].map(|offset| f64::from(values[cell.wrapping_add_signed(*offset)]));
            a + (b - a) * share
        };
        let piece_m = stride.length * self.cell_m / stride.ends.len() as f64;
        let (mut height, mut factor) = (f64::from(self.heights[cell]), f64::from(self.factors[cell]));
        let mut cost = 0.0;
        for end in &stride.ends {
            let (next, next_factor) = (at(self.heights, end), at(self.factors, end));
            let steep = ((next - height) / (piece_m * self.grade)).abs().min(STEEPEST);
            let square = steep * steep;
            cost += piece_m * (1.0 + square * square) * 0.5 * (factor + next_factor);
            (height, factor) = (next, next_factor);
        }
        cost
    }
}

/// The strides in all directions: to cells that no cell hides.
fn strides(columns: usize) -> Vec<Stride> {
    let offsets = (-FAR..=FAR).flat_map(|y| (-FAR..=FAR).map(move |x| [x, y]));
    offsets.filter(|[x, y]| divisor(x.unsigned_abs(), y.unsigned_abs()) == 1).map(|by| stride(by, columns)).collect()
}

fn stride(by: [i32; 2], columns: usize) -> Stride {
    let [x, y] = by;
    let count = x.abs().max(y.abs());
    let end = |k: i32| {
        let place = by.map(|along| f64::from(along * k) / f64::from(count));
        let low = place.map(f64::floor);
        let high = place.map(f64::ceil);
        let offset = |[x, y]: [f64; 2]| x as isize + y as isize * columns as isize;
        // one axis is whole
        ([offset(low), offset(high)], (place[0] - low[0]).max(place[1] - low[1]))
    };
    Stride { by, length: f64::from(x * x + y * y).sqrt(), ends: (1..=count).map(end).collect() }
}

/// The greatest common divisor.
fn divisor(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { divisor(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn way(columns: usize, rows: usize, heights: &[f32], grade: f64) -> (Vec<usize>, f64) {
        let factors = vec![1.0; heights.len()];
        let ground = Ground { columns, rows, cell_m: 10.0, heights, factors: &factors, grade, turn: 0.0 };
        let mut search = Search::new(ground).expect("memory");
        let goal = heights.len() - 1;
        let way = search.way([0, goal], &|| Ok(())).expect("a way");
        (way, search.costs[goal])
    }

    #[test]
    fn there_are_48_directions_and_no_stride_skips_a_cell() {
        let strides = strides(100);
        assert_eq!(strides.len(), 48);
        let knight = strides.iter().find(|stride| stride.by == [2, 1]).expect("there is one");
        assert_eq!(knight.ends, [([1, 101], 0.5), ([102, 102], 0.0)]);
    }

    /// Where turns cost nothing, the search finds what relaxation of all edges until nothing changes finds.
    #[test]
    fn the_way_is_the_cheapest_of_all() {
        let (columns, rows) = (17, 13);
        for seed in 0..5_u32 {
            let heights: Vec<f32> = (0..columns * rows)
                .map(|at| (orograph_graph::mix(at as u32 ^ (seed << 20)) % 97) as f32 * 0.1)
                .collect();
            let (path, cost) = way(columns, rows, &heights, 0.2);
            assert_eq!((path[0], path[path.len() - 1]), (0, columns * rows - 1));
            let factors = vec![1.0; heights.len()];
            let ground =
                Ground { columns, rows, cell_m: 10.0, heights: &heights, factors: &factors, grade: 0.2, turn: 0.0 };
            let mut costs = vec![f64::INFINITY; heights.len()];
            costs[0] = 0.0;
            let strides = strides(columns);
            loop {
                let before = costs.clone();
                for cell in 0..heights.len() {
                    for stride in &strides {
                        let [x, y] = [(cell % columns) as i32 + stride.by[0], (cell / columns) as i32 + stride.by[1]];
                        if (0..columns as i32).contains(&x) && (0..rows as i32).contains(&y) {
                            let next = y as usize * columns + x as usize;
                            costs[next] = costs[next].min(costs[cell] + ground.cost(cell, stride));
                        }
                    }
                }
                if costs == before {
                    break;
                }
            }
            assert_eq!(cost, costs[heights.len() - 1]);
        }
    }
}
