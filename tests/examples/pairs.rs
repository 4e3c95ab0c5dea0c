//! Pairs of grey hillshades, one of them of real land, for a blind test: `cargo run --release -p orograph-tests --example
//! pairs -- FOLDER SEED` writes 20 pictures, and the answers to `key.txt`. Show the pictures, without the key, to
//! somebody who has not worked on the terrain, and ask which half a program made.
//!
//! Both halves have cells of the same size. Each half is another place, made ones are means of finer cells, and real
//! ones too where the model is fine enough, so that the survey's noise tells nothing. Every half is turned and flipped at
//! random before it is lit.

use std::{collections::BTreeMap, error::Error, fmt::Write as _, path::Path};

use image::{GrayImage, Luma, imageops};
use orograph_graph::{Document, Field, mix};
use orograph_nodes::registry;
use orograph_tests::{
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
/// Land with a smaller median slope is left out where there is steeper land, in metres per metre.
const STEEP: f64 = 0.16;
/// How often a place is drawn until it is steep and apart from the others of its terrain.
const DRAWS: usize = 3000;

/// Random numbers.
struct Draws(u32);

impl Draws {
    fn below(&mut self, count: usize) -> usize {
        self.0 = mix(self.0.wrapping_add(0x9E37_79B9));
        self.0 as usize % count
    }
}

/// A terrain, and the corners of what was shown of it.
struct Terrain {
    heights: Vec<f64>,
    nx: usize,
    ny: usize,
    cell_m: f64,
    shown: Vec<[usize; 2]>,
}

impl Terrain {
    /// Means over squares of `factor` cells.
    fn new(land: &Field, factor: usize) -> Self {
        let [nx, ny] = [land.window().nx(), land.window().ny()].map(|count| count / factor);
        let mean = |cell: usize| {
            let (x, y) = (cell % nx * factor, cell / nx * factor);
            let cells = (0..factor * factor).map(|at| (y + at / factor) * land.window().nx() + x + at % factor);
            cells.map(|cell| f64::from(land.samples()[cell])).sum::<f64>() / (factor * factor) as f64
        };
        let heights = (0..nx * ny).map(mean).collect();
        Self { heights, nx, ny, cell_m: land.window().cell_m() * factor as f64, shown: Vec::new() }
    }

    fn is_large_enough(&self) -> bool {
        self.nx.min(self.ny) >= SIDE + 2
    }

    /// The median slope of every other cell of a square, or none where it has no data.
    fn slope(&self, [left, top]: [usize; 2]) -> Option<f64> {
        let at = |x: usize, y: usize| self.heights[(top + y) * self.nx + left + x];
        let cells = (0..SIDE * SIDE / 4).map(|cell| (1 + cell % (SIDE / 2) * 2, 1 + cell / (SIDE / 2) * 2));
        let mut slopes: Vec<f64> = cells
            .map(|(x, y)| {
                let (east, south) = (at(x + 1, y) - at(x - 1, y), at(x, y + 1) - at(x, y - 1));
                (east * east + south * south).sqrt() / (2.0 * self.cell_m)
            })
            .collect();
        slopes.sort_unstable_by(f64::total_cmp);
        slopes.last().filter(|last| last.is_finite())?;
        Some(slopes[slopes.len() / 2])
    }

    /// A hillshade of a place that was not shown yet: the first steep one that is drawn, or else the steepest.
    fn picture(&mut self, draws: &mut Draws) -> Result<GrayImage, Box<dyn Error>> {
        let mut best: Option<(f64, [usize; 2])> = None;
        for _ in 0..DRAWS {
            let corner = [self.nx, self.ny].map(|count| draws.below(count - SIDE - 1));
            let is_near = |shown: &[usize; 2]| (0..2).all(|axis| shown[axis].abs_diff(corner[axis]) < SIDE * 4 / 5);
            let Some(slope) = self.slope(corner).filter(|_| !self.shown.iter().any(is_near)) else { continue };
            if best.is_none_or(|(steepest, _)| slope > steepest) {
                best = Some((slope, corner));
            }
            if slope > STEEP {
                break;
            }
        }
        let (_, corner) = best.ok_or("no place is left that was not shown")?;
        self.shown.push(corner);
        let (turns, flips) = (draws.below(4), draws.below(2) == 1);
        let last = SIDE as isize - 1;
        Ok(shade(SIDE, self.cell_m, |mut x, mut y| {
            if flips {
                x = last - x;
            }
            for _ in 0..turns {
                (x, y) = (y, last - x);
            }
            let [column, row] = [(corner[0], x), (corner[1], y)].map(|(from, at)| from.saturating_add_signed(at + 1));
            self.heights[row * self.nx + column]
        }))
    }
}

/// A graph as means of 2 x 2 cells, so that its cells have this size.
fn made(graph: &str, cell_m: f64) -> Result<Terrain, Box<dyn Error>> {
    let document = Document::load(root().join(format!("graphs/{graph}.ron")), &registry())?;
    let cells = (document.world().size[0] / cell_m).round() as u32;
    Ok(Terrain::new(&built(&document, &root().join("graphs"), 2 * cells)?, 2))
}

fn model(name: &str, factor: usize) -> Result<Terrain, Box<dyn Error>> {
    let text = format!(
        "(format: 1, world: (from: \"{name}.tif\"), nodes: {{ \"land\": Import(file: \"{name}.tif\") }}, outputs: {{ \
         \"height\": \"land\" }})"
    );
    let folder = root().join("tests/data/dems");
    let document = Document::parse_at(text, folder.join("pairs.ron"), &registry());
    Ok(Terrain::new(&built(&document, &folder, document.world().cells[0])?, factor))
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let (Some(folder), Some(seed)) = (arguments.next(), arguments.next()) else {
        return Err("name a folder and a seed".into());
    };
    let (folder, mut draws) = (Path::new(&folder), Draws(seed.parse()?));
    std::fs::create_dir_all(folder)?;
    let mut terrains: BTreeMap<String, Terrain> = BTreeMap::new();
    let mut order: Vec<usize> = (0..PAIRS).collect();
    for at in (1..PAIRS).rev() {
        order.swap(at, draws.below(at + 1));
    }
    let mut key = String::new();
    for pair in 0..PAIRS {
        let (name, factor, graphs) = PLACES[order[pair] % PLACES.len()];
        if !terrains.contains_key(name) {
            terrains.insert(name.to_owned(), model(name, factor)?);
        }
        let cell_m = terrains[name].cell_m;
        let graph = graphs[draws.below(graphs.len())];
        let made_name = format!("{graph}.ron with cells of {cell_m:.0} m");
        if !terrains.contains_key(&made_name) {
            eprintln!("{made_name}");
            terrains.insert(made_name.clone(), made(graph, cell_m)?);
        }
        let mut halves = [name, made_name.as_str()].map(|name| -> Result<GrayImage, Box<dyn Error>> {
            let terrain = terrains.get_mut(name).filter(|terrain| terrain.is_large_enough());
            terrain.ok_or_else(|| format!("{name} is too small"))?.picture(&mut draws)
        });
        let is_right = draws.below(2) == 1;
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
