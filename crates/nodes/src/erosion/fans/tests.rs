//! Tests of fans: areas and surfaces against the laws, rivers, cells of different sizes, sides and voids.

use orograph_graph::{Boundary, Cancel, Edge, Value, World};

use super::{NODE, Params, Shape};
use crate::{
    numerics::{math, routing::reference},
    prelude::*,
    testing,
};

/// Where the plain ends and the mountains begin, in metres from the north.
const FRONT_M: f64 = 3200.0;

fn world(cells: u32) -> World {
    let side_m = 5120.0;
    let boundary = Boundary { west: Edge::Periodic, east: Edge::Periodic, north: Edge::Wall, south: Edge::Base };
    World { boundary, ..testing::world(cells, cells, side_m / f64::from(cells)) }
}

/// A plain in the south, and a mountainside in the north with a gully at `gully_m` that is 400 m wide.
fn front(cells: u32, gully_m: f64) -> Field {
    let world = world(cells);
    testing::field(world, |x, y| {
        let away_m = ((x - gully_m).abs()).min(world.size[0] - (x - gully_m).abs());
        let mountain_m = 0.35 * (FRONT_M - y).max(0.0) + if y < FRONT_M { 0.4 * away_m.min(200.0) } else { 0.0 };
        mountain_m + 0.004 * (world.size[1] - y)
    })
}

struct Laid {
    height: Vec<f32>,
    thickness: Vec<f32>,
    report: Report,
}

impl Laid {
    fn new(height: &Field, changes: &str) -> Self {
        let params = testing::with_params(&NODE, changes);
        let mut outputs = testing::outputs(&NODE, &params, &[("height", height)]).expect("a result");
        let mut value = |name: &str| outputs.take(name).expect("an output");
        let samples = |value: Value| value.as_field().expect("a field").clone().into_samples();
        Self {
            height: samples(value("height")),
            thickness: samples(value("thickness")),
            report: value("report").as_report().expect("a report").clone(),
        }
    }

    fn measure(&self, name: &str) -> f64 {
        self.report.get(name).expect("a measure")
    }
}

/// The area and the surface of a fan on a plain are those of the laws, and the fan is round.
#[test]
fn a_fan_at_a_mountain_front_follows_the_laws() {
    let (cells, cell_m) = (512, 10.0);
    let laid = Laid::new(&front(cells, 2555.0), "");
    assert!((laid.measure("fans") - 1.0).abs() < 1e-9, "{:?}", laid.report);
    let area_km2 = 1e-6 * laid.measure("area");
    let catchment_km2 = math::pow(area_km2 / 0.2, 1.0 / 0.9);
    // 400 m wide, and as long as the mountainside
    assert!((catchment_km2 / (0.4 * 1e-3 * FRONT_M) - 1.0).abs() < 0.1, "{catchment_km2}");

    let params = Params::read(&testing::with_params(&NODE, ""));
    let mut shape = Shape::of(1e6 * catchment_km2, 0.2, &params);
    // a fan is gentler than its stream
    shape.slope = shape.slope.min(0.7 * 0.354);
    let nx = cells as usize;
    let covered = |cell: &usize| laid.thickness[*cell] > 0.0;
    let top = |cell: usize| f64::from(laid.height[cell]);
    let apex = (0..nx * nx).filter(covered).max_by(|a, b| top(*a).total_cmp(&top(*b))).expect("an apex");
    let place = |cell: usize| [(cell % nx) as f64, (cell / nx) as f64];
    let (mut in_view, mut worst) = (0, 0.0_f64);
    for cell in (0..nx * nx).filter(covered).filter(|cell| cell_m * place(*cell)[1] > FRONT_M) {
        let [dx, dy] = [0, 1].map(|axis| place(cell)[axis] - place(apex)[axis]);
        let distance_m = cell_m * (dx * dx + dy * dy).sqrt();
        let low_m = top(apex) - shape.fall_m(distance_m) - top(cell);
        // to the sides, the walls of the gully are in the way, so that the way is longer
        assert!(low_m > -0.01 * shape.slope * distance_m, "{low_m} m at {dx}, {dy}");
        if dx.abs() < 0.3 * dy {
            worst = worst.max(low_m / (shape.slope * distance_m));
            in_view += 1;
        }
    }
    // the scheme is exact along rows and columns, and a few percent long in between
    assert!(in_view > 500 && worst < 0.04, "{in_view} cells, {worst}");
}

#[test]
fn a_fan_is_nearly_the_same_on_cells_of_different_size() {
    let [coarse, fine] = [256, 512].map(|cells| Laid::new(&front(cells, 2555.0), ""));
    for (name, most) in [("area", 0.05), ("volume", 0.1), ("greatest_thickness", 0.1)] {
        let ratio = coarse.measure(name) / fine.measure(name);
        assert!((ratio - 1.0).abs() < most, "{name}: {ratio}");
    }
}

#[test]
fn a_fan_crosses_a_periodic_side() {
    let cells = 256_usize;
    let [middle, side] = [2550.0, 10.0].map(|gully_m| Laid::new(&front(cells as u32, gully_m), ""));
    let shift = 127;
    for cell in 0..cells * cells {
        let (x, y) = (cell % cells, cell / cells);
        let moved = y * cells + (x + cells - shift) % cells;
        let apart = (middle.thickness[cell] - side.thickness[moved]).abs();
        assert!(apart < 1e-3, "{apart} m at {x}, {y}");
    }
}

/// A valley with a river, into which a gully leads: the fan pushes the river aside, and nothing is dammed.
#[test]
fn a_river_finds_its_way_around_a_fan() {
    let world = world(256);
    let valley = testing::field(world, |x, y| {
        let wall_m = ((x - 3200.0).abs() - 80.0).max(0.0);
        let gully_m = if x < 3120.0 { 0.6 * (0.5 * (y - 2565.0).abs()).min(wall_m).min(150.0) } else { 0.0 };
        0.01 * (world.size[1] - y) + 0.35 * wall_m + gully_m
    });
    let laid = Laid::new(&valley, "smallest=1e5");
    assert!(laid.measure("fans") >= 1.0, "{:?}", laid.report);
    let nx = 256;
    let level = reference::priority_flood(nx, &laid.height, |cell| cell >= nx * (nx - 1));
    let dammed = level.iter().zip(&laid.height).map(|(level, height)| level - height).fold(0.0, f32::max);
    assert!(dammed < 0.01, "{dammed} m of water");
    let cut = laid.thickness.iter().copied().fold(0.0, f32::min);
    assert!(cut > -12.01, "{cut}");
}

#[test]
fn nothing_changes_without_fans() {
    let land = front(128, 2560.0);
    for changes in ["smallest=1e9", "largest=0"] {
        let laid = Laid::new(&land, changes);
        assert!(laid.height == land.samples() && laid.measure("fans") < 0.5, "{changes}");
    }
}

#[test]
fn voids_stay() {
    let mut samples = front(256, 2555.0).into_samples();
    let voids = [100, 256 * 170 + 127, 256 * 255];
    voids.iter().for_each(|cell| samples[*cell] = f32::NAN);
    let laid = Laid::new(&Field::new(Window::whole(world(256)), samples), "");
    let found: Vec<usize> = (0..laid.height.len()).filter(|cell| laid.height[*cell].is_nan()).collect();
    assert_eq!(found, voids);
    assert!(laid.thickness.iter().all(|thickness| thickness.is_finite()));
}

/// Where the parameters or the cells allow no fan anywhere, a warning says so; it says nothing of land without mouths.
#[test]
fn a_warning_says_why_there_are_no_fans() {
    let warned = |changes: &str, land: &Field| {
        let params = testing::with_params(&NODE, changes);
        let fields = [("height", land)];
        let (outputs, warnings) =
            testing::outputs_and_warnings(&Cancel::default(), *land.window(), &NODE, &params, &fields);
        assert!(outputs.is_ok());
        warnings
    };
    let land = front(256, 2555.0);
    assert_eq!(warned("smallest=1e6,largest=1e5", &land).len(), 1);
    // 0.2 km² times 0.01 to the power of 0.9 is 0.003 km², and 12 cells of 20 m are 0.0048 km²
    let warnings = warned("smallest=100,largest=1e4", &land);
    assert!(warnings.len() == 1 && warnings[0].contains("0.003 km², and 12 cells cover 0.005 km²"), "{warnings:?}");
    let flat = Field::new(*land.window(), vec![0.0; land.samples().len()]);
    for (changes, land) in [("", &land), ("", &flat), ("largest=0,smallest=0", &land)] {
        assert!(warned(changes, land).is_empty(), "{changes}");
    }
}
