//! Drainage of a surface by steepest descent, with its lakes.
//!
//! O'Callaghan and Mark (1984) for directions, Cordonnier, Bovy and Braun (2019) for depressions, Lindsay (2016) for
//! breaching; the method is described in [`crate::numerics::routing`].

use orograph_graph::memory::{copied, zeroed};

use crate::numerics::{
    drained::Drained,
    lakes, par,
    routing::{Depressions, Drainage, Grid, Limits, Spread, code, drainage::Amount, receivers, spread},
    voids,
};
use crate::prelude::*;

choice! {
    /// What happens to water in depressions.
    pub enum Sinks {
        /// It leaves through the lowest pass, along the path up from the bottom that a spilling lake would cut: every
        /// cell drains out of the world.
        Carve = "carve",
        /// It leaves through the lowest pass and crosses the lake on its surface, by the shortest path.
        Fill = "fill",
        /// Like `carve`, but `conditioned` is cut open where the cut is neither deep nor long.
        Breach = "breach",
        /// It reappears on the far side of the lowest pass.
        Jump = "jump",
        /// It stays at the bottom: every pit ends a river, as in dry basins and karst.
        Keep = "keep",
    }
}

choice! {
    /// How the water of a cell is distributed to its neighbours.
    pub enum Routing {
        /// All of it goes to the neighbour of steepest descent: rivers one cell wide.
        D8 = "d8",
        /// It is split between the two neighbours that bound the direction of steepest descent, so that slopes drain
        /// equally in every direction.
        DInfinity = "d_infinity",
        /// It is split among all lower neighbours, in proportion to a power of the slope: smooth maps of wetness.
        Mfd = "mfd",
    }
}

params! {
    /// What happens to water in depressions.
    depressions: Sinks = Sinks::Carve, One, ..;
    /// Maximum depth of a cut, for `breach`.
    breach_depth: f64 = 10.0, Metres, 0.0..=1e5, soft 0.0..=100.0, when depressions = "breach";
    /// Maximum length of a cut, for `breach`: from the bottom of a depression to ground that is not higher.
    breach_length: f64 = 500.0, Metres, 0.0..=1e6, soft 0.0..=5000.0, when depressions = "breach";
    /// How `area` is accumulated.
    routing: Routing = Routing::D8, One, ..;
    /// Exponent of the slope.
    ///
    /// At 1, flow spreads widely; from 8 upwards it is hardly wider than with `d8`.
    exponent: f64 = 1.1, One, 0.0..=20.0, soft 1..=8, when routing = "mfd";
}

inputs! {
    /// Terrain height.
    height: Height;
    /// Rain that runs off: the part that neither evaporates nor is used by plants. Negative values count as 0.
    runoff: Scalar(MetresPerYear) = 1.0, 0.0..=1e6, soft 0.0..=4.0;
    /// Where the terrain is known, such as `Import.data`. Water leaves where this is below one half.
    data: Option<Mask>;
}

outputs! {
    /// Drainage area of each cell, including its own.
    area: Scalar(SquareMetres);
    /// Directions, areas, discharge and water level, for nodes that use them.
    flow: Flow;
    /// Mean discharge through each cell.
    discharge: Scalar(CubicMetresPerSecond);
    /// Surface that water runs on: the terrain with depressions filled to the level at which they spill, or cut open.
    conditioned: Height;
    /// Depth of standing water, 0 on dry land.
    lake_depth: Scalar(Metres);
    /// Number of the lake, 0 on dry land.
    /// Connected water is one lake; lakes are numbered from 1 by their first cells, row by row from the north-west.
    lake: Scalar(Count);
    /// The neighbour that each cell drains to.
    /// 0 to 7 are E, NE, N, NW, W, SW, S, SE; -1 is where water leaves the world or stays, -2 where it jumps.
    direction: Scalar(Count);
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Flow",
    category: "hydrology",
    summary: "Drainage: where water flows, the area it drains, and lakes.",
    doc: include_str!("flow.md"),
    sources: &[
        "J. F. O'Callaghan and D. M. Mark (1984), The extraction of drainage networks from digital elevation data, \
         Computer Vision, Graphics, and Image Processing 28, 323-344",
        "D. G. Tarboton (1997), A new method for the determination of flow directions and upslope areas in grid \
         digital elevation models, Water Resources Research 33, 309-319",
        "T. G. Freeman (1991), Calculating catchment area with divergent flow based on a regular grid, Computers & \
         Geosciences 17, 413-422",
        "R. Barnes, C. Lehman and D. Mulla (2014), Priority-flood: an optimal depression-filling and \
         watershed-labeling algorithm for digital elevation models, Computers & Geosciences 62, 117-127",
        "G. Cordonnier, B. Bovy and J. Braun (2019), A versatile, linear complexity algorithm for flow routing in \
         topographies with depressions, Earth Surface Dynamics 7, 549-562",
        "J. B. Lindsay (2016), Efficient hybrid breaching-filling sink removal methods for flow path enforcement in \
         digital elevation models, Hydrological Processes 30, 846-857",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::World,
    reads_sea: true,
    scratch: Scratch::Bytes(scratch::scratch),
    refuses: Some(refuses),
    cpu: run,
    gpu: Some(&device::GPU),
    resolution: Resolution::Cells(
        "rivers are one cell wide, so the drainage area of a place depends on whether its cell has the river in it",
    ),
    example: "height: \"base\", depressions: keep",
    ..Node::DEFAULT
};

/// Seconds of a year of 365.25 days.
const SECONDS_PER_YEAR: f64 = 31_557_600.0;

/// Refuses jumps of water that spreads.
fn refuses(stated: &Stated<'_>) -> Result<(), NodeError> {
    let params = Params::read(stated.params);
    if params.depressions == Sinks::Jump && params.routing != Routing::D8 {
        return Err(NodeError::failed_with_hint(
            "water that spreads over several receivers cannot jump out of depressions",
            "set `routing: d8`, or other `depressions`",
        ));
    }
    Ok(())
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let Inputs { height, runoff, data } = Inputs::read(job)?;
    let land = height.samples();
    let grid = Grid::new(&job.window())?;
    refuses(&Stated::of_job(job))?;

    let wants = Wants::of(job);
    let gathers = [wants.area || wants.flow, wants.discharge || wants.flow];
    let fills = wants.flow || wants.conditioned || wants.lake_depth || wants.lake;
    let spreads = gathers.contains(&true) && params.routing != Routing::D8 && params.depressions != Sinks::Keep;
    let mut codes = zeroed(grid.cells())?;
    receivers::d8(job, &grid, land, &mut codes)?;
    if let Some(level) = job.sea_level() {
        receivers::end_at_sea(land, level, &mut codes);
    }
    if let Some(data) = data {
        receivers::end_at_voids(&grid, |cell| voids::is_void(data.samples()[cell]), &mut codes);
    }
    job.advance(0.1)?;
    let mut depressions = Depressions::default();
    if fills || spreads || params.depressions != Sinks::Keep {
        depressions.find(job, &grid, land, &codes)?;
    }
    job.advance(0.4)?;
    match params.depressions {
        Sinks::Carve | Sinks::Breach => depressions.carve(job, &grid, &mut codes)?,
        Sinks::Fill => depressions.cross(job, &grid, land, &mut codes)?,
        Sinks::Jump | Sinks::Keep => {}
    }
    job.advance(0.5)?;
    let level = if !fills && !spreads {
        Vec::new()
    } else if params.depressions == Sinks::Breach {
        let limits = Limits { depth_m: params.breach_depth, length_m: params.breach_length, cell_m: job.cell_m() };
        depressions.breach(job, &grid, land, &codes, limits)?
    } else {
        let mut level = copied(land)?;
        depressions.fill(&mut level);
        level
    };
    job.advance(0.6)?;

    let surface = if params.depressions == Sinks::Keep { land } else { &level };
    let water = Water { job, runoff, grid: &grid, codes: &codes, depressions: &depressions, surface, params: &params };
    let [area, discharge] = water.gather(gathers)?;
    job.advance(0.9)?;
    let stands = |at: usize| if level[at] > land[at] { level[at] - land[at] } else { 0.0 };
    let depth = (wants.lake_depth || wants.lake).then(|| par::map(land.len(), stands));
    let lake = depth.as_ref().filter(|_| wants.lake).map(|depth| lakes::numbers(job, depth)).transpose()?;
    let direction = (wants.direction || wants.flow).then(|| {
        let way = |&code: &u8| if code::has_receiver(code) { code::direction(code) as f32 } else { -1.0 };
        let mut direction = par::map_of(&codes, way);
        if params.depressions == Sinks::Jump {
            depressions.jumps(&grid).for_each(|pit| direction[pit as usize] = -2.0);
        }
        direction
    });
    let flow = match (&direction, &area, &discharge) {
        (Some(direction), Some(area), Some(discharge)) if wants.flow => {
            let drained = Drained { direction, area_m2: area, discharge_m3_per_s: discharge, level_m: &level };
            Some(drained.field(job.window()))
        }
        _ => None,
    };
    let field = |samples| Field::new(job.window(), samples);
    Ok(Given {
        area: area.filter(|_| wants.area).map(field),
        flow,
        discharge: discharge.filter(|_| wants.discharge).map(field),
        conditioned: wants.conditioned.then(|| field(level)),
        lake_depth: depth.filter(|_| wants.lake_depth).map(field),
        lake: lake.map(field),
        direction: direction.filter(|_| wants.direction).map(field),
    }
    .into())
}

/// Returns the runoff in metres per year.
fn runoff(rate: f32) -> f64 {
    if rate > 0.0 { f64::from(rate) } else { 0.0 }
}

/// Inputs of flow accumulation.
struct Water<'a> {
    job: &'a Job<'a>,
    /// In metres per year.
    runoff: Lane<'a>,
    grid: &'a Grid,
    codes: &'a [u8],
    depressions: &'a Depressions<f32>,
    /// The surface for dispersed flow.
    surface: &'a [f32],
    params: &'a Params,
}

impl Water<'_> {
    /// Returns drainage area in m² and discharge in m³/s, if wanted. Cells are counted exactly; variable runoff is
    /// summed in double precision.
    fn gather(&self, [area, discharge]: [bool; 2]) -> Result<[Option<Vec<f32>>; 2], NodeError> {
        let cell_m2 = self.job.cell_m() * self.job.cell_m();
        let per_s = cell_m2 / SECONDS_PER_YEAR;
        match (self.spread(), self.runoff) {
            _ if !(area || discharge) => Ok([None, None]),
            (None, Lane::Constant(rate)) => {
                let mut cells = vec![1_u32; self.grid.cells()];
                self.accumulate(&mut cells)?;
                let times = |each: f64| par::map_of(&cells, |&cells| (f64::from(cells) * each) as f32);
                Ok([area.then(|| times(cell_m2)), discharge.then(|| times(per_s * runoff(rate)))])
            }
            (None, Lane::Samples(rates)) if area && discharge => {
                let mut amounts = par::map_of(rates, |&rate| [1.0, runoff(rate)]);
                self.accumulate(&mut amounts)?;
                let times = |of: usize, each: f64| par::map_of(&amounts, |amount| (amount[of] * each) as f32);
                Ok([Some(times(0, cell_m2)), Some(times(1, per_s))])
            }
            (spread, rates) => {
                let gather = |weight: &(dyn Fn(usize) -> f64 + Sync)| {
                    let mut amounts = par::map(self.grid.cells(), weight);
                    match spread {
                        Some(spread) => {
                            spread::accumulate(self.job, self.grid, self.surface, self.codes, spread, &mut amounts)?;
                        }
                        None => self.accumulate(&mut amounts)?,
                    }
                    Ok::<_, NodeError>(amounts)
                };
                let times = |amounts: &[f64], each: f64| par::map_of(amounts, |&amount| (amount * each) as f32);
                let even = rates.constant();
                let cells = if area || even.is_some() { gather(&|_| 1.0)? } else { Vec::new() };
                let of_area = area.then(|| times(&cells, cell_m2));
                let of_runoff = match rates {
                    _ if !discharge => None,
                    Lane::Constant(rate) => Some(par::map_of(&cells, |cells| (cells * runoff(rate) * per_s) as f32)),
                    Lane::Samples(rates) => Some(times(&gather(&|cell| runoff(rates[cell]))?, per_s)),
                };
                Ok([of_area, of_runoff])
            }
        }
    }

    /// Returns the method of dispersed flow. Returns None if each cell has one receiver.
    fn spread(&self) -> Option<Spread> {
        match self.params.routing {
            Routing::D8 => None,
            Routing::DInfinity => Some(Spread::DInfinity),
            Routing::Mfd => Some(Spread::Freeman { exponent: self.params.exponent }),
        }
    }

    fn accumulate<A: Amount>(&self, amounts: &mut Vec<A>) -> Result<(), NodeError> {
        match self.params.depressions {
            Sinks::Jump => self.depressions.accumulate_jumping(self.job, self.grid, self.codes, amounts),
            _ => Drainage::default().accumulate(self.job, self.grid, self.codes, amounts),
        }
    }
}

#[cfg(test)]
pub(crate) mod tests;

mod device;
mod scratch;
#[cfg(test)]
mod sinks_tests;
#[cfg(test)]
mod void_tests;
