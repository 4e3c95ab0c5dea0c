//! Tests of `Flow`: against simple references, on real terrain with a unique drainage network, and for edge cases.

use orograph_graph::{Boundary, Edge, World, mix};

use super::NODE;
use crate::{numerics::routing::reference, prelude::*, testing};

/// White noise from 0 to 65536 m by position.
fn white(x: f64, y: f64) -> f64 {
    f64::from(mix((x * 8.0) as u32 ^ mix((y * 8.0) as u32))) / 65536.0
}

/// White noise, full of depressions.
pub(super) fn noise(world: World) -> Field {
    testing::field(world, white)
}

/// Hills with noise on top: large nested depressions next to small ones.
pub(crate) fn hills(world: World) -> Field {
    let wave = |at: f64, length_m: f64| (at / length_m).fract() - 0.5;
    testing::field(world, |x, y| 1500.0 + 4000.0 * wave(x, 310.0) * wave(y, 270.0) + white(x, y) / 1000.0)
}

pub(super) struct Drained {
    pub(super) area: Vec<f32>,
    pub(super) filled: Vec<f32>,
    pub(super) depth: Vec<f32>,
    pub(super) direction: Vec<f32>,
    pub(super) lake: Vec<f32>,
}

pub(super) fn flow(height: &Field, changes: &str) -> Drained {
    flow_with(&[("height", height)], changes)
}

pub(super) fn flow_with(inputs: &[(&str, &Field)], changes: &str) -> Drained {
    let params =
        if changes.is_empty() { ParamValues::defaults(&NODE.specs()) } else { testing::with_params(&NODE, changes) };
    let mut outputs = testing::outputs(&NODE, &params, inputs).expect("a result");
    let mut take = |name| outputs.take(name).expect("an output").as_field().expect("a field").clone().into_samples();
    Drained {
        area: take("area"),
        filled: take("conditioned"),
        depth: take("lake_depth"),
        direction: take("direction"),
        lake: take("lake"),
    }
}

pub(super) fn receivers(height: &Field, direction: &[f32]) -> Vec<Option<usize>> {
    let (nx, len) = (height.window().nx(), direction.len());
    let to = |cell: usize| {
        reference::neighbours(nx, len, cell).find(|(way, _)| *way as f32 == direction[cell]).map(|(_, next)| next)
    };
    (0..len).map(to).collect()
}

pub(super) fn area_that_leaves(drained: &Drained) -> f32 {
    drained.area.iter().zip(&drained.direction).filter(|(_, direction)| **direction == -1.0).map(|(area, _)| area).sum()
}

pub(super) fn with_boundary(world: World, boundary: Boundary) -> World {
    World { boundary, ..world }
}

/// Water that reaches the sea leaves the world: depressions spill into the sea, and drainage is the same as if the
/// coast were the world's side.
#[test]
fn drainage_ends_at_the_sea() {
    for height in [hills(testing::world(90, 70, 10.0)), noise(testing::world(60, 50, 10.0))] {
        let level = f64::from(height.samples().iter().sum::<f32>() / height.samples().len() as f32);
        let (nx, len) = (height.window().nx(), height.samples().len());
        let is_sea = |cell: usize| f64::from(height.samples()[cell]) < level;
        let ends = |cell: usize| is_sea(cell) || reference::on_border(nx, len, cell);
        for changes in ["", "depressions=fill", "routing=d_infinity", "routing=mfd"] {
            let wet = flow(&testing::at_sea(&height, level), changes);
            assert!(wet.filled == reference::priority_flood(nx, height.samples(), ends), "{changes}");
            for cell in (0..len).filter(|&cell| is_sea(cell)) {
                assert_eq!((wet.direction[cell], wet.depth[cell], wet.lake[cell]), (-1.0, 0.0, 0.0), "{changes}");
            }
            // all of the area drains somewhere
            let (left, all) = (f64::from(area_that_leaves(&wet)), len as f64 * 100.0);
            assert!((left / all - 1.0).abs() < 1e-4, "{changes}: {left} of {all}");
        }
    }
}

#[test]
fn filling_is_the_priority_flood_to_the_last_bit() {
    for (nx, ny) in [(1, 1), (1, 9), (9, 1), (2, 2), (3, 3), (17, 70), (200, 150)] {
        for edge in [Edge::Base, Edge::Open] {
            let world = with_boundary(testing::world(nx, ny, 10.0), Boundary::all(edge));
            for height in [noise(world), hills(world), Field::constant(Window::whole(world), 7.0)] {
                let result = flow(&height, "");
                let len = height.samples().len();
                let border = |cell| reference::on_border(nx as usize, len, cell);
                assert!(result.filled == reference::priority_flood(nx as usize, height.samples(), border));
                for cell in 0..len {
                    assert_eq!(result.depth[cell], result.filled[cell] - height.samples()[cell]);
                }
            }
        }
    }
}

#[test]
fn every_cell_drains_and_its_area_is_counted_exactly() {
    for (nx, ny) in [(1, 1), (1, 9), (9, 1), (2, 2), (3, 3), (17, 150), (200, 150)] {
        for edge in [Edge::Base, Edge::Open] {
            let world = with_boundary(testing::world(nx, ny, 10.0), Boundary::all(edge));
            for height in [noise(world), hills(world), Field::constant(Window::whole(world), 7.0)] {
                let result = flow(&height, "");
                let receivers = receivers(&height, &result.direction);
                let cells = reference::accumulate(&receivers).expect("no circles");
                let expected: Vec<f32> = cells.iter().map(|&cells| cells as f32 * 100.0).collect();
                assert!(result.area == expected);
                for cell in (0..receivers.len()).filter(|&cell| receivers[cell].is_none()) {
                    assert!(reference::on_border(nx as usize, receivers.len(), cell), "water stays at {cell}");
                }
            }
        }
    }
}

/// Real terrain with a unique drainage network, on which four other programs agree (see `tests/data/README.md`).
#[test]
fn real_land_drains_as_others_say() {
    let read =
        |name: &str| std::fs::read(format!("{}/../../tests/data/{name}", env!("CARGO_MANIFEST_DIR"))).expect(name);
    let heights = read("bigtujunga_drained_256.f32");
    let heights = heights.chunks_exact(4).map(|bytes| f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]));
    let heights: Vec<f32> = heights.collect();
    let directions = read("bigtujunga_drained_256_d8.u8");
    for (edge, shift) in [(Edge::Base, 0), (Edge::Open, 4)] {
        let world = with_boundary(testing::world(256, 256, 30.0), Boundary::all(edge));
        let height = Field::new(Window::whole(world), heights.clone());
        let result = flow(&height, "");
        let code = |byte: u8| byte >> shift & 15;
        let expected: Vec<f32> =
            directions.iter().map(|&byte| if code(byte) == 15 { -1.0 } else { f32::from(code(byte)) }).collect();
        assert!(result.direction == expected);
        assert!(result.filled == heights);
    }
}

#[test]
fn spreading_water_drains_real_land_as_others_say() {
    let path = |name: &str| format!("{}/../../tests/data/{name}", env!("CARGO_MANIFEST_DIR"));
    let numbers = |name: &str| -> Vec<f32> {
        let bytes = std::fs::read(path(name)).expect(name);
        bytes.chunks_exact(4).map(|bytes| f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])).collect()
    };
    let raster = |name: &str| crate::raster::read(path(name).as_ref()).expect(name).samples;
    let world = with_boundary(testing::world(256, 256, 1.0), Boundary::all(Edge::Base));
    for (heights, expected, every) in [
        (numbers("bigtujunga_drained_256.f32"), "bigtujunga_drained_256_spread.f32", 7),
        (raster("glencoe_drained_256.tif"), "glencoe_drained_256_spread.f32", 37),
        (raster("mandakini_drained_256.tif"), "mandakini_drained_256_spread.f32", 37),
    ] {
        let height = Field::new(Window::whole(world), heights);
        let samples = numbers(expected);
        let (d_infinity, mfd) = samples.split_at(samples.len() / 2);
        for (changes, samples) in [("routing=d_infinity", d_infinity), ("routing=mfd,exponent=1.1", mfd)] {
            let area = flow(&height, changes).area;
            assert_eq!(area.len().div_ceil(every), samples.len());
            for (found, sample) in area.iter().step_by(every).zip(samples) {
                // 1e-5: fractions and the result are in single precision
                assert!((found - sample).abs() <= 1e-5 * sample, "{expected}, {changes}: {found}, not {sample}");
            }
        }
    }
}

#[test]
fn spreading_water_is_conserved() {
    for changes in ["routing=d_infinity", "routing=mfd", "routing=mfd,exponent=20", "routing=mfd,exponent=0"] {
        for (nx, ny) in [(1, 9), (9, 1), (2, 2), (17, 150), (200, 150)] {
            for edge in [Edge::Base, Edge::Open] {
                let world = with_boundary(testing::world(nx, ny, 10.0), Boundary::all(edge));
                for height in [noise(world), hills(world), Field::constant(Window::whole(world), 7.0)] {
                    let left = area_that_leaves(&flow(&height, changes));
                    let all = (nx * ny * 100) as f32;
                    // 1e-5: sums of areas in single precision
                    assert!((left / all - 1.0).abs() < 1e-5, "{changes}, {nx} x {ny}: {left} of {all}");
                    let kept = flow(&height, &format!("{changes},depressions=keep"));
                    assert!((area_that_leaves(&kept) / all - 1.0).abs() < 1e-5, "{changes}: kept");
                }
            }
        }
    }
}

#[test]
fn with_only_one_open_side_everything_drains_there() {
    let south = |edge| Boundary { south: edge, ..Boundary::all(Edge::Wall) };
    for edge in [Edge::Base, Edge::Open] {
        let world = with_boundary(testing::world(40, 130, 5.0), south(edge));
        let height = hills(world);
        let result = flow(&height, "");
        let last = |cell: usize| cell / 40 == 129;
        assert!(result.filled == reference::priority_flood(40, height.samples(), last));
        assert!((0..40 * 130).all(|cell| result.direction[cell] >= 0.0 || last(cell)));
        assert_eq!(area_that_leaves(&result), 40.0 * 130.0 * 25.0);
    }
}

/// In a world periodic along x and open to the south, shifting the terrain along x shifts the lakes.
#[test]
fn periodic_sides_are_joined() {
    let sides = Boundary { west: Edge::Periodic, east: Edge::Periodic, north: Edge::Wall, south: Edge::Base };
    let world = with_boundary(testing::world(64, 100, 5.0), sides);
    let height = hills(world);
    let shift = |samples: &[f32]| -> Vec<f32> {
        (0..samples.len()).map(|cell| samples[cell / 64 * 64 + (cell + 23) % 64]).collect()
    };
    let shifted = Field::new(*height.window(), shift(height.samples()));
    let (one, other) = (flow(&height, ""), flow(&shifted, ""));
    assert!(shift(&one.filled) == other.filled);
    assert!(one.depth.iter().any(|&depth| depth > 0.0));
    for result in [one, other] {
        assert_eq!(area_that_leaves(&result), 64.0 * 100.0 * 25.0);
        assert!((0..64 * 99).all(|cell| result.direction[cell] >= 0.0));
    }
}

/// A metre of runoff a year from one square metre, in m³/s.
const METRE_PER_YEAR: f32 = 1.0 / 31_557_600.0;

#[test]
fn runoff_becomes_discharge() {
    let world = testing::world(90, 140, 10.0);
    let height = hills(world);
    for changes in ["", "depressions=jump", "routing=d_infinity", "routing=mfd"] {
        let params = testing::with_params(&NODE, changes);
        let of = |runoff: &Field, output: &str| {
            testing::run(&NODE, &params, &[("height", &height), ("runoff", runoff)], output).into_samples()
        };
        let plain = flow(&height, changes);
        let double = Field::constant(*height.window(), 2.0);
        assert_eq!(of(&double, "area"), plain.area);
        for (discharge, area) in of(&double, "discharge").iter().zip(&plain.area) {
            // 1e-6: two roundings to single precision
            assert!((discharge / (2.0 * area * METRE_PER_YEAR) - 1.0).abs() < 1e-6, "{changes}");
        }
        let east = testing::field(world, |x, _| if x > 450.0 { 1.0 } else { -1.0 });
        let wet = Drained { area: of(&east, "discharge"), ..plain };
        let leaves = area_that_leaves(&wet) / METRE_PER_YEAR;
        // 1e-5: a sum of discharges in single precision; negative runoff counts as 0
        assert!((leaves / (45.0 * 140.0 * 100.0) - 1.0).abs() < 1e-5, "{changes}: {leaves}");
    }
}

#[test]
fn kept_depressions_hold_their_water() {
    let world = testing::world(21, 21, 1.0);
    let bowl = testing::field(world, |x, y| 10.0 + (x - 10.5).abs().max((y - 10.5).abs()));
    let kept = flow(&bowl, "depressions=keep");
    let pit = 10 * 21 + 10;
    assert_eq!((kept.direction[pit], kept.area[pit]), (-1.0, 19.0 * 19.0));
    assert_eq!((kept.filled[pit], kept.depth[pit]), (20.0, 10.0));
    assert!(flow(&bowl, "").direction[pit] >= 0.0);
}

#[test]
fn ties_go_to_the_first_direction() {
    let world = testing::world(3, 3, 1.0);
    let peak = testing::field(world, |x, y| if x == 1.5 && y == 1.5 { 1.0 } else { 0.0 });
    assert_eq!(flow(&peak, "").direction[4], 0.0);
    let corner = Field::new(*peak.window(), vec![0.0, 0.5, 0.5, 0.5, 1.0, 0.5, 0.5, 0.5, 0.5]);
    assert_eq!(flow(&corner, "").direction[4], 3.0, "a drop of 1 across a corner is steeper than 0.5 across a side");
}

#[test]
fn a_world_without_an_outlet_says_what_to_do() {
    for edge in [Edge::Wall, Edge::Periodic] {
        let world = with_boundary(testing::world(8, 8, 1.0), Boundary::all(edge));
        let params = ParamValues::defaults(&NODE.specs());
        let error = testing::outputs(&NODE, &params, &[("height", &noise(world))]).expect_err("nowhere to drain to");
        assert!(matches!(&error, NodeError::Failed { hint: Some(hint), .. } if hint.contains("`boundary`")), "{error}");
    }
    let lone = Boundary { west: Edge::Periodic, ..Boundary::default() };
    let world = with_boundary(testing::world(8, 8, 1.0), lone);
    let params = ParamValues::defaults(&NODE.specs());
    assert!(testing::outputs(&NODE, &params, &[("height", &noise(world))]).is_err());
}

#[test]
fn heights_that_are_not_numbers_do_no_harm() {
    let world = testing::world(30, 90, 1.0);
    let mut samples = noise(world).into_samples();
    samples[95] = f32::NAN;
    samples[700] = f32::INFINITY;
    samples[1500] = f32::NEG_INFINITY;
    let height = Field::new(Window::whole(world), samples);
    let result = flow(&height, "");
    assert!(reference::accumulate(&receivers(&height, &result.direction)).is_some());
}

#[test]
fn the_same_for_any_thread_count_and_simd_level() {
    let world = testing::world(150, 200, 10.0);
    let (height, runoff) = (hills(world), noise(world));
    let params = ParamValues::defaults(&NODE.specs());
    let fields = [("height", &height), ("runoff", &runoff)];
    assert_eq!(testing::run_in(1, &NODE, &params, &fields), testing::run_in(7, &NODE, &params, &fields));
    testing::at_every_level(|| testing::outputs(&NODE, &params, &fields));
    for changes in ["routing=d_infinity", "routing=mfd"] {
        let params = testing::with_params(&NODE, changes);
        assert_eq!(testing::run_in(1, &NODE, &params, &fields), testing::run_in(7, &NODE, &params, &fields));
    }
}
