//! Runout: debris runs down, leaves a sheet where the ground is gentle, and fills hollows.
//!
//! The thickness of the sheet is V^(1/3) / `spread`, so that a deposit of the volume V covers `spread` V^(2/3) (R. M.
//! Iverson, S. P. Schilling and J. W. Vallance 1998; J. P. Griswold and R. M. Iverson 2008). Cells are visited from
//! high to low; what a cell does not keep is distributed to its lower neighbours. In a hollow the debris rises until it
//! spills.
//!
//! An energy line sinks from the crown of the scar along the path of the debris, by the tangent of the angle of reach
//! per metre (A. Heim 1932; J. Corominas 1996). Where it meets the ground, debris has no energy left and piles up.

use std::collections::BinaryHeap;

use orograph_graph::mix;

use super::{
    land::{Exit, Land, Room},
    noise::Bumps,
};
use crate::numerics::{math, routing::code::STEPS};

/// Debris thinner than this part of the sheet stays where it is.
const FILM: f64 = 0.02;
/// How sharply a deposit ends: how fast debris that is as thick as its sheet settles.
const SETTLING: f64 = 2.0;
/// Thickness of debris that has no energy left, in sheets. With 5, every small slide ends in a mound of its own, and the
/// ground below a cliff is covered with mounds of one size; with 2, slides go farther than the angle of reach says.
const HEAP: f64 = 3.0;
/// How the tangent of the angle of reach falls with the volume.
const REACH_POWER: f64 = -0.085;
/// Thickness in metres from which a cell belongs to a deposit.
const SHOWN_M: f64 = 0.05;

/// What debris does in an event.
#[derive(Clone, Copy, Debug)]
pub(super) struct Law {
    /// Thickness of the sheet on level ground, in metres.
    pub sheet_m: f64,
    /// Tangent of the slope from which nothing stays.
    pub steepest: f64,
    /// Tangent of the angle of reach; 0 where only the sheet stops debris.
    pub reach: f64,
    /// The bumps of the sheet.
    pub bumps: Bumps,
}

/// Returns the tangent of the angle of reach of a volume in m³, from that of 1 m³.
pub(super) fn reach(of_one: f64, volume_m3: f64) -> f64 {
    of_one * math::pow(volume_m3.max(1.0), REACH_POWER)
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
pub(super) fn rank(height_m: f64) -> u64 {
    let bits = height_m.to_bits();
    if bits >> 63 == 1 { !bits } else { bits | 1 << 63 }
}

/// Where debris comes from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Origin {
    /// The highest surface, above which debris does not rise.
    pub surface_m: f64,
    /// Elevation of the energy line.
    pub line_m: f64,
}

/// The debris of an event on its way.
pub(super) struct Flow<'a> {
    pub land: &'a mut Land,
    pub room: &'a mut Room,
    pub law: Law,
    /// Cells with moving debris, the highest first. Equal ones follow in the order of a hash: another order would turn
    /// the debris on planes to one side.
    open: BinaryHeap<(u64, u32, u32)>,
    pub touched: Vec<u32>,
    pub fills: usize,
}

/// Moves volumes in m³ from their cells to rest. `crown` is the cell that distances are measured from, and `crown_m`
/// its height before the event.
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
        let line_m = crown_m - law.reach * flow.land.distance_m(crown, *cell as usize);
        flow.send(*cell as usize, volume / cell_m2, Origin { surface_m: f64::INFINITY, line_m });
    }
    while let Some((.., cell)) = flow.open.pop() {
        flow.pass(cell as usize);
    }
    flow.smooth();
    flow.relax();
    let Flow { land, room, touched, .. } = flow;
    let mut reach = Reach::default();
    for cell in touched {
        let cell = cell as usize;
        room.from_m[cell] = f64::NEG_INFINITY;
        room.energy[cell] = 0.0;
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
    /// Adds moving debris to a cell.
    pub fn send(&mut self, cell: usize, depth_m: f64, from: Origin) {
        let moving = &mut self.room.moving[cell];
        if *moving == 0.0 {
            self.open.push((rank(self.land.ground[cell]), mix(cell as u32), cell as u32));
        }
        *moving += depth_m;
        self.room.energy[cell] += depth_m * from.line_m;
        let from_m = &mut self.room.from_m[cell];
        if *from_m == f64::NEG_INFINITY {
            self.touched.push(cell as u32);
        }
        *from_m = from_m.max(from.surface_m);
    }

    /// Lets a part of the debris of a cell settle, and sends the rest down.
    fn pass(&mut self, cell: usize) {
        let moving = std::mem::take(&mut self.room.moving[cell]);
        let energy = std::mem::take(&mut self.room.energy[cell]);
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
        let bump = self.law.bumps.at(self.land.centre_m(cell));
        // the mean of the energy lines of all debris that has come here
        let line_m = energy / moving;
        let heap = if self.law.reach > 0.0 && line_m <= z { HEAP } else { 1.0 };
        let sheet = heap * self.law.sheet_m * (1.0 - slope / self.law.steepest).max(0.0) * (1.0 + 0.6 * bump / heap);
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
                    // what flows on over a heap has the energy of its surface
                    let line_m = line_m.max(surface) - self.law.reach * self.land.length_m(way);
                    self.send(to, rest * (weights[way] / sum), Origin { surface_m: surface, line_m });
                }
            }
        } else if exit == Exit::IfLowest {
            self.land.ledger.left += rest * self.land.cell_m2();
        } else {
            self.fill(cell, rest, line_m);
        }
    }
}
