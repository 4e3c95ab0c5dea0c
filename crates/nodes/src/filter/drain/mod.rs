//! Terrain without closed hollows: valleys are cut through the sills, and floors are filled.
//!
//! 1. Receivers and depressions of the terrain; water leaves each hollow over its lowest pass.
//! 2. The course: between the surface cut down to the lowest ground upstream and the one filled to the sills.
//! 3. Sides of the cuts: the module `sides`.
//! 4. The same again for hollows in these sides.
//!
//! After each routing, and after a last one, every cell is raised so that it falls by at least `fall` to its receiver.

mod sides;
#[cfg(test)]
mod tests;

use orograph_graph::memory::{copied, zeroed};

use crate::numerics::{
    math, par,
    routing::{Depressions, Drainage, Grid, code, drainage::Amount, receivers},
    voids,
};
use crate::prelude::*;

params! {
    /// From 0, which fills every hollow to its sill, to 1, which cuts every sill to the bottom of the hollow.
    cut: f64 = 0.75, One, 0.0..=1.0;
    /// Maximum slope that the sides of the cuts add to the terrain: the gentler, the wider the valleys.
    side_slope: f64 = 12.0, Degrees, 1.0..=80.0, soft 5..=40;
    /// Minimum slope along the flow, as metres of fall per metre: that of the new valley floors.
    fall: f64 = 0.002, One, 0.0..=1.0, soft 0.0..=0.02;
}

inputs! {
    /// Terrain height.
    height: Height;
}

outputs! {
    /// Terrain from which all water runs out of the world or into its sea.
    height: Height;
    /// Depth of the cuts.
    cut: Scalar(Metres);
    /// Thickness of the fill.
    fill: Scalar(Metres);
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Drain",
    category: "filter",
    summary: "Opens closed hollows: cuts valleys through their sills and fills their floors, so that all water runs out.",
    doc: include_str!("page.md"),
    sources: &[
        "J. B. Lindsay (2016), Efficient hybrid breaching-filling sink removal methods for flow path enforcement in \
         digital elevation models, Hydrological Processes 30, 846-857",
        "G. Cordonnier, B. Bovy and J. Braun (2019), A versatile, linear complexity algorithm for flow routing in \
         topographies with depressions, Earth Surface Dynamics 7, 549-562",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::World,
    reads_sea: true,
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    resolution: Resolution::Cells("smaller cells resolve more hollows and other passes"),
    example: "height: \"base\"",
    ..Node::DEFAULT
};

/// Rounds of cutting: the sides that a cut opens have hollows of their own.
const ROUNDS: usize = 2;

/// Memory that the kernel needs in addition to its inputs and outputs: codes, labels and donors of basins, the order of
/// cells, the lowest ground upstream, and heights before and after a round.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    sizing.cells(26.0 - 4.0 * Wants::among(sizing.wanted).count() as f64)
}

/// The lowest ground upstream.
#[derive(Clone, Copy, Debug)]
struct Lowest(f32);

impl Amount for Lowest {
    fn plus(self, other: Self) -> Self {
        if other.0 < self.0 { other } else { self }
    }
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let height = Inputs::read(job)?.height;
    let land = &*voids::filled(job, height.samples())?;
    let grid = Grid::new(&job.window())?;
    let (mut codes, mut order, mut lowest) = (zeroed(grid.cells())?, Drainage::default(), Vec::new());
    let mut depressions = Depressions::default();

    let slope = math::tan(params.side_slope.to_radians());
    let share = params.cut as f32;
    let fall_m = params.fall * job.cell_m();
    let mut drained = copied(land)?;
    for round in 0..=ROUNDS {
        let before = copied(&drained)?;
        route(job, &grid, &before, &mut codes, &mut depressions)?;
        lowest.clear();
        lowest.extend(before.iter().copied().map(Lowest));
        order.accumulate(job, &grid, &codes, &mut lowest)?;
        if round < ROUNDS {
            depressions.fill(&mut drained);
            par::change_with(&mut drained, &lowest, |filled, lowest| {
                *filled = lowest.0 + (1.0 - share) * (*filled - lowest.0);
            });
        }
        // no ground is left level, on which every cell would be a hollow of its own
        order.upstream(job, &grid, &codes, &mut drained, |_, code, own, below| {
            let least = (f64::from(below) + fall_m * code::length(code)) as f32;
            own.max(if least > below { least } else { below.next_up() })
        })?;
        if round < ROUNDS {
            let cuts = sides::cuts(job, &before, &drained, slope)?;
            sides::open(job, &grid, &cuts, &before, &mut drained)?;
        }
        job.advance(0.9 * (round + 1) as f32 / (ROUNDS + 1) as f32)?;
    }

    drop((codes, order, lowest, depressions));
    let wants = Wants::of(job);
    let of = |value: &(dyn Fn(usize) -> f32 + Sync)| Field::new(job.window(), par::map(land.len(), value));
    // voids remain
    let before = height.samples();
    let kept = |at: usize| if before[at].is_finite() { drained[at] } else { before[at] };
    let change = |at: usize| if before[at].is_finite() { drained[at] - before[at] } else { 0.0 };
    Ok(Given {
        height: wants.height.then(|| of(&kept)),
        cut: wants.cut.then(|| of(&|at| (-change(at)).max(0.0))),
        fill: wants.fill.then(|| of(&|at| change(at).max(0.0))),
    }
    .into())
}

/// Fills `codes` with receivers that lead out of the world or into the sea, over the lowest passes.
fn route(
    job: &Job<'_>,
    grid: &Grid,
    land: &[f32],
    codes: &mut [u8],
    depressions: &mut Depressions<f32>,
) -> Result<(), NodeError> {
    receivers::d8(job, grid, land, codes)?;
    if let Some(level) = job.sea_level() {
        receivers::end_at_sea(land, level, codes);
    }
    depressions.find(job, grid, land, codes)?;
    depressions.carve(job, grid, codes)
}
