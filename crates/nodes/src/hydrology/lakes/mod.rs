//! Lakes: their level, depth, shores, outlets, and the direction in which their water moves.
//!
//! Levels by Cordonnier, Bovy and Braun (2019) as in `Flow`, which equal those of the priority flood (Barnes, Lehman
//! and Mulla 2014); directions by the eikonal equation (Sethian 1996).

mod find;
mod shores;
#[cfg(test)]
mod tests;
mod way;

use orograph_graph::memory::{copied, zeroed};

use self::find::{Lake, Lakes};
use crate::{
    numerics::{
        par,
        routing::{Depressions, Grid, code::STEPS, receivers},
        voids,
    },
    prelude::*,
};

params! {
    /// Smallest water surface of a lake; smaller lakes count as land.
    smallest: f64 = 1e4, SquareMetres, 0.0..=1e12, soft 0.0..=1e6;
    /// Smallest depth at the deepest point of a lake; shallower lakes count as land.
    shallowest: f64 = 0.5, Metres, 0.0..=1e4, soft 0.0..=20.0;
}

inputs! {
    /// Terrain height: the ground, with the beds of the lakes.
    height: Height;
}

outputs! {
    /// The surface of the water on lakes, the terrain elsewhere.
    level: Height;
    /// Depth of the water, 0 on land.
    depth: Scalar(Metres);
    /// 1 on lakes, 0 on land.
    mask: Mask;
    /// 1 on land cells at the water's edge, 0 elsewhere.
    shore: Mask;
    /// Number of the lake, 0 on land.
    /// Lakes are numbered from 1 by their first cells, row by row from the north-west.
    lake: Scalar(Count);
    /// Direction in which water moves, of length 1.
    ///
    /// Towards the spill point on lakes, along `Flow.direction` on land; 0 where water leaves the world.
    flow: Vector(One);
    /// The shores as polygons with level, depth, area, volume and spill point.
    outlines: Lines;
    /// Number, areas and volumes of the lakes.
    report: Report;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Lakes",
    category: "hydrology",
    summary: "Lakes: their level, depth, shores and outlets, as rasters and as polygons.",
    doc: include_str!("page.md"),
    sources: &[
        "G. Cordonnier, B. Bovy and J. Braun (2019), A versatile, linear complexity algorithm for flow routing in \
         topographies with depressions, Earth Surface Dynamics 7, 549-562",
        "R. Barnes, C. Lehman and D. Mulla (2014), Priority-flood: an optimal depression-filling and \
         watershed-labeling algorithm for digital elevation models, Computers & Geosciences 62, 117-127",
        "J. A. Sethian (1996), A fast marching level set method for monotonically advancing fronts, Proceedings of the \
         National Academy of Sciences 93, 1591-1595",
        "H. Butler et al. (2016), The GeoJSON format, RFC 7946",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    averaging: &[("flow", Averaging::UnitVector)],
    params: Params::specs,
    reach: Reach::World,
    reads_sea: true,
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    resolution: Resolution::Cells("a lake spills where its lowest pass is, which may be lower between smaller cells"),
    example: "height: \"base\"",
    ..Node::DEFAULT
};

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    let wants = Wants::among(sizing.wanted);
    let when = |is: bool, bytes: f64| if is { bytes } else { 0.0 };
    // levels and numbers of lakes; codes, labels and donors of basins beside them
    let held = 4.0 + 4.0;
    let found = held + 1.0 + 5.0;
    let flow = when(wants.flow, 8.0);
    // lengths of the ways
    let directed = found + when(wants.flow, 4.0) + flow;
    let traced = held + flow + when(wants.outlines, 4.0);
    let rasters = [wants.depth, wants.mask, wants.shore, wants.lake].into_iter().filter(|is| *is).count() as f64;
    let end = held + flow + 4.0 * rasters;
    let given = 4.0 * rasters + when(wants.level, 4.0) + flow;
    sizing.cells((directed.max(traced).max(end) - given).max(0.0))
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let (params, wants) = (Params::read(job.params), Wants::of(job));
    let grid = Grid::new(&job.window())?;
    let land = &*voids::filled(job, Inputs::read(job)?.height.samples())?;
    let mut codes = zeroed(grid.cells())?;
    receivers::d8(job, &grid, land, &mut codes)?;
    if let Some(level) = job.sea_level() {
        receivers::end_at_sea(land, level, &mut codes);
    }
    let mut depressions = Depressions::default();
    depressions.find(job, &grid, land, &codes)?;
    job.advance(0.4)?;
    let mut level = copied(land)?;
    depressions.fill(&mut level);
    let least = [params.smallest / (job.cell_m() * job.cell_m()), params.shallowest];
    let lakes = Lakes::find(job, &grid, land, &mut level, &depressions, least)?;
    job.advance(0.6)?;
    let flow = if wants.flow {
        depressions.carve(job, &grid, &mut codes)?;
        Some(Field::with_planes(job.window(), 2, way::directions(job, &grid, &lakes, &codes)?))
    } else {
        None
    };
    drop((depressions, codes));
    job.advance(0.8)?;
    let outlines = wants.outlines.then(|| shores::outlines(job, &grid, &lakes)).transpose()?;

    let cells = |value: &(dyn Fn(usize) -> f32 + Sync)| par::field(job, [0.8, 1.0], value);
    let is_wet = |cell: usize| lakes.of[cell] > 0;
    let is_shore = |cell: usize| {
        !is_wet(cell)
            && (0..STEPS.len()).any(|way| grid.neighbour(cell as u32, way).is_some_and(|at| is_wet(at as usize)))
    };
    let share = |is: bool| if is { 1.0 } else { 0.0 };
    Ok(Given {
        depth: wants.depth.then(|| cells(&|cell| level[cell] - land[cell])).transpose()?,
        mask: wants.mask.then(|| cells(&|cell| share(is_wet(cell)))).transpose()?,
        shore: wants.shore.then(|| cells(&|cell| share(is_shore(cell)))).transpose()?,
        lake: wants.lake.then(|| cells(&|cell| lakes.of[cell] as f32)).transpose()?,
        level: wants.level.then(|| Field::new(job.window(), level)),
        flow,
        outlines,
        report: wants.report.then(|| report(&lakes, job.cell_m() * job.cell_m())),
    }
    .into())
}

fn report(lakes: &Lakes, cell_m2: f64) -> Report {
    let most = |of: &dyn Fn(&Lake) -> f64| lakes.all.iter().map(of).fold(0.0, f64::max);
    let cells: f64 = lakes.all.iter().map(|lake| f64::from(lake.cells)).sum();
    let depths_m: f64 = lakes.all.iter().map(|lake| lake.depths_m).sum();
    let mut report = Report::default();
    report.measure("lakes", lakes.all.len() as f64, "");
    report.measure("hollows_without_lake", f64::from(lakes.dropped), "");
    report.measure("area", cell_m2 * cells, "m²");
    report.measure("coverage", cells / lakes.of.len().max(1) as f64, "");
    report.measure("volume", cell_m2 * depths_m, "m³");
    report.measure("largest_area", cell_m2 * most(&|lake| f64::from(lake.cells)), "m²");
    report.measure("greatest_depth", most(&|lake| f64::from(lake.depth_m)), "m");
    report
}
