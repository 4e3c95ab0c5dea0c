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
    relief::{self, built},
};

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
        let land = built(&Document::parse(&text, &registry()), &root, cells)?;
        row(file, &land);
        shades.push(shade(&land));
    }
    for (graph, cells) in GRAPHS {
        let document = Document::load(root.join(format!("graphs/{graph}.ron")), &registry())?;
        let land = built(&document, &root.join("graphs"), cells)?;
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
    let place = |from: usize, at: isize, count: usize| from.saturating_add_signed(at).min(count - 1);
    relief::shade(SIDE, land.window().cell_m(), |x, y| {
        f64::from(land.samples()[place(top, y, ny) * nx + place(left, x, nx)])
    })
}
