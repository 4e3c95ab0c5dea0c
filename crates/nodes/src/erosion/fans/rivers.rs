//! Rivers that fans have buried find a new way around the toe, and gravel fills the ground that remains dammed.

use std::{cmp::Reverse, collections::BinaryHeap};

use orograph_graph::{Job, NodeError};

use super::mouths::Streams;
use crate::numerics::{
    math,
    routing::{
        Elevation, Limits,
        code::{STEPS, is_diagonal},
        receivers,
    },
};

/// The deepest cut of a river through fans.
const DEEPEST_M: f64 = 12.0;
/// The longest cut of a river through fans.
const LONGEST_M: f64 = 20e3;
/// The slope of the banks that rivers cut into gravel, in degrees.
const BANK_DEGREES: f64 = 30.0;

/// What rivers do to the ground: sums over cells, in metres.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Moved {
    /// Gravel that fills the ground behind fans.
    pub filled_m: f64,
    /// Gravel and rock that rivers carry away.
    pub washed_m: f64,
    /// The rock among it.
    pub rock_m: f64,
}

impl Moved {
    fn cut(&mut self, ground_m: &mut f32, land_m: f32, to_m: f32) {
        let apart = |high_m: f32, low_m: f32| f64::from(high_m) - f64::from(low_m);
        self.washed_m += apart(*ground_m, to_m);
        self.rock_m += apart(land_m.min(*ground_m), land_m.min(to_m));
        *ground_m = to_m;
    }

    fn fill(&mut self, ground_m: &mut f32, to_m: f32) {
        self.filled_m += f64::from(to_m) - f64::from(*ground_m);
        *ground_m = to_m;
    }
}

/// Lets rivers through the fans on `ground`, which was `land` without them.
///
/// # Errors
/// [`NodeError::Cancelled`], or not enough memory.
pub(super) fn settle(job: &Job<'_>, streams: Streams, land: &[f32], ground: &mut [f32]) -> Result<Moved, NodeError> {
    let mut moved = Moved::default();
    let Streams { grid, mut codes, level_m, cells, mut depressions } = streams;
    drop(cells);
    // lakes stay: only what fans dam is a depression
    receivers::d8(job, &grid, ground, &mut codes)?;
    receivers::end_at_voids(&grid, |cell| level_m[cell] > ground[cell], &mut codes);
    drop(level_m);
    Streams::lead_out(job, &grid, ground, &mut codes, &mut depressions)?;
    let limits = Limits { depth_m: DEEPEST_M, length_m: LONGEST_M, cell_m: job.cell_m() };
    let drained = depressions.breach(job, &grid, ground, &codes, limits)?;
    let mut banks = BinaryHeap::new();
    for (cell, ground_m) in ground.iter_mut().enumerate() {
        let after = drained[cell];
        if after < *ground_m {
            moved.cut(ground_m, land[cell], after);
            banks.push(Reverse(after.pass(after, cell as u32)));
        } else if after > *ground_m {
            moved.fill(ground_m, after);
        }
    }
    // banks fall to a slope that gravel keeps, the lowest first
    let rise_m = job.cell_m() * math::tan(BANK_DEGREES.to_radians());
    while let Some(Reverse(foot)) = banks.pop() {
        let (level_m, cell) = (f32::pass_height(foot), f32::pass_link(foot));
        if level_m > ground[cell as usize] {
            continue;
        }
        for way in 0..STEPS.len() {
            let Some(beside) = grid.neighbour(cell, way) else { continue };
            let length = if is_diagonal(way) { std::f64::consts::SQRT_2 } else { 1.0 };
            let top_m = ((f64::from(level_m) + rise_m * length) as f32).max(land[beside as usize]);
            if top_m < ground[beside as usize] {
                moved.cut(&mut ground[beside as usize], land[beside as usize], top_m);
                banks.push(Reverse(top_m.pass(top_m, beside)));
            }
        }
    }
    Ok(moved)
}
