//! A sheet of the mountain graphs and of digital elevation models, as grey hillshades, and a table of their measures:
//! `cargo run --release -p orograph-tests --example mountains -- SHEET.png`. Pictures and rows have the same order,
//! with three elevation models first. Cells are 30 to 100 m; pictures show the centre of each terrain, measures cover
//! all of it.

use std::{error::Error, path::Path};

use image::{GrayImage, Luma};
use orograph_graph::{Document, Field};
use orograph_nodes::registry;
use orograph_tests::{
    Look,
    relief::{built, shade},
};

/// Side of a picture in cells.
const SIDE: u32 = 250;
/// Pictures per row.
const COLUMNS: u32 = 4;
/// Gap between pictures, in pixels.
const GAP: u32 = 6;

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
        let land = built(&Document::parse(&text, &registry()), &root, cells)?;
        row(file, &land);
        shades.push(centre(&land));
    }
    for (graph, cells) in GRAPHS {
        let document = Document::load(root.join(format!("graphs/{graph}.ron")), &registry())?;
        let land = built(&document, &root.join("graphs"), cells)?;
        row(&format!("graphs/{graph}.ron"), &land);
        shades.push(centre(&land));
    }
    let rows = (shades.len() as u32).div_ceil(COLUMNS);
    let pitch = SIDE + GAP;
    let mut picture = GrayImage::from_pixel(COLUMNS * pitch, rows * pitch, Luma([255]));
    for (at, shade) in (0..).zip(&shades) {
        let [x, y] = [at % COLUMNS, at / COLUMNS].map(|place: u32| i64::from(place * pitch));
        image::imageops::replace(&mut picture, shade, x, y);
    }
    picture.save(sheet)?;
    Ok(())
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

/// The centre of a hillshade.
fn centre(land: &Field) -> GrayImage {
    let shade = shade(land);
    let [left, top] = [shade.width(), shade.height()].map(|count| count.saturating_sub(SIDE) / 2);
    image::imageops::crop_imm(&shade, left, top, SIDE, SIDE).to_image()
}
