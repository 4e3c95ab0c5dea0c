//! Each shape compared with its formula.

use orograph_graph::ParamValue;

use super::*;
use crate::testing::{self, at_every_level, generate, moments, outputs_on, with_params, world};

fn uplift(window: Window, params: &ParamValues) -> Field {
    let value = outputs_on(window, &NODE, params, &[]).expect("a result").take("uplift").expect("an output");
    value.as_field().expect("a field").clone()
}

/// Checks every sample against a function of its position, within the fraction `share` of `scale`.
fn assert_is(field: &Field, scale: f64, share: f64, expected: impl Fn(f64, f64) -> f64) {
    let window = field.window();
    for (at, value) in field.samples().iter().enumerate() {
        let [x, y] = window.centre_m(at % window.nx(), at / window.nx());
        let expected = expected(x, y);
        assert!((f64::from(*value) - expected).abs() <= share * scale, "({x}, {y}): {value} is not {expected}");
    }
}

#[test]
fn a_gaussian_of_the_distance() {
    let window = Window::whole(world(40, 30, 100.0));
    let mut params = with_params(&NODE, "radius=900,rate=0.002");
    params.set("centre", ParamValue::Point([1250.0, 3150.0]));
    let uplift = uplift(window, &params);
    for (at, value) in uplift.samples().iter().enumerate() {
        let [x, y] = window.centre_m(at % 40, at / 40);
        let distance = math::hypot(x - 1250.0, y - 3150.0);
        let expected = 0.002 * math::exp(-distance * distance / (2.0 * 900.0 * 900.0));
        // a few roundings in double precision and one to single: 1e-7 of the value
        assert!((f64::from(*value) - expected).abs() <= 1e-7 * expected, "{value} is not {expected}");
    }
    assert_eq!(uplift.samples()[29 * 40 + 12], (0.002 * math::exp(-0.5 * (200.0_f64 / 900.0 * 200.0 / 900.0))) as f32);
}

fn range(path: &[[f64; 2]]) -> ParamValues {
    let mut params = with_params(&NODE, "shape=range,rate=0.003,front=400,back=1100");
    params.set("path", ParamValue::Path(path.to_vec()));
    params
}

/// Two collinear segments act as one: each side has its own width, and the range is round beyond its ends.
#[test]
fn a_range_is_steep_to_the_right_and_gentle_to_the_left() {
    let path = [[1000.0, 2000.0], [2600.0, 2000.0], [4000.0, 2000.0]];
    let field = uplift(Window::whole(world(60, 60, 100.0)), &range(&path));
    assert_is(&field, 0.003, 2e-6, |x, y| {
        // heading east, south is to the right
        let (beyond, right) = ((1000.0 - x).max(x - 4000.0).max(0.0), y - 2000.0);
        let distance = math::hypot(beyond, right);
        let sine = right / distance;
        let share = 0.5 + 0.75 * sine - 0.25 * sine * sine * sine;
        let per_square = share / (400.0 * 400.0) + (1.0 - share) / (1100.0 * 1100.0);
        0.003 * math::exp(-0.5 * distance * distance * per_square)
    });
    let turned =
        uplift(Window::whole(world(60, 60, 100.0)), &range(&[[3000.0, 1000.0], [3000.0, 4000.0], [6000.0, 4000.0]]));
    // heading south, east is to the left; heading east, north is to the left
    let at = |x: usize, y: usize| f64::from(turned.samples()[y * 60 + x]) / 0.003;
    assert!((at(26, 20) - math::exp(-0.5 * (350.0_f64 / 400.0 * 350.0 / 400.0))).abs() < 1e-5);
    assert!((at(40, 20) - math::exp(-0.5 * (1050.0_f64 / 1100.0 * 1050.0 / 1100.0))).abs() < 1e-5);
}

/// The rate is continuous: between cells it changes no more than the steepest slope of a Gaussian, e^-½ / w, allows.
#[test]
fn a_winding_range_has_no_seams() {
    let path =
        [[500.0, 3000.0], [2500.0, 700.0], [3500.0, 4500.0], [1500.0, 5200.0], [5500.0, 5400.0], [4500.0, 900.0]];
    let field = uplift(Window::whole(world(600, 600, 10.0)), &range(&path));
    let steepest = 0.003 * 0.6066 / 400.0 * 10.0;
    for (at, value) in field.samples().iter().enumerate() {
        for beside in [(at % 600 > 0).then(|| at - 1), at.checked_sub(600)].into_iter().flatten() {
            let change = f64::from((value - field.samples()[beside]).abs());
            // where the width blends around an end the slope may be slightly greater
            assert!(change < 1.1 * steepest, "cell {at}: {change} {steepest}");
        }
    }
}

#[test]
fn a_fault_throws_its_blocks_apart() {
    let mut params = with_params(&NODE, "shape=fault,rate=0.002,azimuth=30,step=50,decay=2000,footwall=0.3");
    params.set("centre", ParamValue::Point([2000.0, 3100.0]));
    let field = uplift(Window::whole(world(50, 70, 100.0)), &params);
    assert_is(&field, 0.002, 1e-6, |x, y| {
        // north-north-east is (1/2, -√3/2); its right is east-south-east
        let right = (x - 2000.0) * 3.0_f64.sqrt() / 2.0 + (y - 3100.0) / 2.0;
        let step = 0.5 - 0.5 * right / math::hypot(right, 50.0);
        0.002 * (step - 0.7) * math::exp(-right.abs() / 2000.0)
    });
    // north-west of the fault the terrain rises by 30 % of the throw, south-east it sinks by 70 %
    assert!(field.range(0).is_some_and(|(lo, hi)| (-0.0014..-0.0012).contains(&lo) && (0.0005..0.0006).contains(&hi)));
}

#[test]
fn plates_meet_and_part_and_repeat_nowhere() {
    let window = Window::whole(world(300, 300, 100.0));
    let changes = "shape=plates,plate_size=3000,belt=100,rate=0.004";
    let field = generate(window, &NODE, changes);
    let (lo, hi) = field.range(0).expect("values");
    // head-on at a fraction of the full speed, at distances of 0.4 to 2 plate sizes: between a fifth and twice the rate
    assert!((0.0008..0.008).contains(&hi) && (-0.008..-0.0008).contains(&lo), "{lo} {hi}");
    // uplift and subsidence balance: plates drift in all directions
    let (mean, deviation) = moments(field.samples());
    assert!(mean.abs() < 0.3 * deviation, "{mean} {deviation}");
    // plates are rigid: most of the terrain is at rest
    let at_rest = field.samples().iter().filter(|v| v.abs() < 4e-5).count();
    assert!(at_rest > 300 * 300 / 3, "{at_rest}");
    assert_ne!(field, generate(window, &NODE, &format!("{changes},seed=1")));
    let error = outputs_on(window, &NODE, &with_params(&NODE, "shape=plates,plate_size=3000,belt=301"), &[]);
    assert!(matches!(error, Err(NodeError::Failed { hint: Some(hint), .. }) if hint == "write `belt: 300` or less"));
}

#[test]
fn variation_and_map_multiply_and_displacement_is_the_rate_over_time() {
    let window = Window::whole(world(200, 200, 100.0));
    let varied = generate(window, &NODE, "shape=uniform,rate=0.002,variation=0.5,variation_size=3000");
    let (lo, hi) = varied.range(0).expect("values");
    assert!(lo >= 0.001 && hi <= 0.003 && hi - lo > 0.0005, "{lo} {hi}");
    assert!((moments(varied.samples()).0 / 0.002 - 1.0).abs() < 0.05);

    let map = testing::field(window.world, |x, _| x / 20_000.0);
    let params = with_params(&NODE, "shape=uniform,rate=0.002,duration=50000");
    let mut outputs = outputs_on(window, &NODE, &params, &[("map", &map)]).expect("a result");
    let [rate, metres] = ["uplift", "displacement"].map(|name| outputs.take(name).expect("an output"));
    let (rate, metres) = (rate.as_field().expect("a field"), metres.as_field().expect("a field"));
    assert_is(rate, 0.002, 2e-7, |x, _| 0.002 * x / 20_000.0);
    assert_is(metres, 100.0, 3e-7, |x, _| 100.0 * x / 20_000.0);
}

#[test]
fn every_shape_is_the_same_in_a_window_and_at_every_simd_level() {
    let whole = Window::whole(world(131, 97, 120.0));
    let part = Window { origin: [17, 31], cells: [83, 40], ..whole };
    for shape in ["gaussian", "range", "fault", "plates", "uniform"] {
        let changes = format!("shape={shape},variation=0.3");
        assert_eq!(generate(whole, &NODE, &changes).crop(&part), generate(part, &NODE, &changes), "{shape}");
        at_every_level(|| generate(part, &NODE, &changes));
    }
}
