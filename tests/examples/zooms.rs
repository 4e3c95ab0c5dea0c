//! Mountain graphs beside two elevation models each, with the same extent and the same cells of 80 m, at three zooms:
//! `cargo run --release -p orograph-tests --example zooms -- SHEET.png`. A row is a graph; each of its three groups shows
//! the graph and the two models, at first all that the smallest of them covers, then half and a quarter of that.

use std::{error::Error, path::Path};

use image::{GrayImage, Luma, imageops};
use orograph_graph::{Document, Field};
use orograph_nodes::registry;
use orograph_tests::relief::{built, shade};

/// Side of a cell in metres.
const CELL_M: f64 = 80.0;
/// Side of a picture, and gaps between pictures and between groups, in pixels.
const SIDE: u32 = 128;
const GAPS: [u32; 2] = [3, 12];
/// The largest extent in cells.
const MOST_CELLS: u32 = 300;

/// Elevation models: file, and extent in metres.
const MODELS: [(&str, f64); 5] = [
    ("tests/data/dems/mandakini.tif", 25_578.0),
    ("tests/data/dems/frontrange.tif", 40_960.0),
    ("tests/data/dems/glencoe.tif", 25_600.0),
    ("tests/data/dems/jacksboro.tif", 29_200.0),
    ("graphs/data/bigtujunga_512_30m.tif", 15_360.0),
];
/// Graphs and the two models beside each.
const GRAPHS: [(&str, [usize; 2]); 8] = [
    ("alps", [0, 1]),
    ("hello", [0, 1]),
    ("ridge", [2, 1]),
    ("two_ranges", [1, 3]),
    ("ridges", [4, 3]),
    ("belts", [4, 1]),
    ("carve_dem", [4, 1]),
    ("fault", [3, 2]),
];

fn main() -> Result<(), Box<dyn Error>> {
    let file = std::env::args().nth(1).ok_or("name the picture to write")?;
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let registry = registry();
    let model = |(file, size_m): (&str, f64)| {
        let text = format!(
            "(format: 1, world: (size: {size_m}, cells: {}), nodes: {{ \"land\": Import(file: \"{file}\") }}, outputs: \
             {{ \"height\": \"land\" }})",
            (size_m / CELL_M) as u32
        );
        built(&Document::parse(text, &registry), &root, (size_m / CELL_M) as u32)
    };
    let models: Vec<GrayImage> =
        MODELS.into_iter().map(|of| model(of).map(|land| shade(&land))).collect::<Result<_, _>>()?;
    let [gap, between] = GAPS;
    let group = 3 * (SIDE + gap) + between;
    let mut sheet = GrayImage::from_pixel(3 * group, GRAPHS.len() as u32 * (SIDE + gap), Luma([255]));
    for (row, (graph, beside)) in (0..).zip(GRAPHS) {
        let document = Document::load(root.join(format!("graphs/{graph}.ron")), &registry)?;
        let land: Field = built(&document, &root.join("graphs"), (document.world().size[0] / CELL_M).round() as u32)?;
        let pictures = [&shade(&land), &models[beside[0]], &models[beside[1]]];
        let sides = pictures.iter().map(|picture| picture.width().min(picture.height()));
        let extent = sides.min().unwrap_or(MOST_CELLS).min(MOST_CELLS);
        for zoom in 0..3 {
            for (at, picture) in (0..).zip(pictures) {
                let part = centre(picture, extent >> zoom);
                let part = imageops::resize(&part, SIDE, SIDE, imageops::FilterType::CatmullRom);
                let [x, y] = [zoom * group + at * (SIDE + gap), row * (SIDE + gap)].map(i64::from);
                imageops::replace(&mut sheet, &part, x, y);
            }
        }
    }
    sheet.save(file)?;
    Ok(())
}

/// The centre of a picture.
fn centre(picture: &GrayImage, side: u32) -> GrayImage {
    let [left, top] = [picture.width(), picture.height()].map(|count| (count - side) / 2);
    imageops::crop_imm(picture, left, top, side, side).to_image()
}
