//! Alluvial fans where steep streams enter flat valleys.
//!
//! Areas and slopes of fans follow the power laws of their catchments (Bull 1977; Harvey 1997); the surface of a fan
//! is given by the distance from its apex over the fan, around obstacles (Chen and Capart 2022). See `mouths` for where
//! fans begin, `cone` for their surface, and `rivers` for what becomes of the rivers that they bury.

mod cone;
mod mouths;
mod rivers;
#[cfg(test)]
mod tests;

use orograph_graph::{Balance, memory::copied};

use self::{cone::Room, mouths::Streams, rivers::Moved};
use crate::{
    numerics::{math, par, voids},
    prelude::*,
};

params! {
    /// Slope of a fan whose stream drains 1 km²; that of others goes with the area to the power of −0.25.
    slope: f64 = 9.0, Degrees, 0.1..=40.0, soft 1..=20;
    /// How much gentler than the apex the toe of a fan is, as a share of the slope at the apex.
    concavity: f64 = 0.5, One, 0.0..=0.95, soft 0..=0.9;
    /// Smallest area that a stream with a fan drains.
    smallest: f64 = 2e5, SquareMetres, 0.0..=1e13, soft 1e4..=1e7;
    /// Largest area that a stream with a fan drains.
    largest: f64 = 5e7, SquareMetres, 0.0..=1e13, soft 1e6..=1e9;
}

inputs! {
    /// Terrain height.
    height: Height;
    /// Area of a fan whose stream drains 1 km², in km²; that of others goes with the area to the power of 0.9.
    size: Scalar(One) = 0.2, 0.0..=10.0, soft 0.0..=1.0;
}

outputs! {
    /// Terrain with fans.
    height: Height;
    /// Thickness of the gravel that was laid down.
    thickness: Scalar(Metres);
    /// 1 where gravel was laid down, 0 elsewhere.
    mask: Mask;
    /// Number, areas and volumes of fans, and the balance of sediment.
    report: Report;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Fans",
    category: "erosion",
    summary: "Alluvial fans where steep streams enter flat valleys.",
    doc: include_str!("page.md"),
    sources: &[
        "W. B. Bull (1977), The alluvial-fan environment, Progress in Physical Geography 1, 222-270",
        "A. M. Harvey (1997), The role of alluvial fans in arid zone fluvial systems, in D. S. G. Thomas (ed.), Arid Zone \
         Geomorphology, Wiley, 231-259",
        "T.-Y. K. Chen and H. Capart (2022), Computational morphology of debris and alluvial fans on irregular terrain \
         using the visibility polygon, Computers & Geosciences 169, 105228",
        "J. B. Lindsay (2016), Efficient hybrid breaching-filling sink removal methods for flow path enforcement in \
         digital elevation models, Hydrological Processes 30, 846-857",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::World,
    reads_sea: true,
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    resolution: Resolution::Cells("fans of fewer than 12 cells are left out"),
    example: "height: \"base\"",
    ..Node::DEFAULT
};

/// Exponent of the areas of fans over those of their catchments.
const AREA_EXPONENT: f64 = 0.9;
/// Exponent of the slopes of fans over the areas of their catchments.
const SLOPE_EXPONENT: f64 = -0.25;

/// The fewest cells of a fan.
const FEWEST_CELLS: f64 = 12.0;

/// How many fans are searched at the same time.
const ROOMS: usize = 4;
/// How many fans are searched before they are laid down.
const BATCH: usize = 32;

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    let wants = Wants::among(sizing.wanted);
    let given = [wants.height, wants.thickness, wants.mask].into_iter().filter(|is| *is).count() as f64;
    // codes, water levels, sizes of catchments, labels and donors of basins; the ground with its gravel; searches of fans
    let laid = 1.0 + 4.0 + 4.0 + 5.0 + 4.0 + 0.9;
    sizing.cells((laid - 4.0 * given).max(0.0))
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let (params, wants) = (Params::read(job.params), Wants::of(job));
    let inputs = Inputs::read(job)?;
    warn(job, &params, &inputs.size);
    let before = inputs.height.samples();
    let land = &*voids::filled(job, before)?;
    let streams = Streams::find(job, land)?;
    job.advance(0.3)?;
    let mouths = streams.mouths(job, &params, &inputs.size)?;
    let mut ground = copied(land)?;
    let mut tally = Tally::default();
    for (batch, some) in mouths.chunks(BATCH).enumerate() {
        let laid = par::collect_with(0..ROOMS, Room::default, |room, first, _| {
            let mine = some.iter().skip(first).step_by(ROOMS);
            mine.map(|mouth| room.fit(job, &streams, land, mouth)).collect::<Result<Vec<_>, NodeError>>()
        })?;
        for (at, mouth) in some.iter().enumerate() {
            if let Some(cells) = &laid[at % ROOMS][at / ROOMS] {
                tally.lay(mouth.catchment_m2, cells, &mut ground);
            }
        }
        job.advance(0.3 + 0.4 * (batch * BATCH) as f32 / mouths.len() as f32)?;
    }
    let streams = (tally.fans > 0.0).then_some(streams);
    if let Some(streams) = streams {
        tally.moved = rivers::settle(job, streams, land, &mut ground)?;
    }
    job.advance(0.95)?;

    let field = |of: &(dyn Fn(usize) -> f32 + Sync)| Field::new(job.window(), par::map(ground.len(), of));
    let laid_m = |cell: usize| if before[cell].is_finite() { ground[cell] - land[cell] } else { 0.0 };
    Ok(Given {
        thickness: wants.thickness.then(|| field(&laid_m)),
        mask: wants.mask.then(|| field(&|cell| if laid_m(cell) > 0.0 { 1.0 } else { 0.0 })),
        report: wants.report.then(|| {
            // where there are voids, too
            let laid_m = |cell: usize| f64::from(ground[cell]) - f64::from(land[cell]);
            tally.report(job, mouths.len(), ground.len(), &laid_m)
        }),
        height: wants.height.then(|| field(&|cell| if before[cell].is_finite() { ground[cell] } else { before[cell] })),
    }
    .into())
}

/// Says why no stream can have a fan, where the parameters or the cells are the reason.
fn warn(job: &Job<'_>, params: &Params, size: &Lane<'_>) {
    if params.smallest > params.largest {
        job.warn("`smallest` is larger than `largest`, so there are no fans");
        return;
    }
    let size = match size {
        Lane::Constant(size) => f64::from(*size),
        Lane::Samples(sizes) => f64::from(sizes.iter().copied().fold(0.0, f32::max)),
    };
    let least_m2 = FEWEST_CELLS * job.cell_m() * job.cell_m();
    let most_m2 = Shape::of(params.largest, size, params).area_m2;
    if size > 0.0 && params.largest > 0.0 && most_m2 < least_m2 {
        job.warn(format!(
            "there are no fans: the largest would cover {:.3} km², and {FEWEST_CELLS:.0} cells cover {:.3} km²; \
             use smaller cells, or raise `largest` or `size`",
            most_m2 / 1e6,
            least_m2 / 1e6,
        ));
    }
}

/// What was laid down.
#[derive(Default)]
struct Tally {
    fans: f64,
    largest_cells: usize,
    catchments_m2: f64,
    /// The sum of what fans are higher than the ground, in metres.
    laid_m: f64,
    moved: Moved,
}

impl Tally {
    /// Lays a fan down.
    fn lay(&mut self, catchment_m2: f64, cells: &[(u32, f32)], ground: &mut [f32]) {
        self.fans += 1.0;
        self.largest_cells = self.largest_cells.max(cells.len());
        self.catchments_m2 += catchment_m2;
        for &(cell, top_m) in cells {
            let ground = &mut ground[cell as usize];
            let raised = ground.max(top_m);
            self.laid_m += f64::from(raised) - f64::from(*ground);
            *ground = raised;
        }
    }

    fn report(&self, job: &Job<'_>, mouths: usize, cells: usize, laid_m: &dyn Fn(usize) -> f64) -> Report {
        let cell_m2 = job.cell_m() * job.cell_m();
        let covered = (0..cells).map(laid_m).filter(|laid_m| *laid_m > 0.0);
        let (count, sum_m, most_m) = covered
            .fold((0.0, 0.0, 0.0), |(count, sum_m, most_m): (f64, f64, f64), laid_m| {
                (count + 1.0, sum_m + laid_m, most_m.max(laid_m))
            });
        let mut report = Report::default();
        let volume = |metres: f64| cell_m2 * metres;
        let Moved { filled_m, washed_m, rock_m } = self.moved;
        report.balance(Balance::new(
            "sediment",
            0.0,
            &[("from_catchments", volume(self.laid_m + filled_m)), ("from_river_beds", volume(rock_m))],
            &[("washed_away", volume(washed_m))],
            volume(sum_m),
        ));
        report.measure("fans", self.fans, "");
        report.measure("streams_without_room", mouths as f64 - self.fans, "");
        report.measure("area", cell_m2 * count, "m²");
        report.measure("coverage", count / cells.max(1) as f64, "");
        report.measure("largest_area", cell_m2 * self.largest_cells as f64, "m²");
        report.measure("volume", volume(sum_m), "m³");
        report.measure("greatest_thickness", most_m, "m");
        let catchments_m2 = if self.catchments_m2 > 0.0 { self.catchments_m2 } else { f64::INFINITY };
        report.measure("lowering_of_catchments", volume(sum_m) / catchments_m2, "m");
        report
    }
}

/// The fan that a catchment calls for, if there is room.
#[derive(Clone, Copy, Debug)]
struct Shape {
    area_m2: f64,
    /// Tangent of the mean slope along the radius.
    slope: f64,
    radius_m: f64,
    concavity: f64,
}

impl Shape {
    fn of(catchment_m2: f64, size: f64, params: &Params) -> Self {
        let catchment_km2 = catchment_m2 * 1e-6;
        let area_m2 = 1e6 * size * math::pow(catchment_km2, AREA_EXPONENT);
        let slope = math::tan(params.slope.to_radians()) * math::pow(catchment_km2, SLOPE_EXPONENT);
        Self { area_m2, slope, radius_m: area_m2.sqrt(), concavity: params.concavity }
    }

    /// How far the surface is below the apex at a distance from it.
    fn fall_m(&self, distance_m: f64) -> f64 {
        let at_apex = self.slope / (1.0 - 0.5 * self.concavity);
        let within_m = distance_m.min(self.radius_m);
        let curved_m = within_m * (1.0 - 0.5 * self.concavity * within_m / self.radius_m);
        at_apex * (curved_m + (1.0 - self.concavity) * (distance_m - within_m))
    }
}
