//! Runout: debris runs down, leaves a sheet where the ground is gentle, and fills hollows.
//!
//! The thickness of the sheet is V^(1/3) / `spread`, so that a deposit of the volume V covers `spread` V^(2/3) (R. M. Iverson,
//! S. P. Schilling and J. W. Vallance 1998; J. P. Griswold and R. M. Iverson 2008). Cells are visited from high to low; what
//! a cell does not keep is distributed to its lower neighbours. In a hollow the debris rises until it spills.

use std::{cmp::Reverse, collections::BinaryHeap};

use super::{
    land::{Exit, Land, Room},
    wedge::noise,
};
use crate::numerics::{math, routing::code::STEPS};

/// Slope of the surface of debris that fills a hollow, away from where it comes in.
const FILL_SLOPE: f64 = 0.05;
/// Fills of an event after which their surfaces are level: those cannot hand debris back and forth.
const SLOPING_FILLS: usize = 64;
/// Debris thinner than this part of the sheet stays where it is.
const FILM: f64 = 0.02;
/// How sharply a deposit ends: how fast debris that is as thick as its sheet settles.
const SETTLING: f64 = 2.0;
/// Times that the edges of a deposit sink, the part of their excess that moves at once, and the least thickness that does.
const SWEEPS: usize = 12;
const RELAXED: f64 = 0.2;
const LEAST_MOVE_M: f64 = 0.01;
/// Thickness in metres from which a cell belongs to a deposit.
const SHOWN_M: f64 = 0.05;

/// What debris does in an event.
#[derive(Clone, Copy, Debug)]
pub(super) struct Law {
    /// Thickness of the sheet on level ground, in metres.
    pub sheet_m: f64,
    /// Tangent of the slope from which nothing stays.
    pub steepest: f64,
    /// Size of the bumps of the sheet in metres.
    pub bump_m: f64,
    pub seed: u32,
}

/// How far debris came.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Reach {
    /// Horizontal distance from the crown to the farthest debris, in metres.
    pub runout_m: f64,
    /// Fall from the crown to that debris, in metres.
    pub drop_m: f64,
}

/// An integer with the order of heights that are finite.
fn rank(height_m: f64) -> u64 {
    let bits = height_m.to_bits();
    if bits >> 63 == 1 { !bits } else { bits | 1 << 63 }
}

/// The debris of an event on its way.
struct Flow<'a> {
    land: &'a mut Land,
    room: &'a mut Room,
    law: Law,
    /// Cells with moving debris, the highest first, then the first.
    open: BinaryHeap<(u64, Reverse<u32>)>,
    touched: Vec<u32>,
    fills: usize,
}

/// Moves volumes in m³ from their cells to rest. `crown` is the cell that distances are measured from, and `crown_m` its
/// height before the event.
pub(super) fn run_out(
    land: &mut Land,
    room: &mut Room,
    law: Law,
    sources: &[(u32, f64)],
    (crown, crown_m): (usize, f64),
) -> Reach {
    let cell_m2 = land.cell_m2();
    let mut flow = Flow { land, room, law, open: BinaryHeap::new(), touched: Vec::new(), fills: 0 };
    for (cell, volume) in sources {
        flow.send(*cell as usize, volume / cell_m2, f64::INFINITY);
    }
    while let Some((_, Reverse(cell))) = flow.open.pop() {
        flow.pass(cell as usize);
    }
    flow.relax();
    let Flow { land, room, touched, .. } = flow;
    let mut reach = Reach::default();
    for cell in touched {
        let cell = cell as usize;
        room.from_m[cell] = f64::NEG_INFINITY;
        let laid = std::mem::take(&mut room.laid[cell]);
        if laid > SHOWN_M {
            let runout_m = land.distance_m(crown, cell);
            if runout_m > reach.runout_m {
                reach = Reach { runout_m, drop_m: crown_m - land.ground[cell] };
            }
        }
    }
    reach
}

impl Flow<'_> {
    /// Adds moving debris to a cell, from a surface at `from_m`.
    fn send(&mut self, cell: usize, depth_m: f64, from_m: f64) {
        let moving = &mut self.room.moving[cell];
        if *moving == 0.0 {
            self.open.push((rank(self.land.ground[cell]), Reverse(cell as u32)));
            self.touched.push(cell as u32);
        }
        *moving += depth_m;
        self.room.from_m[cell] = self.room.from_m[cell].max(from_m);
    }

    /// Lets a part of the debris of a cell settle, and sends the rest down.
    fn pass(&mut self, cell: usize) {
        let moving = std::mem::take(&mut self.room.moving[cell]);
        let exit = self.land.exit(cell);
        if moving <= 0.0 {
            return;
        }
        if exit == Exit::Always {
            self.land.ledger.left += moving * self.land.cell_m2();
            return;
        }
        let z = self.land.ground[cell];
        let beside: [Option<usize>; 8] = std::array::from_fn(|way| self.land.neighbour(cell, way));
        let fall = |land: &Land, from: f64, way: usize| match beside[way] {
            Some(to) => (from - land.ground[to]) / land.length_m(way),
            None => 0.0,
        };
        let slope = (0..STEPS.len()).map(|way| fall(self.land, z, way)).fold(0.0, f64::max);
        let bump = noise(self.land.centre_m(cell).map(|at| at / self.law.bump_m), self.law.seed);
        let sheet = self.law.sheet_m * (1.0 - slope / self.law.steepest).max(0.0) * (1.0 + 0.6 * bump);
        // what the sheet still lacks; thin debris stops earlier
        let lacks = (sheet - self.room.laid[cell]).max(0.0);
        let stays = if moving <= FILM * self.law.sheet_m {
            moving
        } else {
            let stays = (moving * (1.0 - math::exp(-SETTLING * lacks / moving))).min(lacks);
            stays.min((self.room.from_m[cell] - z).max(0.0))
        };
        self.room.laid[cell] += stays;
        self.land.settle(cell, stays);
        let rest = moving - stays;
        if rest <= 0.0 {
            return;
        }
        let surface = self.land.ground[cell];
        let weights: [f64; 8] = std::array::from_fn(|way| {
            let fall = fall(self.land, surface, way).max(0.0);
            fall * fall
        });
        let sum: f64 = weights.iter().sum();
        if sum > 0.0 {
            for way in 0..STEPS.len() {
                if let (Some(to), true) = (beside[way], weights[way] > 0.0) {
                    self.send(to, rest * (weights[way] / sum), surface);
                }
            }
        } else if exit == Exit::IfLowest {
            self.land.ledger.left += rest * self.land.cell_m2();
        } else {
            self.fill(cell, rest);
        }
    }

    /// Lets the edges of the deposit sink to the slope from which debris stays.
    fn relax(&mut self) {
        self.touched.sort_unstable();
        self.touched.dedup();
        let law = self.law;
        let mut edge: Vec<u32> = self.touched.clone();
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
                        if self.room.laid[to] == 0.0 {
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

    /// Fills the hollow around a cell with a depth of debris of one cell, until it is used up or spills.
    fn fill(&mut self, cell: usize, mut rest: f64) {
        self.fills += 1;
        let slope = if self.fills > SLOPING_FILLS { 0.0 } else { FILL_SLOPE };
        // how much lower than at the cell the surface is
        let lower = |flow: &Self, at: usize| {
            let [x, y] = flow.land.offset_m(flow.land.centre_m(cell), at);
            let bump = noise(flow.land.centre_m(at).map(|at| at / flow.law.bump_m), flow.law.seed);
            slope * math::hypot(x, y) * (1.0 + 0.5 * bump)
        };
        let mut level = self.land.ground[cell];
        let mut pool = vec![(cell, 0.0)];
        let mut rim: BinaryHeap<Reverse<(u64, u32)>> = BinaryHeap::new();
        let mut heights = std::collections::BTreeMap::new();
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
                self.room.laid[cell] += depth;
                self.touched.push(cell as u32);
            }
        }
        if let Some(next) = spills {
            self.send(next, rest, f64::INFINITY);
        }
    }
}
