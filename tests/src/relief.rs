//! Heights of graphs and of elevation models, and their grey hillshades.

use std::{error::Error, num::NonZero, path::Path};

use image::{GrayImage, Luma};
use orograph_graph::{Document, Evaluator, EvaluatorOptions, Field, Window};
use orograph_nodes::render::hillshade::{self, Light, Params};

/// Graphs with mountains, and cells along the x axis that resolve their slopes. The Alps come apart: they take longest.
pub const MOUNTAINS: [(&str, u32); 8] = [
    ("hello", 300),
    ("hello", 800),
    ("ridge", 300),
    ("two_ranges", 400),
    ("ridges", 546),
    ("belts", 400),
    ("carve_dem", 512),
    ("fault", 500),
];
/// Cells along the x axis of `alps.ron` that resolve its slopes.
pub const ALPS: (&str, u32) = ("alps", 750);

/// Builds the output `height` of a document with this number of cells along the x axis, on two threads.
///
/// # Errors
/// There is no such output, or it cannot be built.
pub fn built(document: &Document, folder: &Path, cells: u32) -> Result<Field, Box<dyn Error>> {
    let [height] = built_outputs(document, folder, cells, ["height"])?;
    Ok(height)
}

/// Builds outputs of a document that are rasters, with this number of cells along the x axis, on two threads.
///
/// # Errors
/// There is no such output, it is no raster, or it cannot be built.
pub fn built_outputs<const N: usize>(
    document: &Document,
    folder: &Path,
    cells: u32,
    names: [&str; N],
) -> Result<[Field; N], Box<dyn Error>> {
    let expanded = document.expand();
    let named = |name: &str| expanded.outputs.iter().find(|output| output.name == name).map(|output| output.port);
    let ports = names.map(named).into_iter().collect::<Option<Vec<_>>>().ok_or("an output is missing")?;
    let threads = NonZero::new(2);
    let evaluator = Evaluator::new(EvaluatorOptions { threads, ..EvaluatorOptions::default() })?;
    let window = Window::whole(document.world().with_cells_along_x(cells));
    let values = evaluator.values(&expanded.graph, folder, &ports, window)?;
    let fields = values.iter().map(|value| value.as_field().cloned()).collect::<Option<Vec<_>>>();
    fields.and_then(|fields| fields.try_into().ok()).ok_or_else(|| "an output is no raster".into())
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
