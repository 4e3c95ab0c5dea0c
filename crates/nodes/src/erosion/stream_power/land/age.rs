//! The land at an age, without steps.
//!
//! For n = 1 the law is an advection: what happens at an outlet travels upstream at the speed K Aᵐ. On a given drainage
//! network, with the travel time τ from the outlet (dτ = ds / (K Aᵐ)) and u = ∫ U dτ along the path, the height at the
//! time t is
//!
//! > h = z(t − τ) + u where τ ≤ t, with z the level of the outlet, and h = h₀(x\*) + u − u(x\*) elsewhere,
//!
//! x\* being the place downstream whose travel time is τ − t (Steer 2021; Tzathas, Gailleton, Steer and Cordonnier
//! 2024). The network of the result is not the given one, so network and heights are found again in a few rounds.
//!
//! What differs from the papers: x\* is found by jump pointers (Myers 1983), one for each cell, in a logarithmic number
//! of steps; the land is never higher than uplift alone would have it, which leaves the floors of lakes where they are.

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

use orograph_graph::{Job, NodeError, memory::with_capacity};

use super::{Asked, Land, Work};
use crate::numerics::{par, routing::code};

/// The longest travel time over one link, in ages: rock that does not erode.
const LONGEST_LINK: f64 = 1e6;

/// The way from a cell to its outlet.
#[derive(Clone, Copy, Debug, Default)]
struct Path {
    travel_yr: f64,
    /// The uplift over the travel time, in metres.
    risen_m: f64,
    /// Height of the outlet at the start, in metres.
    outlet_m: f64,
    /// How fast the outlet rises, in m/yr.
    outlet_rate: f64,
}

impl Land<'_> {
    /// Routes the land as it is, then puts it at its height at the time `end_yr` on this network. It was `start` at
    /// the time `begin_yr`, which is earlier.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn grow(
        &mut self,
        job: &Job<'_>,
        start: &[f32],
        [begin_yr, end_yr]: [f64; 2],
        round: u32,
    ) -> Result<(), NodeError> {
        let age_yr = end_yr - begin_yr;
        self.route(job, Some(round))?;
        self.wet(job)?;
        self.time_yr = end_yr;
        let mut heights = std::mem::take(&mut self.heights);
        let grown = self.heights_at(job, start, age_yr, &mut heights);
        self.heights = heights;
        grown?;
        self.cap(job)?;
        self.slide(job)
    }

    /// Lets the time `span_yr` pass at once, on the network of the land as it is; soil creeps afterwards.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn leap(&mut self, job: &Job<'_>, span_yr: f64, step: u32) -> Result<(), NodeError> {
        let mut start = with_capacity(self.heights.len())?;
        start.extend(self.heights.iter().map(|height| *height as f32));
        self.grow(job, &start, [self.time_yr, self.time_yr + span_yr], step)?;
        self.creep(job, span_yr, step, None)
    }

    /// The solution on the network as it is.
    fn heights_at(&self, job: &Job<'_>, start: &[f32], age_yr: f64, heights: &mut [f64]) -> Result<(), NodeError> {
        let nx = self.grid.nx;
        let (paths, ancestors) = self.paths(job, start, age_yr)?;
        par::each(heights.chunks_mut(nx), |y, heights| {
            job.check()?;
            for (cell, height) in (y * nx..).zip(heights) {
                let path = &paths[cell];
                let before_yr = path.travel_yr - age_yr;
                let grown = if before_yr <= 0.0 {
                    path.outlet_m - path.outlet_rate * before_yr + path.risen_m
                } else {
                    let [above, below] = self.origin(&paths, &ancestors, cell, before_yr);
                    let (far, near) = (&paths[above], &paths[below]);
                    let share = (before_yr - near.travel_yr) / (far.travel_yr - near.travel_yr);
                    let between = |near: f64, far: f64| near + (far - near) * share;
                    let origin_m = between(f64::from(start[below]), f64::from(start[above]));
                    origin_m + (path.risen_m - between(near.risen_m, far.risen_m))
                };
                *height = grown.min(f64::from(start[cell]) + self.rate(cell) * age_yr);
            }
            Ok(())
        })
    }

    /// How fast a cell moves without erosion, in m/yr.
    fn rate(&self, cell: usize) -> f64 {
        self.tectonics.rate(cell, self.is_base(cell))
    }

    /// By how much the law wears the land down in a year, as far as it is asked for.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn wear(&mut self, job: &Job<'_>, asked: Asked) -> Result<Work, NodeError> {
        if !asked.any() {
            return Ok(Work::default());
        }
        let links = self.links(1.0);
        let wear = |cell: usize| {
            let code = self.codes[cell];
            if !code::has_receiver(code) {
                return 0.0;
            }
            let drop = self.heights[cell] - self.heights[self.grid.receiver(cell as u32, code) as usize];
            links.of(cell, code).0 * drop.max(0.0)
        };
        let (lowered, mut flux) = asked.split(par::map(self.heights.len(), wear));
        if let Some(flux) = &mut flux {
            self.drainage.accumulate(job, &self.grid, &self.codes, flux)?;
        }
        Ok(Work { lowered, flux })
    }

    /// The way of every cell, and for each its depth in the tree above the number of an ancestor.
    fn paths(&self, job: &Job<'_>, start: &[f32], age_yr: f64) -> Result<(Vec<Path>, Vec<AtomicU64>), NodeError> {
        let cells = self.codes.len();
        let ancestors: Vec<AtomicU64> = (0..cells as u64).map(AtomicU64::new).collect();
        let outlet = |cell: usize| Path {
            travel_yr: 0.0,
            risen_m: 0.0,
            outlet_m: f64::from(start[cell]),
            outlet_rate: self.rate(cell),
        };
        let mut paths: Vec<Path> = par::map(cells, outlet);
        let (links, longest_yr) = (self.links(1.0), LONGEST_LINK * age_yr);
        self.drainage.upstream(job, &self.grid, &self.codes, &mut paths, |cell, code, _, below| {
            let receiver = self.grid.receiver(cell as u32, code);
            // The receiver and all below it have been visited, by this thread or before it began.
            ancestors[cell].store(ancestor(&ancestors, receiver), Relaxed);
            let (per_yr, _) = links.of(cell, code);
            let link_yr = (1.0 / per_yr).min(longest_yr);
            Path { travel_yr: below.travel_yr + link_yr, risen_m: below.risen_m + self.rate(cell) * link_yr, ..below }
        })?;
        Ok((paths, ancestors))
    }

    /// The two cells on the way of `cell` between which the travel time is `travel_yr`: the last above it, and its
    /// receiver.
    fn origin(&self, paths: &[Path], ancestors: &[AtomicU64], cell: usize, travel_yr: f64) -> [usize; 2] {
        let mut at = cell;
        loop {
            let jump = ancestors[at].load(Relaxed) as u32 as usize;
            if paths[jump].travel_yr > travel_yr {
                at = jump;
                continue;
            }
            let receiver = self.grid.receiver(at as u32, self.codes[at]) as usize;
            if paths[receiver].travel_yr <= travel_yr {
                return [at, receiver];
            }
            at = receiver;
        }
    }

    /// Lowers links that are steeper than repose, receivers first.
    fn cap(&mut self, job: &Job<'_>) -> Result<(), NodeError> {
        let mut heights = std::mem::take(&mut self.heights);
        let links = self.links(1.0);
        let capped = self.drainage.upstream(job, &self.grid, &self.codes, &mut heights, |cell, code, height, below| {
            let highest = below + self.steepest.at(cell) * links.of(cell, code).1;
            if height > highest { highest } else { height }
        });
        self.heights = heights;
        capped
    }
}

/// The entry of a cell from that of its receiver: jumps are as long as two equally long ones below them, or one link.
fn ancestor(ancestors: &[AtomicU64], receiver: u32) -> u64 {
    let entry = |cell: u32| {
        let entry = ancestors[cell as usize].load(Relaxed);
        (entry >> 32, entry as u32)
    };
    let (depth, jump) = entry(receiver);
    let (jump_depth, second) = entry(jump);
    let (second_depth, _) = entry(second);
    let to = if depth - jump_depth == jump_depth - second_depth { second } else { receiver };
    (depth + 1) << 32 | u64::from(to)
}

#[cfg(test)]
mod tests {
    use super::{
        super::{Footing, Land},
        *,
    };
    use crate::{
        erosion::stream_power::{Inputs, NODE, Params, tests::white},
        prelude::*,
        testing,
    };

    /// The plain reference: every way walked cell by cell until the age has passed.
    fn walk(job: &Job<'_>) -> Result<Outputs, NodeError> {
        let (params, start) = (Params::read(job.params), Inputs::read(job)?.height);
        let mut land = Land::new(job, &params, start, Footing::default())?;
        let start = start.samples();
        land.grow(job, start, [0.0, params.duration], 0)?;
        let links = land.links(1.0);
        let mut ends = [0; 2];
        for (cell, &found) in land.heights.iter().enumerate() {
            let (mut at, mut left_yr, mut risen_m) = (cell, params.duration, 0.0);
            let expected = loop {
                let code = land.codes[at];
                if !code::has_receiver(code) {
                    ends[0] += 1;
                    break f64::from(start[at]) + land.rate(at) * left_yr + risen_m;
                }
                let link_yr = 1.0 / links.of(at, code).0;
                let receiver = land.grid.receiver(at as u32, code) as usize;
                risen_m += land.rate(at) * link_yr.min(left_yr);
                if link_yr > left_yr {
                    ends[1] += 1;
                    let drop = f64::from(start[at]) - f64::from(start[receiver]);
                    break f64::from(start[at]) - drop * left_yr / link_yr + risen_m;
                }
                left_yr -= link_yr;
                at = receiver;
            };
            let expected = expected.min(f64::from(start[cell]) + land.rate(cell) * params.duration);
            // Sums of travel times of some 10 Myr, in years, in double precision.
            assert!((found - expected).abs() < 1e-6, "{cell}: {found} {expected}");
        }
        assert!(ends.iter().all(|&count| count > 100), "{ends:?}");
        Ok(Outputs::default())
    }

    #[test]
    fn every_height_is_that_of_the_plain_walk() {
        let world = testing::world(90, 140, 50.0);
        let height = testing::field(world, |x, y| 300.0 * white(x, y) + 0.02 * x);
        let uplift = testing::field(world, |x, y| 1e-7 * (x - 0.3 * y));
        let erodibility = testing::field(world, |x, _| if x < 2000.0 { 1e-5 } else { 3e-5 });
        let repose = Field::constant(Window::whole(world), 90.0);
        let fields = [("height", &height), ("uplift", &uplift), ("erodibility", &erodibility), ("repose", &repose)];
        let node = Node { cpu: walk, inputs: NODE.inputs, params: NODE.params, reads_sea: true, ..Node::DEFAULT };
        for changes in ["duration=3e4,base_level_fall=0.0005", "duration=1e5,receivers=d8", "duration=2e5,m=0.4"] {
            testing::outputs(&node, &testing::with_params(&NODE, changes), &fields).expect("heights");
        }
    }
}
