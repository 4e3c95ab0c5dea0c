//! A sheet of example graphs and of digital elevation models, as grey hillshades, and a table of their measures:
//! `cargo run --release -p orograph-tests --example mountains -- SHEET.png` for the mountain graphs, and the same with
//! `valleys` at the end for those that ice and layers of rock have shaped. Pictures and rows have the same order, with
//! three elevation models first. Pictures show the centre of each terrain, measures cover all of it.

use std::{error::Error, path::Path};

use image::{GrayImage, Luma};
use orograph_graph::{Document, Field};
use orograph_nodes::registry;
use orograph_tests::{
    Look,
    relief::{self, built, shade},
};

/// Pictures per row.
const COLUMNS: u32 = 4;
/// Gap between pictures, in pixels.
const GAP: u32 = 6;

/// The pictures of a sheet.
struct Sheet {
    /// Side of a picture in cells.
    side: u32,
    /// Elevation models: their extent in metres, and the number of cells per side.
    models: [(&'static str, f64, u32); 3],
    /// Graphs, and the cells along their longer side.
    graphs: &'static [&'static [(&'static str, u32)]],
}

/// Cells of 30 to 100 m, as the graphs or the models have them.
const MOUNTAINS: Sheet = Sheet {
    side: 250,
    models: [
        ("graphs/data/bigtujunga_512_30m.tif", 15_360.0, 512),
        ("tests/data/mandakini_drained_256.tif", 22_784.0, 256),
        ("tests/data/glencoe_drained_256.tif", 12_800.0, 256),
    ],
    graphs: &[&[relief::ALPS], &relief::MOUNTAINS],
};

/// 24 km of each, in cells of 80 m.
const VALLEYS: Sheet = Sheet {
    side: 300,
    models: [
        ("tests/data/dems/glencoe.tif", 25_600.0, 320),
        ("tests/data/dems/mandakini.tif", 25_578.0, 320),
        ("tests/data/dems/dales.tif", 25_600.0, 320),
    ],
    graphs: &[&[("glen", 300), ("fjords", 750), ("himalaya", 500), ("canyon", 550)]],
};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let file = arguments.next().ok_or("name the picture to write")?;
    let Sheet { side, models, graphs } = match arguments.next().as_deref() {
        None => MOUNTAINS,
        Some("valleys") => VALLEYS,
        Some(other) => return Err(format!("there is no sheet `{other}`, only `valleys`").into()),
    };
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    println!("| | cells | cell | median slope | p95/p50 | fullest bin | planar |\n|---|---|---|---|---|---|---|");
    let mut shades = Vec::new();
    for (model, size, cells) in models {
        let text = format!(
            "(format: 1, world: (size: {size}, cells: {cells}), nodes: {{ \"land\": Import(file: \"{model}\") }}, \
             outputs: {{ \"height\": \"land\" }})"
        );
        let land = built(&Document::parse(&text, &registry()), &root, cells)?;
        row(model, &land);
        shades.push(centre(&land, side));
    }
    for (graph, cells) in graphs.iter().copied().flatten() {
        let document = Document::load(root.join(format!("graphs/{graph}.ron")), &registry())?;
        let land = built(&document, &root.join("graphs"), *cells)?;
        row(&format!("graphs/{graph}.ron"), &land);
        shades.push(centre(&land, side));
    }
    let rows = (shades.len() as u32).div_ceil(COLUMNS);
    let pitch = side + GAP;
    let mut picture = GrayImage::from_pixel(COLUMNS * pitch, rows * pitch, Luma([255]));
    for (at, shade) in (0..).zip(&shades) {
        let [x, y] = [at % COLUMNS, at / COLUMNS].map(|place: u32| i64::from(place * pitch));
        image::imageops::replace(&mut picture, shade, x, y);
    }
    picture.save(file)?;
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
fn centre(land: &Field, side: u32) -> GrayImage {
    let shade = shade(land);
    let [left, top] = [shade.width(), shade.height()].map(|count| count.saturating_sub(side) / 2);
    image::imageops::crop_imm(&shade, left, top, side, side).to_image()
}
