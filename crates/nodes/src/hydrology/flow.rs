//! Drainage of a surface by steepest descent, with its lakes.
//!
//! O'Callaghan and Mark (1984) for directions, Cordonnier, Bovy and Braun (2019) for depressions; the method is in
//! [`super::engine`].

use rayon::prelude::*;

use super::engine::{Depressions, Drainage, Grid, Spread, code, receivers, spread};
use crate::prelude::*;

choice! {
    /// What happens to water in depressions.
    pub enum Sinks {
        /// It leaves through the lowest pass, along the shortest way down that a spilling lake would cut: every cell
        /// drains out of the world.
        Carve = "carve",
        /// It stays at the bottom: every pit ends a river, as in dry basins and karst.
        Keep = "keep",
    }
}

choice! {
    /// How the water of a cell is shared among its neighbours.
    pub enum Routing {
        /// The neighbour of steepest descent takes it all: rivers one cell wide.
        D8 = "d8",
        /// The two neighbours that bound the direction of steepest descent share it, so that slopes drain in every
        /// direction alike.
        DInfinity = "d_infinity",
        /// All lower neighbours share it, in proportion to a power of the slope: smooth maps of wetness.
        Mfd = "mfd",
    }
}

params! {
    /// What happens to water in depressions.
    depressions: Sinks = Sinks::Carve, One, ..;
    /// How `area` is gathered.
    routing: Routing = Routing::D8, One, ..;
    /// The power of the slope, of `mfd` alone.
    ///
    /// 1 spreads widely; from 8 up it is hardly wider than `d8`.
    exponent: f64 = 1.1, One, 0.0..=20.0, soft 1..=8;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Flow",
    category: "hydrology",
    summary: "Where water runs, how much land it drains, and where it stands.",
    doc: "Every cell passes its water to the neighbour of steepest descent, the drop divided by the distance to the \
          neighbour's centre (D8). The **drainage area** of a cell is the area of all cells whose water passes through \
          it, its own included.\n\n\
          Real surfaces have depressions. `filled` is the lowest surface above the land from which every cell drains: \
          land under water stands at the level at which it spills. `lake_depth` is what was filled. With `depressions: \
          carve` a lake's water follows the steepest way up from its bottom to its pass and leaves there, so that \
          rivers go on below it; the height itself is never changed. With `keep` it ends in the lake.\n\n\
          Water leaves at the sides of the world that are `base` or `open`. Cells of a `base` side pass nothing on: the \
          sea begins there. On an `open` side water leaves where no neighbour inside is lower. At a `wall` nothing \
          leaves; `periodic` sides are joined. With walls or periodic sides all around there is nowhere to drain to, \
          and the node says so.\n\n\
          `routing` says how `area` is gathered. `d_infinity` shares water between the two neighbours that bound the \
          steepest of the eight triangular facets around the cell, each by how near it is to the direction of descent. \
          `mfd` shares it among all lower neighbours in proportion to slope^`exponent`. With `carve` both \
          see lakes as level surfaces, which their water crosses along `direction`; with `keep` it runs on the land \
          itself and stays in pits. Area is then no longer whole cells, and rivers on flat ground are wide.\n\n\
          `rain` weights the land: where it is 2, a cell counts twice. With rain as a share of the mean, `area` is \
          discharge divided by the mean rain.\n\n\
          Heights of equal slope are decided by the order E, NE, N, NW, W, SW, S, SE; large exact flats, such as the \
          terraces of rasters in whole metres, are crossed in straight lines. D8 prefers multiples of 45° on smooth \
          slopes. The share of cells near a divide changes with the cell size; rivers and lakes wider than a few cells \
          do not.",
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
    ],
    inputs: &[
        Input::needs("height", PortType::Height, "The land."),
        Input::number(
            "rain",
            Unit::One,
            1.0,
            [0.0, 1e6],
            [0.0, 4.0],
            "How much each cell counts, as a share of the mean. Below 0 counts as 0.",
        ),
    ],
    outputs: &[
        Output::gives("area", PortType::Scalar(Unit::SquareMetres), "Drainage area of each cell, its own included."),
        Output::gives("filled", PortType::Height, "The land with depressions filled to the level at which they spill."),
        Output::gives("lake_depth", PortType::Scalar(Unit::Metres), "Depth of standing water, 0 on dry land."),
        Output::gives(
            "direction",
            PortType::Scalar(Unit::Count),
            "The neighbour of steepest descent, which each cell drains to.\n\
             0 to 7 are E, NE, N, NW, W, SW, S, SE; -1 is where water leaves the world or stays.",
        ),
    ],
    params: Params::specs,
    reach: Reach::World,
    cpu: run,
    resolution: Resolution::Cells(
        "rivers are one cell wide, so the drainage area of a place depends on whether its cell has the river in it",
    ),
    example: "height: \"base\", depressions: keep",
    ..Node::DEFAULT
};

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let height = job.field("height")?;
    let grid = Grid::new(&job.window())?;

    let mut codes = vec![0; grid.cells()];
    receivers::d8(job, &grid, height.samples(), &mut codes)?;
    job.advance(0.1)?;
    let mut depressions = Depressions::default();
    depressions.find(job, &grid, height.samples(), &codes)?;
    job.advance(0.5)?;
    if params.depressions == Sinks::Carve {
        depressions.carve(job, &grid, &mut codes)?;
    }
    let mut filled = height.samples().to_vec();
    depressions.fill(&mut filled);
    job.advance(0.6)?;

    let spread = match params.routing {
        Routing::D8 => None,
        Routing::DInfinity => Some(Spread::DInfinity),
        Routing::Mfd => Some(Spread::Freeman { exponent: params.exponent }),
    };
    let area = match spread {
        None => area(job, &grid, &codes)?,
        Some(spread) => {
            let surface = if params.depressions == Sinks::Carve { &filled } else { height.samples() };
            spread_area(job, &grid, surface, &codes, spread)?
        }
    };
    job.advance(0.9)?;
    let mut depth = vec![0.0; grid.cells()];
    depth
        .par_iter_mut()
        .zip(&filled)
        .zip(height.samples())
        .for_each(|((depth, filled), height)| *depth = if filled > height { filled - height } else { 0.0 });
    let mut direction = vec![-1.0; grid.cells()];
    direction
        .par_iter_mut()
        .zip(&codes)
        .filter(|(_, code)| code::has_receiver(**code))
        .for_each(|(direction, &code)| *direction = code::direction(code) as f32);
    let field = |samples| Field::new(job.window(), samples);
    Ok(Outputs::one("area", field(area))
        .with("filled", field(filled))
        .with("lake_depth", field(depth))
        .with("direction", field(direction)))
}

/// How much a cell counts.
fn weight(rain: f32) -> f64 {
    if rain > 0.0 { f64::from(rain) } else { 0.0 }
}

/// Drainage area in square metres. Cells are counted exactly; their weights, where they differ, are added in double
/// precision.
fn area(job: &Job<'_>, grid: &Grid, codes: &[u8]) -> Result<Vec<f32>, NodeError> {
    let cell_m2 = job.cell_m() * job.cell_m();
    let mut drainage = Drainage::default();
    match job.lane("rain") {
        Lane::Constant(rain) => {
            let mut cells = vec![1_u32; grid.cells()];
            drainage.accumulate(job, grid, codes, &mut cells)?;
            let each_m2 = cell_m2 * weight(rain);
            Ok(cells.par_iter().map(|&cells| (f64::from(cells) * each_m2) as f32).collect())
        }
        Lane::Samples(rain) => {
            let mut weights: Vec<f64> = rain.par_iter().copied().map(weight).collect();
            drainage.accumulate(job, grid, codes, &mut weights)?;
            Ok(weights.par_iter().map(|&weight| (weight * cell_m2) as f32).collect())
        }
    }
}

/// Drainage area in square metres of water that spreads over a surface.
fn spread_area(job: &Job<'_>, grid: &Grid, surface: &[f32], codes: &[u8], how: Spread) -> Result<Vec<f32>, NodeError> {
    let cell_m2 = job.cell_m() * job.cell_m();
    let rain = job.lane("rain");
    let mut amounts: Vec<f64> = (0..grid.cells()).into_par_iter().map(|cell| weight(rain.at(cell)) * cell_m2).collect();
    spread::accumulate(job, grid, surface, codes, how, &mut amounts)?;
    Ok(amounts.par_iter().map(|&amount| amount as f32).collect())
}

#[cfg(test)]
#[path = "flow_tests.rs"]
mod tests;
