//! Heights of graphs and of elevation models, and their grey hillshades.

use std::{error::Error, num::NonZero, path::Path};

use image::{GrayImage, Luma};
use orograph_graph::{Document, Evaluator, EvaluatorOptions, Field, Window};
use orograph_nodes::render::hillshade::{self, Light, Params};

/// Builds the output `height` of a document with this number of cells along the x axis, on two threads.
///
/// # Errors
/// There is no such output, or it cannot be built.
pub fn built(document: &Document, folder: &Path, cells: u32) -> Result<Field, Box<dyn Error>> {
    let expanded = document.expand();
    let output = expanded.outputs.iter().find(|output| output.name == "height").ok_or("no output `height`")?;
    let threads = NonZero::new(2);
    let evaluator = Evaluator::new(EvaluatorOptions { threads, ..EvaluatorOptions::default() })?;
    let window = Window::whole(document.world().with_cells_along_x(cells));
    let values = evaluator.values(&expanded.graph, folder, &[output.port], window)?;
    Ok(values[0].as_field().ok_or("no heights")?.clone())
}

/// A plain hillshade: one sun in the north-west, 45° high, without shadows and without exaggeration.
#[must_use]
pub fn shade(heights: &Field) -> GrayImage {
    let [light, _] = hillshade::relief(heights, &Params { light: Light::Single, shadows: 0.0, ..Params::default() });
    let nx = heights.window().nx();
    GrayImage::from_fn(nx as u32, heights.window().ny() as u32, |x, y| {
        Luma([(light.samples()[y as usize * nx + x as usize] * 255.0) as u8])
    })
}
