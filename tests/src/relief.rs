//! Heights of graphs and of elevation models as grey hillshades.

use std::{error::Error, num::NonZero, path::Path};

use image::{GrayImage, Luma};
use orograph_graph::{Document, Evaluator, EvaluatorOptions, Field, Window};

/// Builds the output `height` of a document with this number of cells along the x axis.
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

/// A square hillshade lit from the north-west. `at` gives the height at a column and a row; columns and rows beyond the
/// sides of the picture by one are read as well, from −1 on.
#[must_use]
pub fn shade(side: usize, cell_m: f64, at: impl Fn(isize, isize) -> f64) -> GrayImage {
    GrayImage::from_fn(side as u32, side as u32, |x, y| {
        let (x, y) = (x as isize, y as isize);
        let east = (at(x + 1, y) - at(x - 1, y)) / (2.0 * cell_m);
        let south = (at(x, y + 1) - at(x, y - 1)) / (2.0 * cell_m);
        let light = (0.707 + 0.5 * (east + south)) / (1.0 + east * east + south * south).sqrt();
        Luma([(light.clamp(0.0, 1.0) * 255.0) as u8])
    })
}
