//! Deposits: debris that fills hollows, and edges of sheets that sink.

use std::{
    cmp::Reverse,
    collections::{BTreeMap, BinaryHeap},
};

use super::{
    land::Exit,
    runout::{Flow, Origin, rank},
};
use crate::numerics::{math, routing::code::STEPS};

/// Slope of the surface of debris that fills a hollow, away from where it comes in.
const FILL_SLOPE: f64 = 0.05;
/// Fills of an event after which their surfaces are level: those cannot hand debris back and forth.
const SLOPING_FILLS: usize = 64;
/// Times that the edges of a deposit sink, the part of their excess that moves at once, and the least thickness that
/// does.
const SWEEPS: usize = 12;
const RELAXED: f64 = 0.2;
const LEAST_MOVE_M: f64 = 0.01;

/// Times that the surface of a deposit is smoothed, and the part of a difference in roughness that moves to a
/// neighbour.
const SMOOTHINGS: usize = 12;
const SMOOTHED: f64 = 1.0 / 16.0;

impl Flow<'_> {
    /// Smooths the surface of what this event has laid. Planes stay as they are: debris moves from cells that stand out
    /// from the mean of those around them to cells that lie below it.
    pub(super) fn smooth(&mut self) {
        self.touched.sort_unstable();
        self.touched.dedup();
        let deposit = self.deposit();
        for _ in 0..SMOOTHINGS {
            for &cell in &deposit {
                // the energy of debris that rests has no further use
                self.room.energy[cell as usize] = self.roughness_m(cell as usize);
            }
            for &cell in &deposit {
                let cell = cell as usize;
                for way in 0..STEPS.len() {
                    let Some(to) = self.land.neighbour(cell, way).filter(|to| self.lies(*to)) else { continue };
                    // from thick to thin: hollows of the ground do not fill
                    let laid = self.room.laid[cell].min(self.land.debris[cell]) - self.room.laid[to];
                    let moves = (SMOOTHED * (self.room.energy[cell] - self.room.energy[to])).min(0.5 * laid);
                    if moves > 0.0 {
                        self.land.shift(cell, to, moves);
                        self.room.laid[cell] -= moves;
                        self.room.laid[to] += moves;
                    }
                }
            }
        }
    }

    /// Returns true if this event has laid more than a film in a cell.
    fn lies(&self, cell: usize) -> bool {
        self.room.laid[cell] > LEAST_MOVE_M
    }

    /// Returns the cells of the deposit.
    fn deposit(&self) -> Vec<u32> {
        self.touched.iter().copied().filter(|cell| self.lies(*cell as usize)).collect()
    }

    /// Returns how far a cell of the deposit stands out from the mean of its neighbours in the deposit.
    fn roughness_m(&self, cell: usize) -> f64 {
        let beside = (0..STEPS.len()).filter_map(|way| self.land.neighbour(cell, way));
        let (sum, count) = beside
            .filter(|next| self.lies(*next))
            .fold((0.0, 0.0), |(sum, count), next| (sum + self.land.ground[next], count + 1.0));
        if count > 0.0 { self.land.ground[cell] - sum / count } else { 0.0 }
    }

    /// Lets the edges of the deposit sink to the slope from which debris stays.
    pub(super) fn relax(&mut self) {
        let law = self.law;
        let mut edge = self.deposit();
        for _ in 0..SWEEPS {
            let mut reached = Vec::new();
            for &cell in &edge {
                let cell = cell as usize;
                for way in 0..STEPS.len() {
                    let Some(to) = self.land.neighbour(cell, way) else { continue };
                    let excess = self.land.ground[cell] - self.land.ground[to] - law.steepest * self.land.length_m(way);
                    // only what this event has laid
                    let laid = self.room.laid[cell].min(self.land.debris[cell]);
                    let moves = (RELAXED * excess).min(laid);
                    if moves > LEAST_MOVE_M {
                        self.land.shift(cell, to, moves);
                        self.room.laid[cell] -= moves;
                        if !self.lies(to) {
                            reached.push(to as u32);
                        }
                        self.room.laid[to] += moves;
                    }
                }
            }
            self.touched.extend(&reached);
            edge.extend(reached);
        }
    }

    /// Fills the hollow around a cell with a depth of debris of one cell, until it is used up or spills. `line_m` is
    /// its energy line.
    pub(super) fn fill(&mut self, cell: usize, mut rest: f64, line_m: f64) {
        self.fills += 1;
        let slope = if self.fills > SLOPING_FILLS { 0.0 } else { FILL_SLOPE };
        // how much lower than at the cell the surface is
        let lower = |flow: &Self, at: usize| {
            let [x, y] = flow.land.offset_m(flow.land.centre_m(cell), at);
            let bump = flow.law.bumps.at(flow.land.centre_m(at));
            slope * math::hypot(x, y) * (1.0 + 0.5 * bump)
        };
        let mut level = self.land.ground[cell];
        let mut pool = vec![(cell, 0.0)];
        let mut rim: BinaryHeap<Reverse<(u64, u32)>> = BinaryHeap::new();
        let mut heights = BTreeMap::new();
        self.room.seen[cell] = true;
        let mut spills = None;
        let mut at = 0;
        loop {
            while at < pool.len() {
                for way in 0..STEPS.len() {
                    let Some(next) = self.land.neighbour(pool[at].0, way).filter(|next| !self.room.seen[*next]) else {
                        continue;
                    };
                    self.room.seen[next] = true;
                    let lower = lower(self, next);
                    let height = self.land.ground[next] + lower;
                    heights.insert(next as u32, (height, lower));
                    rim.push(Reverse((rank(height), next as u32)));
                }
                at += 1;
            }
            let Some(Reverse((_, next))) = rim.pop() else {
                level += rest / pool.len() as f64;
                rest = 0.0;
                break;
            };
            let (height, lower) = heights[&next];
            if height < level || self.land.exit(next as usize) != Exit::No && height <= level {
                spills = Some(next as usize);
                break;
            }
            let need = pool.len() as f64 * (height - level);
            if need >= rest {
                level += rest / pool.len() as f64;
                rest = 0.0;
                break;
            }
            (level, rest) = (height, rest - need);
            pool.push((next as usize, lower));
            if self.land.exit(next as usize) != Exit::No {
                spills = Some(next as usize);
                break;
            }
        }
        self.room.seen[cell] = false;
        heights.keys().for_each(|next| self.room.seen[*next as usize] = false);
        for (cell, lower) in pool {
            let depth = level - lower - self.land.ground[cell];
            if depth > 0.0 {
                self.land.settle(cell, depth);
                // a hollow may be filled by thousands of small amounts
                if self.room.laid[cell] == 0.0 {
                    self.touched.push(cell as u32);
                }
                self.room.laid[cell] += depth;
            }
        }
        if let Some(next) = spills {
            let line_m = (line_m - self.law.reach * self.land.distance_m(cell, next)).max(level);
            self.send(next, rest, Origin { surface_m: f64::INFINITY, line_m });
        }
    }
}
