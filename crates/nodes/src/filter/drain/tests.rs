//! Tests of the drained terrain: no hollows, closed forms of single hollows, terrain that is kept.

use orograph_graph::{Boundary, Edge, World};

use super::NODE;
use crate::{
    generate,
    numerics::routing::{Grid, Outlet},
    prelude::*,
    testing::{self, field, run, with_params, world},
};

/// Number of cells at which water stays, without the bottom of the sea.
fn pits(height: &Field, sea_m: Option<f64>) -> usize {
    let window = Window::whole(height.window().world);
    let grid = Grid::new(&window).expect("a way out");
    let sea = |cell: u32| sea_m.is_some_and(|sea_m| f64::from(height.samples()[cell as usize]) < sea_m);
    let is_pit = |&cell: &u32| {
        let own = height.samples()[cell as usize];
        let [x, y] = [cell as usize % grid.nx, cell as usize / grid.nx];
        let leaves = grid.outlet(x, y) != Outlet::No;
        let lower = (0..8).filter_map(|way| grid.neighbour(cell, way)).any(|at| height.samples()[at as usize] < own);
        !(lower || leaves || sea(cell))
    };
    (0..grid.cells() as u32).filter(is_pit).count()
}

fn noise(world: World, changes: &str) -> Field {
    testing::generate(Window::whole(world), &generate::perlin::NODE, changes)
}

fn sides(west: Edge, east: Edge, north: Edge, south: Edge) -> Boundary {
    Boundary { west, east, north, south }
}

/// On noise, a fifth of which lies in hollows, with all kinds of sides.
#[test]
fn no_cell_is_lower_than_its_neighbours_or_level_with_them() {
    let base = world(150, 130, 40.0);
    for boundary in [
        sides(Edge::Open, Edge::Open, Edge::Open, Edge::Open),
        sides(Edge::Base, Edge::Wall, Edge::Wall, Edge::Inland),
        sides(Edge::Periodic, Edge::Periodic, Edge::Base, Edge::Wall),
    ] {
        let height = noise(World { boundary, ..base }, "wavelength=1500,octaves=10,amplitude=400");
        assert!(pits(&height, None) > 100);
        for changes in ["", "cut=0", "cut=1", "cut=1,side_slope=60,fall=0", "fall=0.05"] {
            let drained = run(&NODE, &with_params(&NODE, changes), &[("height", &height)], "height");
            assert_eq!(pits(&drained, None), 0, "{boundary:?} {changes}");
        }
    }
}

/// A plane that falls to the south by 0.1, with a wall of 60 m across it that a pass of 40 m leads over.
fn dammed(cells: u32) -> Field {
    let cell_m = 5120.0 / f64::from(cells);
    let boundary = sides(Edge::Wall, Edge::Wall, Edge::Wall, Edge::Base);
    field(World { boundary, ..world(cells, cells, cell_m) }, |x, y| {
        let wall = (1.0 - (y - 2560.0).abs() / 300.0).max(0.0);
        0.1 * (5120.0 - y) + wall * (40.0 + 0.05 * (x - 2560.0).abs())
    })
}

/// The hollow in front of a wall: filled to the pass, cut to its bottom, or half of each.
#[test]
fn cut_and_fill_share_the_depth_of_a_hollow() {
    let height = dammed(256);
    let at = |x_m: f64, y_m: f64| (y_m / 20.0) as usize * 256 + (x_m / 20.0) as usize;
    let pass = height.samples()[at(2550.0, 2550.0)];
    let bottom = height.samples()[..at(0.0, 2400.0)].iter().copied().fold(f32::INFINITY, f32::min);
    assert!(pass - bottom > 8.0 && pass - bottom < 12.0, "{pass} {bottom}");
    for (changes, level) in [("cut=0", pass), ("cut=1", bottom), ("cut=0.5", 0.5 * (pass + bottom))] {
        let params = with_params(&NODE, &format!("{changes},fall=0.0001"));
        let drained = run(&NODE, &params, &[("height", &height)], "height");
        for place in [at(2550.0, 2270.0), at(2550.0, 2400.0), at(2550.0, 2550.0)] {
            // the floor rises by 0.3 m over 300 m at most, by the fall and half a cell
            let got = drained.samples()[place];
            assert!((got - level).abs() < 0.6, "{changes}: {got} {level}");
        }
        let [cut, fill] = ["cut", "fill"].map(|name| run(&NODE, &params, &[("height", &height)], name));
        for cell in 0..height.samples().len() {
            let moved = f64::from(drained.samples()[cell]) - f64::from(height.samples()[cell]);
            let told = f64::from(fill.samples()[cell]) - f64::from(cut.samples()[cell]);
            assert!((moved - told).abs() < 1e-3, "{moved} {told}"); // roundings of heights of some hundreds of metres
        }
    }
}

/// Across the pass, the terrain beside the cut is lowered as the page says: to 5 % of the depth, by which the crest of
/// the wall and the course differ from cell to cell.
#[test]
fn the_sides_of_a_cut_are_lowered_smoothly() {
    let height = dammed(512);
    let params = with_params(&NODE, "cut=1,side_slope=3,fall=0");
    let drained = run(&NODE, &params, &[("height", &height)], "height");
    let row = 255;
    let lowered = |x: usize| f64::from(height.samples()[row * 512 + x]) - f64::from(drained.samples()[row * 512 + x]);
    let middle = (200..312).max_by(|a, b| lowered(*a).total_cmp(&lowered(*b))).expect("cells");
    let depth_m = lowered(middle);
    let radius_m = 1.5396 * depth_m / 0.052_407_8; // the tangent of 3°
    assert!(depth_m > 8.0 && radius_m > 200.0, "{depth_m} {radius_m}");
    for away in 1..(radius_m / 10.0) as usize {
        let r = 10.0 * away as f64 / radius_m;
        let expected = depth_m * (1.0 - r * r) * (1.0 - r * r);
        for x in [middle - away, middle + away] {
            assert!((lowered(x) - expected).abs() < 0.05 * depth_m, "{away}: {} {expected}", lowered(x));
        }
    }
}

/// Hollows in the sides of cuts are cut too, and not filled: with `cut: 1` the fill is that of the minimum fall, and little
/// beside the cuts.
#[test]
fn hollows_in_the_sides_of_cuts_are_cut() {
    let height = noise(world(150, 130, 40.0), "wavelength=1500,octaves=10,amplitude=400");
    let params = with_params(&NODE, "cut=1,fall=0.0001");
    let [cut, fill] = ["cut", "fill"].map(|name| run(&NODE, &params, &[("height", &height)], name));
    let [cut, fill] = [cut, fill].map(|field| field.samples().iter().map(|&m| f64::from(m)).sum::<f64>());
    println!("fill over cut: {:.4}", fill / cut);
    assert!(fill < 0.001 * cut, "{fill} {cut}");
}

/// Terrain that drains keeps its bits; so does the bottom of the sea.
#[test]
fn what_drains_and_what_lies_under_the_sea_is_kept() {
    let plane = field(world(90, 80, 20.0), |x, y| 0.3 * (x + 0.5 * y));
    assert_eq!(run(&NODE, &with_params(&NODE, ""), &[("height", &plane)], "height"), plane);
    let height = testing::at_sea(&noise(world(150, 130, 40.0), "wavelength=1500,octaves=10,amplitude=400"), 0.0);
    let drained = run(&NODE, &with_params(&NODE, "cut=1"), &[("height", &height)], "height");
    assert_eq!(pits(&drained, Some(0.0)), 0);
    for (before, after) in height.samples().iter().zip(drained.samples()) {
        assert!(if *before < 0.0 { before == after } else { *after >= 0.0 }, "{before} {after}");
    }
}

/// Voids stay where they are, and water crosses them as it crosses what lies around them.
#[test]
fn voids_are_kept() {
    let whole = noise(world(60, 50, 40.0), "wavelength=900,octaves=8,amplitude=300");
    let is_void = |at: usize| (20..24).contains(&(at % 60)) && (18..25).contains(&(at / 60));
    let holed = |(at, height): (usize, &f32)| if is_void(at) { f32::NAN } else { *height };
    let height = Field::new(*whole.window(), whole.samples().iter().enumerate().map(holed).collect());
    let drained = run(&NODE, &with_params(&NODE, ""), &[("height", &height)], "height");
    assert!((0..60 * 50).all(|at| drained.samples()[at].is_nan() == is_void(at)));
    for output in ["cut", "fill"] {
        let moved = run(&NODE, &with_params(&NODE, ""), &[("height", &height)], output);
        assert!((0..60 * 50).all(|at| !is_void(at) || moved.samples()[at] == 0.0), "{output}");
    }
}

/// Level ground, ground far from 0, and a single row.
#[test]
fn flat_and_extreme_terrain_drains() {
    for value in [0.0, -1e6, 1e6] {
        let flat = field(world(33, 5, 1e-3), |_, _| value);
        let drained = run(&NODE, &with_params(&NODE, "fall=1e-9"), &[("height", &flat)], "height");
        assert_eq!(pits(&drained, None), 0, "{value}");
    }
    let row = field(world(64, 1, 10.0), |x, _| 50.0 * libm::sin(x / 40.0));
    let drained = run(&NODE, &with_params(&NODE, ""), &[("height", &row)], "height");
    assert_eq!(pits(&drained, None), 0);
}
