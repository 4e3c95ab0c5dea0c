//! A sheet of the mountain graphs and of digital elevation models, as grey hillshades, and a table of their measures:
//! `cargo run --release -p orograph-tests --example mountains -- SHEET.png`. Pictures and rows have the same order,
//! with three elevation models first. Cells are 30 to 100 m; pictures show the centre of each terrain, measures cover
//! all of it.

use std::{error::Error, num::NonZero, path::Path};

use image::{GrayImage, Luma};
use orograph_graph::{Document, Evaluator, EvaluatorOptions, Field, Window};
use orograph_nodes::registry;
use orograph_tests::Look;

/// Side of a picture in cells.
const SIDE: usize = 250;
/// Pictures per row.
const COLUMNS: usize = 4;
/// Gap between pictures, in pixels.
const GAP: usize = 6;

/// A graph, and the cells along its longer side.
const GRAPHS: [(&str, u32); 8] = [
    ("alps", 750),
    ("hello", 300),
    ("ridge", 300),
    ("two_ranges", 400),
    ("ridges", 546),
    ("belts", 400),
    ("carve_dem", 512),
    ("fault", 500),
];

/// An elevation model, the side of its cells in metres, and the number of cells per side.
const REAL: [(&str, f64, u32); 3] = [
    ("graphs/data/bigtujunga_512_30m.tif", 30.0, 512),
    ("tests/data/mandakini_drained_256.tif", 89.0, 256),
    ("tests/data/glencoe_drained_256.tif", 50.0, 256),
];

fn main() -> Result<(), Box<dyn Error>> {
    let sheet = std::env::args().nth(1).ok_or("name the picture to write")?;
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    println!("| | cells | cell | median slope | p95/p50 | fullest bin | planar |\n|---|---|---|---|---|---|---|");
    let mut shades = Vec::new();
    for (file, cell_m, cells) in REAL {
        let size = cell_m * f64::from(cells);
        let text = format!(
            "(format: 1, world: (size: {size}, cells: {cells}), nodes: {{ \"land\": Import(file: \"{file}\") }}, \
             outputs: {{ \"height\": \"land\" }})"
        );
        let land = land(&Document::parse(&text, &registry()), &root, cells)?;
        row(file, &land);
        shades.push(shade(&land));
    }
    for (graph, cells) in GRAPHS {
        let document = Document::load(root.join(format!("graphs/{graph}.ron")), &registry())?;
        let land = land(&document, &root.join("graphs"), cells)?;
        row(&format!("graphs/{graph}.ron"), &land);
        shades.push(shade(&land));
    }
    let rows = shades.len().div_ceil(COLUMNS);
    let pitch = SIDE + GAP;
    let mut picture = GrayImage::from_pixel((COLUMNS * pitch) as u32, (rows * pitch) as u32, Luma([255]));
    for (at, shade) in shades.iter().enumerate() {
        let corner = [at % COLUMNS * pitch, at / COLUMNS * pitch].map(|place| place as i64);
        image::imageops::replace(&mut picture, shade, corner[0], corner[1]);
    }
    picture.save(sheet)?;
    Ok(())
}

/// The output `height` of a document at this number of cells.
fn land(document: &Document, folder: &Path, cells: u32) -> Result<Field, Box<dyn Error>> {
    let expanded = document.expand();
    let output = expanded.outputs.iter().find(|output| output.name == "height").ok_or("no output `height`")?;
    let threads = NonZero::new(2);
    let evaluator = Evaluator::new(EvaluatorOptions { threads, ..EvaluatorOptions::default() })?;
    let window = Window::whole(document.world().with_cells_along_x(cells));
    let values = evaluator.values(&expanded.graph, folder, &[output.port], window)?;
    Ok(values[0].as_field().ok_or("no heights")?.clone())
}

/// Prints the measures of a terrain as a row of a Markdown table.
fn row(name: &str, land: &Field) {
    let (nx, cell_m) = (land.window().nx(), land.window().cell_m());
    match Look::of(land) {
        Some(Look { median, ratio, fullest_bin, planar }) => {
            println!("| `{name}` | {nx} | {cell_m:.0} m | {median:.1}° | {ratio:.2} | {fullest_bin:.2} | {planar:.4} |")
        }
        None => println!("| `{name}` | {nx} | {cell_m:.0} m | no slopes | | | |"),
    }
}

/// A hillshade of the centre of a terrain, lit from the north-west.
fn shade(land: &Field) -> GrayImage {
    let (nx, ny) = (land.window().nx(), land.window().ny());
    let (left, top) = ((nx - SIDE.min(nx)) / 2, (ny - SIDE.min(ny)) / 2);
    let at = |x: usize, y: usize| f64::from(land.samples()[y.min(ny - 1) * nx + x.min(nx - 1)]);
    GrayImage::from_fn(SIDE as u32, SIDE as u32, |x, y| {
        let (x, y) = (left + x as usize, top + y as usize);
        let across_m = 2.0 * land.window().cell_m();
        let east = (at(x + 1, y) - at(x.saturating_sub(1), y)) / across_m;
        let south = (at(x, y + 1) - at(x, y.saturating_sub(1))) / across_m;
        let light = (0.707 + 0.5 * (east + south)) / (1.0 + east * east + south * south).sqrt();
        Luma([(light.clamp(0.0, 1.0) * 255.0) as u8])
    })
}
