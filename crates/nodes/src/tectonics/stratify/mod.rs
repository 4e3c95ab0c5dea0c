//! Layers of rock at depth: a table or a generated one, tilted, folded and faulted.

mod structure;
mod surface;
mod table;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use orograph_graph::{Column, LayerTable, Strata};

use self::structure::Structure;
pub use self::surface::Surface;
use crate::{
    numerics::{math, par},
    prelude::*,
};

choice! {
    /// What lies above the first and below the last layer.
    pub enum Beyond {
        /// The same layers, repeated.
        Repeat = "repeat",
        /// The first and the last layer, without end.
        Extend = "extend",
    }
}

params! {
    /// The layers, from the top down; an empty table is filled at random.
    layers: LayerTable = LayerTable(Vec::new()), One, ..;
    /// What lies above the first and below the last layer.
    beyond: Beyond = Beyond::Repeat, One, ..;
    /// Elevation of the top of the first layer at the centre of the world, before folds and other bends.
    top: f64 = 0.0, Metres, -1e5..=1e5, soft -1000.0..=4000.0;
    /// Number of generated layers, if `layers` is empty. They alternate between hard and soft.
    count: i64 = 8, Count, 1..=10_000, soft 2..=30, lacking layers;
    /// Mean thickness of generated layers.
    thickness: f64 = 150.0, Metres, 0.01..=1e5, soft 5.0..=1000.0, lacking layers;
    /// Ratio of the hardness of hard generated layers to that of soft ones.
    contrast: f64 = 6.0, One, 1.0..=1000.0, soft 1.0..=20.0, lacking layers;
    /// Direction of the strike, along which tilted layers and folds run, clockwise from north.
    strike: f64 = 60.0, Degrees, -360.0..=360.0, soft 0..=180;
    /// Angle at which layers descend to the right of the strike.
    dip: f64 = 2.0, Degrees, -90.0..=90.0, soft 0..=45;
    /// Height of folds: from the mean level of the layers to the crest of an anticline.
    fold_height: f64 = 0.0, Metres, 0.0..=1e5, soft 0..=2000;
    /// Distance from crest to crest of the folds. An anticline passes through the centre of the world.
    fold_length: f64 = 8e3, Metres, 10.0..=1e6, soft 1000..=30e3, given fold_height;
    /// How much folds meander, as a fraction of their wavelength.
    winding: f64 = 0.2, One, 0.0..=2.0, soft 0.0..=0.5, given fold_height;
    /// Standard deviation of the height of gentle swells of the layers; with 0, contacts are perfectly straight.
    swells: f64 = 10.0, Metres, 0.0..=1e4, soft 0..=100;
    /// How far a fault has lowered the rock to the right of `fault`; 0 for no fault.
    throw: f64 = 0.0, Metres, -1e5..=1e5, soft -1000.0..=1000.0;
    /// The trace of the fault, straight beyond its ends.
    fault: PathPoints = PathPoints(vec![[0.0, 0.0], [10e3, 10e3]]), Metres, -1e7..=1e7, given throw;
    /// Random seed of generated layers, folds and swells.
    seed: Seed = Seed(0), Count, ..;
}

inputs! {
    /// Terrain that cuts the layers; used by all outputs except `strata`.
    height: Height;
    /// Height by which the layers are raised, for other deformations.
    raised: Scalar(Metres) = 0.0, -1e5..=1e5, soft -1000.0..=1000.0;
}

outputs! {
    /// Colour of the layer at the surface.
    colour: Colour;
    /// Number of the layer at the surface, counted from 1 at the top of the table.
    layer: Scalar(Count);
    /// Hardness of the layer at the surface: how many times more slowly it erodes than rock of hardness 1.
    hardness: Scalar(One);
    /// Steepest stable slope of the layer at the surface.
    repose: Scalar(Degrees);
    /// The rock at depth; wire it to the input `strata` of processes, and to `Outcrop`.
    strata: Strata;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Stratify",
    category: "tectonics",
    summary: "Layers of rock at depth: hard and soft, tilted, folded and faulted.",
    doc: include_str!("page.md"),
    sources: &[
        "J. G. Ramsay and M. I. Huber (1987), The Techniques of Modern Structural Geology 2: Folds and Fractures, \
         Academic Press",
        "M. J. Selby (1980), A rock mass strength classification for geomorphic purposes, Zeitschrift für \
         Geomorphologie 24, 31-51",
        "K. Perlin (2002), Improving noise, ACM Transactions on Graphics 21, 681-682",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::Point,
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    resolution: Resolution::Cells("swells and bends of folds shorter than four cells are left out"),
    example: "height: \"base\", dip: 8, count: 6, fold_height: 300",
    ..Node::DEFAULT
};

/// The offset, if it is not an output.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    // layers that are made, and their table
    let params = Params::read(sizing.params);
    let made = if params.layers.0.is_empty() { 64 * params.count as u64 } else { 0 };
    made + sizing.cells(if Wants::among(sizing.wanted).strata { 0.0 } else { 4.0 })
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let (params, inputs, wants) = (Params::read(job.params), Inputs::read(job)?, Wants::of(job));
    let structure = Structure::new(&params, job);
    let (window, nx) = (job.window(), job.window().nx());
    let cosine = math::cos(params.dip.to_radians());
    let mut offset = vec![0.0; window.len()];
    par::rows_within(job, [0.0, 0.7], &mut offset, |j, row| {
        for (i, offset) in row.iter_mut().enumerate() {
            let raised = f64::from(inputs.raised.at(j * nx + i));
            *offset = (structure.offset_m(window.centre_m(i, j)) + raised * cosine) as f32;
        }
    })?;
    let layers = if params.layers.0.is_empty() { table::generated(&params, job.seed()) } else { params.layers.0 };
    let column = Column { layers, top_m: params.top * cosine, repeats: params.beyond == Beyond::Repeat, cosine };
    let strata = Strata::new(Arc::new(column), Field::new(window, offset));
    let surface = Surface { strata: &strata, height: inputs.height };
    Ok(Given {
        layer: wants.layer.then(|| surface.layer(job)).transpose()?,
        hardness: wants.hardness.then(|| surface.hardness(job)).transpose()?,
        repose: wants.repose.then(|| surface.repose(job)).transpose()?,
        colour: wants.colour.then(|| surface.colour(job)).transpose()?,
        strata: wants.strata.then_some(strata),
    }
    .into())
}
