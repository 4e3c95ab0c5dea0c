//! Pairs of grey hillshades, one of them of real land, for a blind test: `cargo run --release -p orograph-tests --example
//! pairs -- FOLDER SEED` writes 20 pictures, and the answers to `key.txt`. Show the pictures, without the key, to
//! somebody who has not worked on the terrain, and ask which half a program made.
//!
//! Both halves have cells of the same size. Each half is another place, made ones are means of finer cells, and real
//! ones too where the model is fine enough, so that the survey's noise tells nothing. Every half is turned and flipped at
//! random before it is lit.

use std::{collections::BTreeMap, error::Error, fmt::Write as _, path::Path};

use image::{GrayImage, Luma, imageops};
use orograph_graph::{Document, Field, Window, World};
use orograph_nodes::{
    raster::{GridAxis, resample},
    registry,
};
use orograph_tests::{
    Draw, Look,
    relief::{built, shade},
    root,
};

/// An elevation model of `tests/data/dems`, how many of its cells become one in each direction, and graphs of such land.
const PLACES: [(&str, usize, &[&str]); 5] = [
    ("bigtujunga", 2, &["coast_range", "ridges", "hello"]),
    ("frontrange", 1, &["alps", "two_ranges", "ridge", "coast_range"]),
    ("glencoe", 2, &["highlands"]),
    ("jacksboro", 1, &["hello", "foldbelt", "two_ranges"]),
    ("mandakini", 1, &["himalaya", "alps"]),
];
/// Number of pairs.
const PAIRS: usize = 20;
/// Cells along the side of a half.
const SIDE: usize = 90;
/// Pixels of a cell, and between halves.
const SCALE: usize = 5;
const GAP: usize = 10;
/// Places with a smaller median of the slopes above 5° are left out where there are steeper ones.
const STEEP: f64 = 12.0;
/// How often a place is drawn until it is steep and apart from the others of its terrain.
const DRAWS: usize = 3000;

/// A terrain, and the corners of what was shown of it.
struct Terrain {
    land: Field,
    shown: Vec<[usize; 2]>,
}

impl Terrain {
    /// Means over squares of `factor` cells.
    fn new(land: &Field, factor: usize) -> Result<Self, Box<dyn Error>> {
        let source = [land.window().nx(), land.window().ny()];
        let axes = source.map(|source| GridAxis { source, offset: 0.0, step: factor as f64 });
        let cells = source.map(|count| (count / factor) as u32);
        let samples = resample(land.samples(), axes, [0, 0], cells, None, &|| Ok(()))?;
        let cell_m = land.window().cell_m() * factor as f64;
        let world = World { size: cells.map(|count| f64::from(count) * cell_m), cells, ..World::default() };
        Ok(Self { land: Field::new(Window::whole(world), samples), shown: Vec::new() })
    }

    fn cell_m(&self) -> f64 {
        self.land.window().cell_m()
    }

    /// Heights of a square and of the cells around it, turned and flipped as `place` tells.
    fn part(&self, [left, top]: [usize; 2], place: impl Fn([usize; 2]) -> [usize; 2]) -> Field {
        let side = SIDE + 2;
        let world = World { size: [side as f64 * self.cell_m(); 2], cells: [side as u32; 2], ..World::default() };
        let sample = |cell: usize| {
            let [x, y] = place([cell % side, cell / side]);
            self.land.samples()[(top + y) * self.land.window().nx() + left + x]
        };
        Field::new(Window::whole(world), (0..side * side).map(sample).collect())
    }

    /// A hillshade of a place that was not shown yet: the first steep one that is drawn, or else the steepest.
    fn picture(&mut self, draw: &mut Draw) -> Result<GrayImage, Box<dyn Error>> {
        let counts = [self.land.window().nx(), self.land.window().ny()];
        if counts.iter().any(|&count| count < SIDE + 2) {
            return Err(format!("{} x {} cells are too few", counts[0], counts[1]).into());
        }
        let mut best: Option<(f64, [usize; 2])> = None;
        for _ in 0..DRAWS {
            let corner = counts.map(|count| draw.below(count - SIDE - 1));
            let is_near = |shown: &[usize; 2]| (0..2).all(|axis| shown[axis].abs_diff(corner[axis]) < SIDE * 4 / 5);
            if self.shown.iter().any(is_near) {
                continue;
            }
            let look = Look::of(&self.part(corner, |place| place));
            let Some(slope) = look.map(|look| look.median).filter(|slope| slope.is_finite()) else { continue };
            if best.is_none_or(|(steepest, _)| slope > steepest) {
                best = Some((slope, corner));
            }
            if slope > STEEP {
                break;
            }
        }
        let (_, corner) = best.ok_or("no place is left that was not shown")?;
        self.shown.push(corner);
        let (turns, flips) = (draw.below(4), draw.below(2) == 1);
        let turned = |place: [usize; 2]| {
            let flipped = if flips { [SIDE + 1 - place[0], place[1]] } else { place };
            (0..turns).fold(flipped, |[x, y], _| [y, SIDE + 1 - x])
        };
        let shade = shade(&self.part(corner, turned));
        Ok(imageops::crop_imm(&shade, 1, 1, SIDE as u32, SIDE as u32).to_image())
    }
}

/// A graph as means of 2 x 2 cells, so that its cells have this size.
fn made(graph: &str, cell_m: f64) -> Result<Terrain, Box<dyn Error>> {
    let document = Document::load(root().join(format!("graphs/{graph}.ron")), &registry())?;
    let cells = (document.world().size[0] / cell_m).round() as u32;
    Terrain::new(&built(&document, &root().join("graphs"), 2 * cells)?, 2)
}

fn model(name: &str, factor: usize) -> Result<Terrain, Box<dyn Error>> {
    let text = format!(
        "(format: 1, world: (from: \"{name}.tif\"), nodes: {{ \"land\": Import(file: \"{name}.tif\") }}, outputs: {{ \
         \"height\": \"land\" }})"
    );
    let folder = root().join("tests/data/dems");
    let document = Document::parse_at(text, folder.join("pairs.ron"), &registry());
    Terrain::new(&built(&document, &folder, document.world().cells[0])?, factor)
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let (Some(folder), Some(seed)) = (arguments.next(), arguments.next()) else {
        return Err("name a folder and a seed".into());
    };
    let (folder, mut draw) = (Path::new(&folder), Draw(seed.parse()?));
    std::fs::create_dir_all(folder)?;
    let mut terrains: BTreeMap<String, Terrain> = BTreeMap::new();
    let mut order: Vec<usize> = (0..PAIRS).collect();
    for at in (1..PAIRS).rev() {
        order.swap(at, draw.below(at + 1));
    }
    let mut key = String::new();
    for pair in 0..PAIRS {
        let (name, factor, graphs) = PLACES[order[pair] % PLACES.len()];
        if !terrains.contains_key(name) {
            terrains.insert(name.to_owned(), model(name, factor)?);
        }
        let cell_m = terrains[name].cell_m();
        let graph = graphs[draw.below(graphs.len())];
        let made_name = format!("{graph}.ron with cells of {cell_m:.0} m");
        if !terrains.contains_key(&made_name) {
            eprintln!("{made_name}");
            terrains.insert(made_name.clone(), made(graph, cell_m)?);
        }
        let mut halves = [name, made_name.as_str()].map(|name| {
            terrains.get_mut(name).ok_or_else(|| format!("no {name}").into()).and_then(|it| it.picture(&mut draw))
        });
        let is_right = draw.below(2) == 1;
        if !is_right {
            halves.swap(0, 1);
        }
        let [left, right] = halves;
        let side = (SIDE * SCALE) as u32;
        let mut picture = GrayImage::from_pixel(2 * side + GAP as u32, side, Luma([255]));
        for (half, at) in [(left?, 0), (right?, side as usize + GAP)] {
            let half = imageops::resize(&half, side, side, imageops::FilterType::CatmullRom);
            imageops::replace(&mut picture, &half, at as i64, 0);
        }
        picture.save(folder.join(format!("{:02}.png", pair + 1)))?;
        let half = if is_right { "right" } else { "left" };
        writeln!(key, "{:02}: the {half} half is made, of {made_name}; the other is {name}", pair + 1)?;
    }
    std::fs::write(folder.join("key.txt"), key)?;
    Ok(())
}
