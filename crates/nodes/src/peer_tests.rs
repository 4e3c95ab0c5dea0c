//! Small cases from the tests of other landscape programs (fastscapelib, Landlab, RichDEM), in
//! `tests/data/peer_cases`. Where a program's conventions differ from ours, the test describes how it adapts them.

use orograph_graph::{Boundary, Edge, World};
use serde_json::Value as Json;

use crate::{
    erosion::stream_power,
    hydrology::flow,
    numerics::routing::{
        Drainage, Grid,
        code::{BORDER, OUTLET, PIT, STEPS},
    },
    prelude::*,
    testing,
};

fn case(id: &str) -> Json {
    let path = format!("{}/../../tests/data/peer_cases/{id}.json", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path}: {error}"));
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// Returns the numbers of a raster, row by row, or of one row.
fn numbers(value: &Json) -> Vec<f64> {
    match value {
        Json::Array(items) => items.iter().flat_map(numbers).collect(),
        other => vec![other.as_f64().expect("a number")],
    }
}

fn singles(value: &Json) -> Vec<f32> {
    numbers(value).iter().map(|v| *v as f32).collect()
}

/// Returns the case's input on a world of its size with the given sides.
fn input(case: &Json, boundary: Boundary) -> Field {
    let rows = case["input"].as_array().expect("rows");
    let columns = rows[0].as_array().expect("a row").len();
    let world = testing::world(columns as u32, rows.len() as u32, case["dx"].as_f64().unwrap_or(1.0));
    Field::new(Window::whole(World { boundary, ..world }), singles(&case["input"]))
}

/// Returns 1 inside and 0 on the border, for programs in which border cells have no area.
fn without_border(land: &Field) -> Field {
    let (nx, ny) = (land.window().nx(), land.window().ny());
    let inside = |at: usize| (1..nx - 1).contains(&(at % nx)) && (1..ny - 1).contains(&(at / nx));
    Field::new(*land.window(), (0..nx * ny).map(|at| f32::from(u8::from(inside(at)))).collect())
}

fn flow(fields: &[(&str, &Field)], changes: &str, output: &str) -> Vec<f32> {
    testing::run(&flow::NODE, &testing::with_params(&flow::NODE, changes), fields, output).into_samples()
}

/// Returns the drainage area of each cell in whole square metres, where only selected cells count.
fn area_from(land: &Field, counts: &Field) -> Vec<f32> {
    const SECONDS_PER_YEAR: f32 = 31_557_600.0;
    let discharge = flow(&[("height", land), ("runoff", counts)], "", "discharge");
    discharge.iter().map(|discharge| (discharge * SECONDS_PER_YEAR).round()).collect()
}

/// Base level at both ends of a row of cells, with walls along it.
const PROFILE: Boundary = Boundary { west: Edge::Base, east: Edge::Base, north: Edge::Wall, south: Edge::Wall };

#[test]
fn receivers_of_a_profile() {
    let case = case("FS04_profile_receivers");
    let land = input(&case, PROFILE);
    let direction = flow(&[("height", &land)], "depressions=keep", "direction");
    let step = |direction: f32| if direction < 0.0 { 0 } else { STEPS[direction as usize].0 };
    let receivers: Vec<f64> = (0..).zip(&direction).map(|(at, way)| f64::from(at + step(*way))).collect();
    assert_eq!(receivers, numbers(&case["expected"]["receiver"]));
}

#[test]
fn a_short_step_of_stream_power_is_an_explicit_one() {
    let case = case("FS05_spl_small_dt_equals_explicit");
    let land = input(&case, PROFILE);
    // a node of their profile drains its length, a cell of ours its area: 300 times as much, at m = 0.5
    let erodibility = case["params"]["K"].as_f64().expect("K") / 300.0_f64.sqrt();
    let [erodibility, repose, diffusivity] =
        [erodibility as f32, 90.0, 0.0].map(|v| Field::constant(*land.window(), v));
    let plain = "schedule=full,headwater_area=0,valley_width=0,rounding=0,winding=0,variation=0,repose_variation=0,\
                 receivers=d8";
    let params = testing::with_params(&stream_power::NODE, &format!("{plain},duration=1,time_step=1"));
    let fields = [("height", &land), ("erodibility", &erodibility), ("repose", &repose), ("diffusivity", &diffusivity)];
    let found = testing::run(&stream_power::NODE, &params, &fields, "erosion").into_samples();
    let expected = numbers(&case["expected"]["erosion"]);
    for (found, expected) in found.iter().zip(expected) {
        // an implicit and an explicit step of x differ by x², here 3.3e-9
        assert!((f64::from(*found) - expected).abs() < 5e-9, "{found} for {expected}");
    }
}

#[test]
fn a_sheet_of_water_drains_row_by_row() {
    let case = case("LL01_sheet_flow_D8");
    let land = input(&case, Boundary::all(Edge::Base));
    let area = area_from(&land, &without_border(&land));
    assert_eq!(area, singles(&case["expected"]["area"]));
}

#[test]
fn a_lake_fills_to_its_outlet_and_drains_through_it() {
    let case = case("LL03_depression_reroute");
    let land = input(&case, Boundary::all(Edge::Base));
    assert_eq!(flow(&[("height", &land)], "", "conditioned"), singles(&case["expected"]["filled"]));
    let inside = without_border(&land);
    let area = area_from(&land, &inside);
    let outlet = &case["expected"]["outlet"];
    let [row, column, cells] = ["row", "column", "cells"].map(|name| outlet[name].as_f64().expect("a number"));
    assert_eq!(area[row as usize * land.window().nx() + column as usize], cells as f32);
    let left: f32 = area.iter().zip(inside.samples()).filter(|(_, inside)| **inside == 0.0).map(|(area, _)| area).sum();
    assert_eq!(left, 25.0, "all of the 5 x 5 cells inside leave");
}

/// The plane x + (√2 − 1) y, whose steepest descent is halfway between west and north-west.
#[test]
fn a_plane_halfway_between_two_directions_is_shared_evenly() {
    let case = case("LL07_dinf_equal_split");
    let land = input(&case, Boundary::all(Edge::Base));
    let nx = land.window().nx();
    let area = flow(&[("height", &land)], "routing=d_infinity", "area");
    let at = |x: usize, y: usize| area[y * nx + x];
    for (x, y) in (1..nx - 2).flat_map(|x| (1..nx - 2).map(move |y| (x, y))) {
        let expected = 1.0 + 0.5 * at(x + 1, y) + 0.5 * at(x + 1, y + 1);
        // 2e-5: heights are rounded to single precision, and fractions depend on small differences of heights
        assert!((at(x, y) / expected - 1.0).abs() < 2e-5, "({x}, {y}): {}, not {expected}", at(x, y));
    }
}

#[test]
fn cells_are_counted_along_given_directions() {
    for (id, size) in [("RD104_pointer_accumulation_4", 10), ("RD111_pointer_accumulation_11", 15)] {
        let case = case(id);
        let window = *input(&case, Boundary::default()).window();
        let grid = Grid::new(&window).expect("a grid");
        // their directions are numbered clockwise from west, starting at 1; 0 is none
        let code = |cell: usize, pointer: f64| {
            let (i, j) = (cell % size, cell / size);
            let border = if i == 0 || j == 0 || i + 1 == size || j + 1 == size { BORDER } else { 0 };
            if pointer == 0.0 {
                return border | PIT;
            }
            let direction = (13 - pointer as usize) % 8;
            border | if grid.neighbour(cell as u32, direction).is_some() { direction as u8 } else { OUTLET }
        };
        let pointers = numbers(&case["input"]);
        let codes: Vec<u8> = pointers.iter().enumerate().map(|(cell, pointer)| code(cell, *pointer)).collect();
        let mut cells = vec![1_u32; codes.len()];
        testing::with_job(window, |job| Drainage::default().accumulate(job, &grid, &codes, &mut cells))
            .expect("not stopped");
        let cells: Vec<f64> = cells.into_iter().map(f64::from).collect();
        assert_eq!(cells, numbers(&case["expected"]["accumulation"]), "{id}");
    }
}

#[test]
fn a_flat_without_a_depression_stays_and_drains_to_the_border() {
    let case = case("RD2_garbrecht_flat_resolution");
    let land = input(&case, Boundary::all(Edge::Base));
    assert_eq!(flow(&[("height", &land)], "", "conditioned"), singles(&case["expected"]["filled"]));
    let [area, direction] = ["area", "direction"].map(|output| flow(&[("height", &land)], "", output));
    let inside = without_border(&land);
    let ends = |at: &usize| direction[*at] < 0.0;
    assert!((0..area.len()).filter(ends).all(|at| inside.samples()[at] == 0.0), "water stays inside");
    let left: f32 = (0..area.len()).filter(ends).map(|at| area[at]).sum();
    assert_eq!(left, 49.0 * 9.0, "the area of all cells of 3 m");
}
