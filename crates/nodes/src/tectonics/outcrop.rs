//! The layers of rock that a terrain cuts.

use super::stratify::Surface;
use crate::prelude::*;

inputs! {
    /// Rock at depth, from `Stratify`, or from a process that has moved it.
    strata: Strata;
    /// Terrain that cuts the layers.
    height: Height;
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
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Outcrop",
    category: "tectonics",
    summary: "The layers of rock at the surface of a terrain.",
    doc: include_str!("outcrop.md"),
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,

    reach: Reach::Point,
    cpu: run,
    resolution: Resolution::Cells("contacts between layers are as sharp as cells"),
    example: "height: \"base\", strata: \"strata.strata\"",
    ..Node::DEFAULT
};

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let (inputs, wants) = (Inputs::read(job)?, Wants::of(job));
    let surface = Surface { strata: inputs.strata, height: inputs.height };
    Ok(Given {
        layer: wants.layer.then(|| surface.layer(job)).transpose()?,
        hardness: wants.hardness.then(|| surface.hardness(job)).transpose()?,
        repose: wants.repose.then(|| surface.repose(job)).transpose()?,
        colour: wants.colour.then(|| surface.colour(job)).transpose()?,
    }
    .into())
}
