//! The form of valley sections, which distinguishes troughs of glaciers from valleys of rivers.
//!
//! Sections of 5 km cross the largest valleys at right angles, one every 700 m or more. Each is cut at nine tenths of
//! the height of its lower ridge. The V-index is the area below that line over that of a V, less one (Zimmer and Gabet
//! 2018): 0 for a V, 0.33 for a parabola. The exponent is that of height over distance from the floor (Svensson 1959):
//! 1 for a V, 2 for a parabola. The valleys of British glaciers have 0.09 to 0.23 and 1.5 to 2.1, those of rivers -0.01
//! to 0.03 and 1.1 to 1.2.

use std::path::PathBuf;

use orograph_graph::{
    Boundary, Cancel, Edge, Field, Job, LevelJob, Node, NodeError, ParamValues, Wanted, Warnings, Window, World,
};
use orograph_nodes::numerics::{
    math,
    routing::{Depressions, Drainage, Grid, code::has_receiver, receivers},
};

/// Drainage area of a valley, and of one where no area is four times as large, in m².
const AREAS_M2: [f64; 2] = [1e7, 2e6];
/// Half of a section in metres.
const HALF_M: f64 = 2500.0;
/// Distance between sections in metres.
const APART_M: f64 = 700.0;
/// Length of a valley that gives its direction, up and down from the section, in metres.
const ALONG_M: f64 = 1000.0;
/// The least height of a section in metres.
const LEAST_M: f64 = 150.0;

/// The medians of valley sections.
#[derive(Clone, Copy, Debug)]
pub struct Valleys {
    /// Number of sections.
    pub count: usize,
    /// Area of a section over that of a V, less one.
    pub v_index: f64,
    /// Exponent of height over distance from the floor.
    pub exponent: f64,
}

impl Valleys {
    /// Measures heights. Returns None when there are fewer than five sections.
    #[must_use]
    pub fn of(land: &Field) -> Option<Self> {
        let network = Network::of(land).ok()?;
        let [mut indices, mut exponents] = [Vec::new(), Vec::new()];
        for places in network.sections(land) {
            let heights: Vec<f64> = places.into_iter().map(|[x, y]| bilinear(land, x, y)).collect();
            if let Some([index, exponent]) = section(&heights, land.window().cell_m()) {
                indices.push(index);
                exponents.push(exponent);
            }
        }
        let count = indices.len();
        let median = |mut values: Vec<f64>| {
            values.sort_unstable_by(f64::total_cmp);
            values[values.len() / 2]
        };
        (count >= 5).then(|| Self { count, v_index: median(indices), exponent: median(exponents) })
    }
}

/// The way of water, by steepest descent and through the lowest passes of depressions.
struct Network {
    nx: usize,
    /// The next cell downstream, and the cell upstream with the largest area; itself where there is none.
    down: Vec<usize>,
    up: Vec<usize>,
    /// Drainage area in cells.
    area: Vec<f64>,
}

impl Network {
    /// Water leaves at all sides, whatever the boundary of the world.
    fn of(land: &Field) -> Result<Self, NodeError> {
        let world = World { boundary: Boundary::all(Edge::Base), ..land.window().world };
        let (window, params) = (Window::whole(world), ParamValues::defaults(&[]));
        let job = Job {
            node: &Node::DEFAULT,
            params: &params,
            inputs: Vec::new(),
            window,
            wanted: Wanted::NONE,
            folder: PathBuf::new(),
            cancel: Cancel::default(),
            progress: &|_| {},
            level: LevelJob::default(),
            warnings: Warnings::default(),
            glimpses: None,
        };
        let grid = Grid::new(&window)?;
        let mut codes = vec![0; grid.cells()];
        receivers::d8(&job, &grid, land.samples(), &mut codes)?;
        let mut depressions = Depressions::default();
        depressions.find(&job, &grid, land.samples(), &codes)?;
        depressions.carve(&job, &grid, &mut codes)?;
        let mut area = vec![1.0; grid.cells()];
        Drainage::default().accumulate(&job, &grid, &codes, &mut area)?;

        let below = |(cell, code): (usize, &u8)| {
            if has_receiver(*code) { grid.receiver(cell as u32, *code) as usize } else { cell }
        };
        let down: Vec<usize> = codes.iter().enumerate().map(below).collect();
        let mut up: Vec<usize> = (0..grid.cells()).collect();
        for (cell, &below) in down.iter().enumerate().filter(|(cell, below)| cell != *below) {
            if up[below] == below || area[cell] > area[up[below]] {
                up[below] = cell;
            }
        }
        Ok(Self { nx: grid.nx, down, up, area })
    }

    /// The places of sections in cells, from the largest valley down.
    fn sections(&self, land: &Field) -> Vec<Vec<[f64; 2]>> {
        let (nx, ny, cell_m) = (self.nx, land.window().ny(), land.window().cell_m());
        let largest = self.area.iter().copied().fold(0.0, f64::max) * cell_m * cell_m;
        let least = if largest < 4.0 * AREAS_M2[0] { AREAS_M2[1] } else { AREAS_M2[0] } / (cell_m * cell_m);
        let mut cells: Vec<usize> = (0..nx * ny).filter(|&cell| self.area[cell] >= least).collect();
        cells.sort_unstable_by(|&a, &b| self.area[b].total_cmp(&self.area[a]).then(a.cmp(&b)));
        let steps = ((ALONG_M / cell_m).round() as usize).max(5);
        let (half, apart) = ((HALF_M / cell_m) as i64, (APART_M / cell_m) as usize);
        let mut used = vec![false; nx * ny];
        let mut sections = Vec::new();
        for cell in cells {
            if used[cell] {
                continue;
            }
            let walk = |next: &[usize]| (0..steps).fold(cell, |at, _| next[at]);
            let (below, above) = (walk(&self.down), walk(&self.up));
            let along = [0, 1].map(|axis| {
                let place = |cell: usize| if axis == 0 { (cell % nx) as f64 } else { (cell / nx) as f64 };
                place(below) - place(above)
            });
            let length = math::hypot(along[0], along[1]);
            if length < steps as f64 {
                continue;
            }
            let across = [-along[1] / length, along[0] / length];
            let centre = [(cell % nx) as f64, (cell / nx) as f64];
            let places: Vec<[f64; 2]> =
                (-half..=half).map(|t| [0, 1].map(|axis| centre[axis] + across[axis] * t as f64)).collect();
            let limits = [(nx - 1) as f64, (ny - 1) as f64];
            if places.iter().any(|place| (0..2).any(|axis| place[axis] < 0.0 || place[axis] > limits[axis])) {
                continue;
            }
            let (x, y) = (cell % nx, cell / nx);
            for y in y.saturating_sub(apart)..=(y + apart).min(ny - 1) {
                used[y * nx + x.saturating_sub(apart)..=y * nx + (x + apart).min(nx - 1)].fill(true);
            }
            sections.push(places);
        }
        sections
    }
}

fn bilinear(land: &Field, x: f64, y: f64) -> f64 {
    let nx = land.window().nx();
    let (i, j) = ((x as usize).min(nx - 2), (y as usize).min(land.window().ny() - 2));
    let (u, v) = (x - i as f64, y - j as f64);
    let at = |i: usize, j: usize| f64::from(land.samples()[j * nx + i]);
    (at(i, j) * (1.0 - u) + at(i + 1, j) * u) * (1.0 - v) + (at(i, j + 1) * (1.0 - u) + at(i + 1, j + 1) * u) * v
}

/// V-index and exponent of a section. Returns None where it is no valley.
fn section(heights: &[f64], cell_m: f64) -> Option<[f64; 2]> {
    let middle = heights.len() / 2;
    let floor = (middle.checked_sub(2)?..=middle + 2).min_by(|&a, &b| heights[a].total_cmp(&heights[b]))?;
    let above = |place: usize| heights[place] - heights[floor];
    let sides: [Vec<f64>; 2] = [(0..=floor).rev().map(above).collect(), (floor..heights.len()).map(above).collect()];
    let ridges = [ridge(&sides[0]), ridge(&sides[1])];
    let height = 0.9 * ridges[0].1.min(ridges[1].1);
    if height < LEAST_M || ridges.iter().any(|(cells, _)| *cells < 4) {
        return None;
    }
    let (mut width, mut area, mut exponents) = (0.0, 0.0, Vec::new());
    for side in &sides {
        let after = side.iter().position(|&above| above >= height)?;
        let end = after as f64 - (side[after] - height) / (side[after] - side[after - 1]);
        // trapezoids of what lies between the line and the ground
        let free = |place: usize| height - side[place].min(height);
        area += (1..after).map(|place| 0.5 * (free(place - 1) + free(place))).sum::<f64>();
        area += 0.5 * free(after - 1) * (end - (after - 1) as f64);
        width += end;
        let points: Vec<[f64; 2]> = (1..=end as usize)
            .filter(|&place| side[place] > 0.0)
            .map(|place| [math::ln(place as f64 * cell_m), math::ln(side[place])])
            .collect();
        if points.len() >= 4 {
            let mean = [0, 1].map(|axis| points.iter().map(|point| point[axis]).sum::<f64>() / points.len() as f64);
            let along: f64 = points.iter().map(|point| (point[0] - mean[0]) * (point[1] - mean[1])).sum();
            let square: f64 = points.iter().map(|point| (point[0] - mean[0]) * (point[0] - mean[0])).sum();
            exponents.push(along / square);
        }
    }
    let exponent = exponents.iter().sum::<f64>() / exponents.len() as f64;
    exponent.is_finite().then_some([area / (0.5 * width * height) - 1.0, exponent])
}

/// The cells to a ridge and its height: the highest place before the ground falls by a quarter of its height, or 30 m.
fn ridge(side: &[f64]) -> (usize, f64) {
    let mut highest = (0, 0.0);
    for (cells, &above) in side.iter().enumerate().skip(1) {
        if above > highest.1 {
            highest = (cells, above);
        } else if highest.1 - above > (0.25 * highest.1).max(30.0) {
            break;
        }
    }
    highest
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A valley that falls to the south along a column of cells, between ridges 4 km apart, with sections of a power.
    fn valley(power: f64) -> Field {
        let world = World { size: [12e3, 24e3], cells: [240, 480], ..World::default() };
        let window = Window::whole(world);
        let heights = (0..window.len()).map(|cell| {
            let [x, y] = window.centre_m(cell % 240, cell / 240);
            let across = ((x - 6025.0).abs() / 2000.0).min(1.0);
            let beyond = ((x - 6025.0).abs() - 2000.0).max(0.0);
            (500.0 * math::pow(across, power) - 0.4 * beyond - 0.01 * y) as f32
        });
        Field::new(window, heights.collect())
    }

    #[test]
    fn a_v_has_index_0_and_a_parabola_a_third() {
        for (power, index) in [(1.0, 0.0), (2.0, 1.0 / 3.0), (1.5, 0.2)] {
            let found = Valleys::of(&valley(power)).expect("sections");
            assert!((found.exponent - power).abs() < 0.03, "{power}: {found:?}");
            // sections are cut at nine tenths, where a power is still one
            assert!((found.v_index - index).abs() < 0.02, "{power}: {found:?}");
        }
    }
}
