//! Tests of river incision: closed forms, other programs' results, a plain reference, and inputs at the edge of sense.

use orograph_graph::{Boundary, Cancel, Edge, Wanted, World, mix};

use super::NODE;
use crate::{
    numerics::{math, routing::reference},
    prelude::*,
    testing,
};

/// Rivers alone: without debris flows, floors, rounding and long waves of rock.
pub const RIVERS: &str = "schedule=full,headwater_area=0,critical_area=2e4,valley_width=0,rounding=0,winding=0,variation=0.3,\
                      variation_size=0,repose_variation=0";
/// The law alone, but for the limit of slopes.
pub const PLAIN: &str = "schedule=full,critical_area=0,winding=0,variation=0,receivers=d8";

struct Case<'a> {
    height: &'a Field,
    uplift: f64,
    erodibility: f64,
    repose: f64,
    changes: String,
}

impl Case<'_> {
    fn outputs(&self) -> Outputs {
        let constant = |value: f64| Field::constant(*self.height.window(), value as f32);
        let (uplift, erodibility, repose) = (constant(self.uplift), constant(self.erodibility), constant(self.repose));
        let fields = [("height", self.height), ("uplift", &uplift), ("erodibility", &erodibility), ("repose", &repose)];
        outputs(&self.changes, &fields).expect("a result")
    }

    fn take(&self, output: &str) -> Vec<f32> {
        self.outputs().take(output).expect("an output").as_field().expect("a field").clone().into_samples()
    }

    fn height(&self) -> Vec<f32> {
        self.take("height")
    }
}

pub fn white(x: f64, y: f64) -> f64 {
    f64::from(mix((x * 8.0) as u32 ^ mix((y * 8.0) as u32))) / 4_294_967_296.0
}

/// One row of cells from a divide in the west to a base cell in the east.
pub fn strip(cells: u32, start: impl Fn(f64) -> f64) -> Field {
    let boundary = Boundary { east: Edge::Base, ..Boundary::all(Edge::Wall) };
    let world = World { boundary, ..testing::world(cells + 1, 1, 100.0) };
    let end_m = f64::from(cells) * 100.0;
    testing::field(world, |x, _| if x > end_m { 0.0 } else { start(x) })
}

/// Steady heights of a strip: every slope is (U / K)^(1/n) A^(-m/n).
pub fn steady(cells: usize, slope_at_1_m2: f64, concavity: f64) -> Vec<f64> {
    let mut heights = vec![0.0; cells + 1];
    for cell in (0..cells).rev() {
        let area_m2 = (cell + 1) as f64 * 1e4;
        heights[cell] = heights[cell + 1] + slope_at_1_m2 * math::pow(area_m2, -concavity) * 100.0;
    }
    heights
}

pub fn largest_relative_error(found: &[f32], expected: &[f64]) -> f64 {
    found.iter().zip(expected).map(|(f, e)| (f64::from(*f) - e).abs() / e.abs().max(1.0)).fold(0.0, f64::max)
}

#[test]
fn a_strip_reaches_its_closed_form_for_every_exponent() {
    let height = strip(100, |x| 500.0 * white(x, 0.5));
    // Every pair has the same steady slopes, 100 / sqrt(A).
    for (erodibility, m, n) in [(1e-5, 0.5, 1.0), (1e-7, 1.0, 2.0), (1e-6, 0.75, 1.5), (1e-4, 0.25, 0.5)] {
        for step_yr in [1e5, 4e5] {
            let changes = format!("{PLAIN},duration=40000000,time_step={step_yr},m={m},n={n}");
            let case = Case { height: &height, uplift: 0.001, erodibility, repose: 90.0, changes };
            let found = case.height();
            let expected = steady(100, 100.0, 0.5);
            assert!((expected[0] - 1_858.960_382_478_415).abs() < 1e-9 && (expected[99] - 10.0).abs() < 1e-9);
            // 1e-6: constants given as f32 (K and U are off by up to 3e-8 of themselves), then heights rounded to f32.
            let error = largest_relative_error(&found, &expected);
            assert!(error < 1e-6, "m {m}, n {n}, step {step_yr}: {error}");
        }
    }
}

#[test]
fn one_immense_step_lands_on_the_steady_state() {
    let height = strip(100, |x| 500.0 * white(x, 0.5));
    let changes = format!("{PLAIN},duration=1e9,time_step=1e9");
    let case = Case { height: &height, uplift: 0.001, erodibility: 1e-5, repose: 90.0, changes };
    // The start still weighs in with 1 / (1 + K dt sqrt(A) / dx): at most 6.8e-4 of the height, as an independent
    // solver finds.
    assert!(largest_relative_error(&case.height(), &steady(100, 100.0, 0.5)) < 1e-3);
}

#[test]
fn slopes_of_a_steady_landscape_follow_the_area() {
    let (cells, cell_m) = (128, 100.0);
    let height = testing::field(testing::world(cells, cells, cell_m), white);
    let changes = format!("{PLAIN},duration=2e7,time_step=2e4,m=0.45");
    let case = Case { height: &height, uplift: 0.001, erodibility: 2e-5, repose: 90.0, changes };
    let (heights, area) = (case.height(), case.take("area"));
    let nx = cells as usize;
    for cell in (0..heights.len()).filter(|&cell| !reference::on_border(nx, heights.len(), cell)) {
        let slope = reference::neighbours(nx, heights.len(), cell)
            .map(|(way, next)| f64::from(heights[cell] - heights[next]) / if way % 2 == 1 { 2_f64.sqrt() } else { 1.0 })
            .fold(0.0, f64::max)
            / cell_m;
        let ratio = slope * math::pow(f64::from(area[cell]), 0.45) / 50.0;
        // 1e-2: what heights in f32 allow.
        assert!((ratio - 1.0).abs() < 1e-2, "cell {cell}: {ratio}");
    }
}

/// Two other programs agree on this result (see `tests/data/README.md`).
#[test]
fn others_erode_the_same() {
    let path = format!("{}/../../tests/data/stream_power_24.f32", env!("CARGO_MANIFEST_DIR"));
    let bytes = std::fs::read(path).expect("test data");
    let samples: Vec<f32> =
        bytes.chunks_exact(4).map(|bytes| f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])).collect();
    let height = Field::new(Window::whole(testing::world(24, 24, 100.0)), samples[..576].to_vec());
    let changes = format!("{PLAIN},duration=4e5,time_step=2e4,m=0.45");
    let case = Case { height: &height, uplift: 0.001, erodibility: 2e-5, repose: 90.0, changes };
    let found = case.height();
    for cell in 0..576 {
        // 1e-4 m: the constants and the result are in f32.
        assert!((found[cell] - samples[576 + cell]).abs() < 1e-4, "{cell}: {} {}", found[cell], samples[576 + cell]);
    }
}

/// One step on real land without pits, each link solved by bisection, cells visited from the lowest up.
#[test]
fn a_step_is_the_plain_reference() {
    let path = format!("{}/../../tests/data/bigtujunga_drained_256.f32", env!("CARGO_MANIFEST_DIR"));
    let bytes = std::fs::read(path).expect("test data");
    let samples: Vec<f32> =
        bytes.chunks_exact(4).map(|bytes| f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])).collect();
    let height = Field::new(Window::whole(testing::world(256, 256, 30.0)), samples.clone());
    for (m, n, k) in [(0.5, 1.0, 3e-5_f32), (0.5, 1.2, 3e-5), (0.6, 1.5, 1e-5), (0.4, 0.8, 5e-5)] {
        let changes = format!(
            "schedule=full,critical_area=20000,winding=0,variation=0,receivers=d8,duration=50000,time_step=50000,\
             m={m},n={n}"
        );
        let case = Case { height: &height, uplift: 0.0, erodibility: f64::from(k), repose: 90.0, changes };
        let expected = reference_step(256, 30.0, &samples, f64::from(k) * 5e4, m, n, 2e4);
        // 1e-3 m: the heights are f32.
        let error = case.height().iter().zip(&expected).map(|(a, b)| (f64::from(*a) - b).abs()).fold(0.0, f64::max);
        assert!(error < 1e-3, "m {m}, n {n}: {error}");
    }
}

fn reference_step(nx: usize, cell_m: f64, heights: &[f32], k_dt: f64, m: f64, n: f64, critical_m2: f64) -> Vec<f64> {
    let len = heights.len();
    let distance = |way: usize| if way % 2 == 1 { cell_m * 2_f64.sqrt() } else { cell_m };
    let link = |cell: usize| {
        let slope = |(way, next): (usize, usize)| (f64::from(heights[cell]) - f64::from(heights[next])) / distance(way);
        let steepest =
            reference::neighbours(nx, len, cell).map(|to| (slope(to), to)).max_by(|a, b| a.0.total_cmp(&b.0));
        steepest.filter(|(slope, _)| *slope > 0.0 && !reference::on_border(nx, len, cell)).map(|(_, to)| to)
    };
    let links: Vec<Option<(usize, usize)>> = (0..len).map(link).collect();
    let receivers: Vec<Option<usize>> = links.iter().map(|link| link.map(|(_, next)| next)).collect();
    let cells = reference::accumulate(&receivers).expect("no circles");
    let mut order: Vec<usize> = (0..len).collect();
    order.sort_by(|&a, &b| heights[a].total_cmp(&heights[b]));
    let mut eroded: Vec<f64> = heights.iter().map(|&height| f64::from(height)).collect();
    for cell in order {
        let Some((way, next)) = links[cell] else { continue };
        let area_m2 = (f64::from(cells[cell]) * cell_m * cell_m).max(critical_m2);
        let c = k_dt * math::pow(area_m2, m) / math::pow(distance(way), n);
        let drop = eroded[cell] - eroded[next];
        let (mut lo, mut hi) = (0.0, drop);
        for _ in 0..60 {
            let mid = 0.5 * (lo + hi);
            if mid + c * math::pow(mid, n) > drop { hi = mid } else { lo = mid }
        }
        eroded[cell] = eroded[next] + lo;
    }
    eroded
}

/// After a rise of the uplift the new, steeper reach starts at the base and grows upstream at the speed K sqrt(A).
#[test]
fn a_knickpoint_travels_at_its_celerity() {
    let cells = 400;
    let before = steady(cells, 50.0, 0.5);
    let height = strip(cells as u32, |x| before[(x / 100.0) as usize]);
    let duration_yr = 8e5;
    let changes = format!("{PLAIN},duration={duration_yr},time_step=500");
    let case = Case { height: &height, uplift: 0.001, erodibility: 1e-5, repose: 90.0, changes };
    let after = case.height();
    let slope_ratio = |cell: usize| f64::from(after[cell] - after[cell + 1]) / (before[cell] - before[cell + 1]);
    let knick = (0..cells).rev().find(|&cell| slope_ratio(cell) < 1.5).expect("a knickpoint");
    let travel_yr: f64 = (knick..cells).map(|cell| 100.0 / (1e-5 * ((cell + 1) as f64 * 1e4).sqrt())).sum();
    // 5 %: the knickpoint is smeared over some cells.
    assert!((travel_yr / duration_yr - 1.0).abs() < 0.05, "{travel_yr}");
}

/// A plane that is too steep becomes one of the angle of repose, whichever way it falls.
#[test]
fn slopes_are_equally_steep_in_all_directions() {
    let world = testing::world(60, 60, 10.0);
    for degrees in [0.0, 10.0, 22.5, 30.0, 45.0, 65.0, 100.0, 200.0] {
        let (east, south) = (math::cos(degrees / 57.29578), math::sin(degrees / 57.29578));
        let height = testing::field(world, |x, y| 500.0 + 0.6 * (x * east + y * south));
        let case = Case {
            height: &height,
            uplift: 0.0,
            erodibility: 0.0,
            repose: math::atan(0.5) * 57.29578,
            changes: "duration=1e5".to_owned(),
        };
        let after = case.height();
        // Planes of repose stand on the lower sides; the middle is far enough from the edges where two of them meet.
        let difference =
            |step: usize| f64::from(after[30 * 60 + 30 + 5 * step] - after[30 * 60 + 30 - 5 * step]) / 100.0;
        let slope = math::hypot(difference(1), difference(60));
        // 5 %: links are drawn at random, and slides only lower. Slopes along links would make octagons, 8 % too steep.
        assert!((slope / 0.5 - 1.0).abs() < 0.05, "{degrees}: {slope}");
    }
}

/// The scarp of a plateau gives way at once, also where the plateau drains to the other side.
#[test]
fn scarps_give_way() {
    let world = testing::world(60, 60, 10.0);
    let height = testing::field(world, |x, _| if x < 310.0 { 0.0 } else { 100.0 - 0.01 * x });
    let changes = "duration=1000,time_step=1000".to_owned();
    let case = Case { height: &height, uplift: 0.0, erodibility: 0.0, repose: 45.0, changes };
    let after = case.height();
    for column in 31..59 {
        let stands = (10.0 * (column - 30) as f32).min(height.samples()[column]);
        assert!((after[30 * 60 + column] - stands).abs() < 1e-3, "a ramp of 45°: {}", after[30 * 60 + column]);
    }
}

#[test]
fn variation_is_around_the_erodibility_and_its_seed_counts() {
    let height = testing::field(testing::world(40, 40, 100.0), |x, y| 100.0 * white(x, y));
    let run = |changes: &str| {
        let changes = format!("duration=1e6,{changes}");
        Case { height: &height, uplift: 0.001, erodibility: 1e-5, repose: 90.0, changes }.height()
    };
    let mean = |heights: &[f32]| heights.iter().sum::<f32>() / heights.len() as f32;
    let (even, varied) = (run("variation=0"), run("variation=0.3"));
    assert!(even != varied && varied != run("variation=0.3,seed=5"));
    // 10 %: the mean of 1 / K grows with half the variance, and the drainage is another.
    assert!((mean(&varied) / mean(&even) - 1.0).abs() < 0.1, "{} {}", mean(&varied), mean(&even));
}

/// A run of [`RIVERS`] with some changes.
pub fn outputs(changes: &str, fields: &[(&str, &Field)]) -> Result<Outputs, NodeError> {
    let changes = if changes.is_empty() { RIVERS.to_owned() } else { format!("{RIVERS},{changes}") };
    testing::outputs(&NODE, &testing::with_params(&NODE, &changes), fields)
}

pub fn samples(outputs: &mut Outputs, output: &str) -> Vec<f32> {
    outputs.take(output).expect("an output").as_field().expect("a field").clone().into_samples()
}

#[test]
fn a_reference_rate_is_another_name_of_the_erodibility() {
    let height = testing::field(testing::world(30, 30, 100.0), |x, y| 100.0 * white(x, y));
    let map = |value: f32| Field::constant(*height.window(), value);
    let run = |input: &str, value: f32, changes: &str| {
        let changes = format!("duration=1e6,time_step=1e5,{changes}");
        let mut found = outputs(&changes, &[("height", &height), (input, &map(value))]).expect("a result");
        samples(&mut found, "height")
    };
    // K = E / ((1 km²)^m 0.1^n): 1e-3 / 1e3 / 0.1, and 1e-3 / 1e6^0.4 / 0.01.
    for (k, changes) in [(1e-5, "m=0.5,n=1"), (3.981_071_7e-4, "m=0.4,n=2")] {
        for (a, b) in run("reference_rate", 1e-3, changes).iter().zip(run("erodibility", k, changes)) {
            // 1e-3 m: the constants are f32, and differ by up to 1e-7 of the height.
            assert!((a - b).abs() < 1e-3, "{changes}: {a} {b}");
        }
    }
    let both = outputs("", &[("height", &height), ("reference_rate", &map(1e-3)), ("erodibility", &map(1e-5))]);
    assert!(both.expect_err("two erodibilities").to_string().contains("both"));
}

/// Where it rains p(x) the steady slope is (U / K)^(1/n) (∫ p)^(-m/n).
#[test]
fn rain_weights_the_drainage_area() {
    let height = strip(100, |x| 500.0 * white(x, 0.5));
    let world = height.window().world;
    let rain = |x: f64| if x < 5000.0 { 3.0 } else { 0.5 };
    let rain_field = testing::field(world, |x, _| rain(x));
    let [uplift, erodibility, repose] = [0.001, 1e-5, 90.0].map(|value| Field::constant(*height.window(), value));
    let fields = [("height", &height), ("uplift", &uplift), ("erodibility", &erodibility), ("repose", &repose)];
    let changes = format!("{PLAIN},duration=4e7,time_step=1e5");
    let with = |rain: &Field| outputs(&changes, &[&fields[..], &[("rain", rain)]].concat()).expect("a result");
    let mut found = with(&rain_field);
    let mut drained_m2 = 0.0;
    let area_m2: Vec<f64> = (0..100)
        .map(|cell| {
            drained_m2 += rain(f64::from(cell) * 100.0 + 50.0) * 1e4;
            drained_m2
        })
        .collect();
    let mut expected = vec![0.0; 101];
    for cell in (0..100).rev() {
        expected[cell] = expected[cell + 1] + 100.0 / area_m2[cell].sqrt() * 100.0;
    }
    // 1e-6: constants and heights are f32.
    assert!(largest_relative_error(&samples(&mut found, "height"), &expected) < 1e-6);
    assert_eq!(samples(&mut found, "area")[99], area_m2[99] as f32);
    // At the end what the uplift brings is what goes.
    for rate in &samples(&mut found, "erosion_rate")[..100] {
        // 1e-6 of the rate: the uplift is f32.
        assert!((rate - 0.001).abs() < 1e-9, "{rate}");
    }
    // Even rain of 4 is twice the erodibility when m is 0.5, whether it is a number or a map.
    let doubled = Field::constant(*height.window(), 2e-5);
    let twice =
        outputs(&changes, &[("height", &height), ("uplift", &uplift), ("erodibility", &doubled), ("repose", &repose)]);
    let expected = samples(&mut twice.expect("a result"), "height");
    let four = samples(&mut with(&Field::constant(*height.window(), 4.0)), "height");
    for (found, expected) in four.iter().zip(expected) {
        assert!((found - expected).abs() < 1e-3, "{found} {expected}");
    }
    let none = samples(&mut with(&Field::constant(*height.window(), -1.0)), "erosion");
    assert!(none.iter().all(|&erosion| erosion < 1e-6), "without water and a critical area nothing erodes");
}

#[test]
fn no_time_changes_nothing() {
    let height = testing::field(testing::world(40, 70, 10.0), |x, y| 1000.0 * white(x, y));
    let case =
        Case { height: &height, uplift: 0.001, erodibility: 1e-5, repose: 5.0, changes: "duration=0".to_owned() };
    assert!(case.height() == height.samples());
    for output in ["erosion", "erosion_rate"] {
        assert!(case.take(output).iter().all(|&erosion| erosion == 0.0));
    }
}

#[test]
fn without_erodibility_land_only_rises_and_base_stays() {
    let height = testing::field(testing::world(40, 70, 10.0), |x, y| 1000.0 * white(x, y));
    for uplift in [0.002, -0.002] {
        let changes = "duration=100000".to_owned();
        let case = Case { height: &height, uplift, erodibility: 0.0, repose: 90.0, changes };
        for (cell, (after, before)) in case.height().iter().zip(height.samples()).enumerate() {
            let risen = if reference::on_border(40, 40 * 70, cell) { 0.0 } else { uplift as f32 * 1e5 };
            assert!((after - before - risen).abs() < 1e-3, "f32 heights of 1000 m are exact to 1e-4 m");
        }
        assert!(case.take("erosion").iter().all(|&erosion| erosion < 1e-6));
    }
}

#[test]
fn what_is_eroded_is_what_is_missing() {
    let height = testing::field(testing::world(40, 70, 10.0), |x, y| 100.0 * white(x, y));
    let changes = "duration=500000".to_owned();
    let case = Case { height: &height, uplift: 0.001, erodibility: 1e-5, repose: 35.0, changes };
    let (after, erosion) = (case.height(), case.take("erosion"));
    for cell in (0..after.len()).filter(|&cell| !reference::on_border(40, after.len(), cell)) {
        let budget = height.samples()[cell] + 500.0 - after[cell] - erosion[cell];
        assert!(budget.abs() < 1e-3, "f32 heights of 600 m are exact to 6e-5 m: {budget}");
    }
}

/// With cells well below the critical area, finer ones make the same mountains.
#[test]
fn relief_does_not_depend_on_the_cells() {
    let mean = |cells: u32| {
        let world = testing::world(cells, cells, 6400.0 / f64::from(cells));
        let height = testing::field(world, |x, y| 20.0 * white((x / 200.0).floor(), (y / 200.0).floor()));
        let changes = "duration=4e6,critical_area=40000".to_owned();
        let heights = Case { height: &height, uplift: 0.001, erodibility: 6e-6, repose: 35.0, changes }.height();
        heights.iter().sum::<f32>() / heights.len() as f32
    };
    let (coarse, fine) = (mean(64), mean(128));
    // 5 %: the networks differ. Without a critical area or repose relief would grow by 0.57 U / K, 95 m.
    assert!((fine / coarse - 1.0).abs() < 0.05, "{coarse} {fine}");
}

#[test]
fn extreme_inputs_give_heights() {
    let changes = ["receivers=rho_infinity,n=1", "receivers=d8,n=1.7", "receivers=d8,n=0.4,m=0"];
    for (nx, ny) in [(1, 1), (1, 20), (20, 1), (2, 3), (33, 70)] {
        let world = testing::world(nx, ny, 10.0);
        let flat = Field::constant(Window::whole(world), 12.0);
        let rough = testing::field(world, |x, y| 500.0 * white(x, y));
        for height in [&flat, &rough] {
            for (erodibility, uplift) in [(1e3, 0.001), (1e3, -1.0), (1e-30, 1.0), (2e-6, 0.0), (-1.0, 0.001)] {
                for changes in changes {
                    let changes = format!("{changes},duration=1e6,time_step=1e5");
                    let case = Case { height, uplift, erodibility, repose: 35.0, changes };
                    assert!(case.height().iter().all(|height| height.is_finite()));
                }
            }
        }
    }
}

#[test]
fn a_world_without_an_outlet_is_refused() {
    let world = World { boundary: Boundary::all(Edge::Wall), ..testing::world(8, 8, 1.0) };
    let height = Field::constant(Window::whole(world), 1.0);
    let params = ParamValues::defaults(&NODE.specs());
    let error = testing::outputs(&NODE, &params, &[("height", &height)]).expect_err("nowhere to drain to");
    assert!(error.to_string().contains("lets water out"), "{error}");
}

#[test]
fn land_above_the_base_drains_without_pits() {
    let height = testing::field(testing::world(90, 90, 50.0), |x, y| 200.0 * white(x, y));
    let case = Case {
        height: &height,
        uplift: 0.001,
        erodibility: 5e-6,
        repose: 35.0,
        changes: "duration=2e6,receivers=d8".to_owned(),
    };
    let heights = case.height();
    let filled = reference::priority_flood(90, &heights, |cell| reference::on_border(90, heights.len(), cell));
    assert!(filled == heights);
}

#[test]
fn the_same_for_any_thread_count_and_simd_level() {
    let world = testing::world(90, 150, 50.0);
    let height = testing::field(world, |x, y| 300.0 * white(x, y));
    let erodibility = testing::field(world, |x, _| if x > 2000.0 { 1e-6 } else { 8e-6 });
    let uplift = testing::field(world, |_, y| y * 1e-7);
    let fields = [("height", &height), ("erodibility", &erodibility), ("uplift", &uplift)];
    let deposition = Field::constant(Window::whole(world), 0.5);
    for (n, more) in [("1", None), ("1.3", None), ("1", Some(("deposition", &deposition)))] {
        let params = testing::with_params(&NODE, &format!("duration=1e6,time_step=1e5,n={n}"));
        let fields: Vec<_> = fields.into_iter().chain(more).collect();
        assert!(testing::run_in(1, &NODE, &params, &fields) == testing::run_in(7, &NODE, &params, &fields));
        testing::at_every_level(|| testing::outputs(&NODE, &params, &fields));
    }
}

/// On coarser cells too, what is not wanted is left out, and the rest is the same.
#[test]
fn each_output_alone_is_what_it_is_among_all() {
    let window = Window::whole(testing::world(260, 257, 50.0));
    let height = testing::field(window.world, |x, y| 300.0 * white(x, y));
    let [uplift, deposition, diffusivity] = [0.001, 0.5, 0.01].map(|value| Field::constant(window, value));
    let fields = [("height", &height), ("uplift", &uplift), ("diffusivity", &diffusivity), ("deposition", &deposition)];
    for (changes, fields) in [
        ("schedule=coarse_to_fine,duration=1e6,time_step=5e4", &fields[..]),
        ("schedule=coarse_to_fine,duration=1e6,time_step=5e4", &fields[..3]),
        ("method=analytical,duration=1e6", &fields[..2]),
    ] {
        let params = testing::with_params(&NODE, changes);
        let run = |wanted| {
            let found = testing::outputs_wanted(wanted, &Cancel::default(), window, &NODE, &params, fields).0;
            found.expect("a result").into_iter_named().collect::<Vec<_>>()
        };
        let all = run(Wanted::ALL);
        assert_eq!(all.len(), NODE.outputs.len());
        for (at, among_all) in all.iter().enumerate() {
            assert!(run(Wanted::NONE.with(at)) == [among_all.clone()], "{changes}: {}", among_all.0);
        }
    }
}
