//! What covers the ground, and its colour from above: rock, scree, soil, grass, forest, snow and water.

mod cover;
mod reflectance;
#[cfg(test)]
mod tests;

use self::{
    cover::{Cover, Ground},
    reflectance::Rock,
};
use crate::{
    numerics::{
        gradient::{BLOCK, Method, Surface, slope_degrees},
        par,
    },
    prelude::*,
};

params! {
    /// Kind of rock, which gives its colour where nothing is wired to `rock_colour`.
    rock: Rock = Rock::Granite, One, ..;
    /// Slope from which soil begins to slide off the rock.
    bare_from: f64 = 30.0, Degrees, 0.0..=90.0;
    /// Slope from which the rock is bare.
    bare_to: f64 = 42.0, Degrees, 0.0..=90.0;
    /// Elevation up to which trees grow.
    tree_line: f64 = 1800.0, Metres, -12_000.0..=20_000.0, soft 0.0..=4000.0;
    /// Elevation up to which grass grows; above it lie rock and scree.
    grass_line: f64 = 2600.0, Metres, -12_000.0..=20_000.0, soft 0.0..=5000.0;
    /// Fraction of the fertile ground below the tree line that is forest.
    forest: f64 = 0.5, One, 0.0..=1.0;
    /// From green grass and dense plants at 0 to straw, bare soil and scattered bushes at 1.
    dryness: f64 = 0.2, One, 0.0..=1.0;
    /// Size of the patches of forest, grass and lichen.
    patch_size: f64 = 250.0, Metres, 1.0..=1e6, soft 50.0..=5000.0;
    /// How far patches gather into woods and open country eight times as large: 0 for patches of one size everywhere.
    grouping: f64 = 0.7, One, 0.0..=1.0;
    /// Thickness of erosion that leaves the rock bare on two thirds of the ground.
    wear_depth: f64 = 2.0, Metres, 1e-3..=1e5, soft 0.1..=500.0;
    /// Thickness of debris that covers two thirds of the ground.
    deposit_depth: f64 = 1.0, Metres, 1e-3..=1e4, soft 0.05..=50.0;
    /// Drainage area from which the ground beside a stream is moist.
    moist_area: f64 = 200_000.0, SquareMetres, 1.0..=1e12, soft 1e3..=1e8;
    /// Whether the world's sea is drawn, as deep as the terrain lies below its level.
    with_sea: bool = true, One, ..;
    /// Whether water is kept free of plants and snow; the ground below it then counts as soil.
    bare_water: bool = true, One, ..;
    /// Random seed of the patches.
    seed: Seed = Seed(0), Count, ..;
}

inputs! {
    /// Terrain height.
    height: Height;
    /// Colour of the rock, such as that of `Outcrop`.
    rock_colour: Option<Colour>;
    /// Thickness that erosion has removed.
    wear: Option<Scalar(Metres)>;
    /// Thickness of loose debris, scree or sediment.
    deposits: Option<Scalar(Metres)>;
    /// Drainage area, such as that of `Flow`: the ground along streams is moist.
    area: Option<Scalar(SquareMetres)>;
    /// Moist ground at 1, such as the mask of `Wetness`.
    moisture: Option<Mask>;
    /// Exposed ground at 1, such as crests by `Curvature` or `Position`: thin soil and dry grass.
    exposed: Option<Mask>;
    /// Snow at 1, such as the mask of `Snow`.
    snow: Option<Mask>;
    /// Depth of water: shores are wet, and the ground shows through where it is shallow.
    water: Option<Scalar(Metres)>;
}

outputs! {
    /// Reflectance, as linear RGB: the colour in plain daylight, without shading.
    colour: Colour;
    /// Weights of rock, soil and debris, plants, and snow, which sum to one. What lies under water counts as soil.
    weights: Weights;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Landcover",
    version: 3,
    migrations: &[
        Migration {
            from: 1,
            steps: &[
                Step::Keep { name: "with_sea", value: "false" },
                Step::Keep { name: "bare_water", value: "false" },
            ],
        },
        Migration { from: 2, steps: &[Step::Keep { name: "grouping", value: "0" }] },
    ],
    category: "render",
    summary: "Rock, soil, plants, snow and water in measured colours, by the processes that shaped the terrain.",
    doc: include_str!("page.md"),
    sources: &[
        "S. K. Meerdink, S. J. Hook, D. A. Roberts and E. A. Abbott, 2019, The ECOSTRESS spectral library version 1.0, Remote \
         Sensing of Environment 230, 111196",
        "R. M. Pope and E. S. Fry, 1997, Absorption spectrum (380-700 nm) of pure water, Applied Optics 36(33), 8710-8723",
        "C. Wyman, P.-P. Sloan and P. Shirley, 2013, Simple analytic approximations to the CIE XYZ color matching functions",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::Metres(|_, cell_m| cell_m),
    reads_sea: true,
    refuses: Some(refuses),
    cpu: run,
    resolution: Resolution::Cells(
        "slopes are measured between neighbouring cells, so larger cells show less bare rock",
    ),
    example: "height: \"base\", area: \"flow.area\", tree_line: 1100, grass_line: 1500",
    ..Node::DEFAULT
};

/// Refuses ranges that fall.
fn refuses(stated: &Stated<'_>) -> Result<(), NodeError> {
    let params = Params::read(stated.params);
    rises(("bare_from", params.bare_from, "°"), ("bare_to", params.bare_to, "°"))?;
    rises(("tree_line", params.tree_line, " m"), ("grass_line", params.grass_line, " m"))
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let (inputs, params, wants) = (Inputs::read(job)?, Params::read(job.params), Wants::of(job));
    refuses(&Stated::of_job(job))?;
    let window = job.window();
    let (nx, len) = (window.nx(), window.len());
    let mut colours = vec![0.0; if wants.colour { 3 * len } else { 0 }];
    let mut weights = vec![0.0; if wants.weights { 4 * len } else { 0 }];
    // the rows of all planes of the wanted outputs
    let mut rows: Vec<Vec<&mut [f32]>> = (0..window.ny()).map(|_| Vec::with_capacity(7)).collect();
    for plane in colours.chunks_mut(len).chain(weights.chunks_mut(len)) {
        for (row, samples) in rows.iter_mut().zip(plane.chunks_mut(nx)) {
            row.push(samples);
        }
    }
    let surface = Surface::new(inputs.height, Method::Horn);
    let cover = Cover::new(&params, window.cell_m(), job.seed());
    let sea_m = job.sea_level().filter(|_| params.with_sea).map_or(f32::NEG_INFINITY, |sea_m| sea_m as f32);
    let skipped = if wants.colour { 0 } else { 3 };
    par::each(rows, |j, mut planes| {
        job.check()?;
        let mut slopes = [0.0; BLOCK];
        surface.row(j, |start, east, south| {
            let slopes = &mut slopes[..east.len()];
            slope_degrees(east, south, slopes);
            for (i, slope) in (start..).zip(&*slopes) {
                let ground = inputs.at(j * nx + i, params.rock, *slope, sea_m);
                let values = cover.of(&ground, window.centre_m(i, j));
                for (plane, value) in planes.iter_mut().zip(&values[skipped..]) {
                    plane[i] = *value;
                }
            }
        });
        Ok::<_, NodeError>(())
    })?;
    Ok(Given {
        colour: wants.colour.then(|| Field::with_planes(window, 3, colours)),
        weights: wants.weights.then(|| Field::with_planes(window, 4, weights)),
    }
    .into())
}

impl Inputs<'_> {
    /// What lies at a cell.
    fn at(&self, cell: usize, rock: Rock, slope: f32, sea_m: f32) -> Ground {
        let at = |field: Option<&Field>| field.map_or(0.0, |field| field.plane(0)[cell]);
        let height = self.height.plane(0)[cell];
        Ground {
            height,
            slope,
            rock: self
                .rock_colour
                .map_or(rock.reflectance(), |colour| [0, 1, 2].map(|plane| colour.plane(plane)[cell])),
            wear: at(self.wear).max(0.0),
            deposits: at(self.deposits).max(0.0),
            area: at(self.area).max(0.0),
            moisture: at(self.moisture),
            exposed: at(self.exposed),
            snow: at(self.snow),
            water: at(self.water).max(sea_m - height).max(0.0),
        }
    }
}

/// Rejects a range whose end is below its start.
fn rises((low, from, unit): (&str, f64, &str), (high, to, _): (&str, f64, &str)) -> Result<(), NodeError> {
    if from <= to {
        return Ok(());
    }
    let message = format!("`{low}` is {from}{unit}, above `{high}`, {to}{unit}");
    Err(NodeError::failed_with_hint(message, "exchange the two"))
}
