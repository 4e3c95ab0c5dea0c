use orograph_graph::{Boundary, Edge, World};

use super::*;
use crate::testing::{at_every_level, field, outputs, run_in, world};

fn report(height: &Field) -> Report {
    let mut outputs = outputs(&NODE, &ParamValues::defaults(&NODE.specs()), &[("height", height)]).expect("a result");
    outputs.take("report").expect("a report").as_report().expect("a report").clone()
}

fn value(report: &Report, name: &str) -> f64 {
    report.get(name).unwrap_or_else(|| panic!("no {name}"))
}

/// The hypsometric integral of forms whose volume is known; 513 cells a side give it to 0.002.
#[test]
fn simple_forms_have_their_hypsometric_integral() {
    let centre = 256.5;
    let forms: [(&dyn Fn(f64, f64) -> f64, f64); 4] = [
        (&|x, _| x, 0.5),
        (&|x, y| -(x - centre).abs().max((y - centre).abs()), 1.0 / 3.0),
        (&|x, y| (x - centre) * (x - centre) - (y - centre) * (y - centre), 0.5),
        (&|x, y| y - x, 0.5),
    ];
    for (form, expected) in forms {
        let report = report(&field(world(513, 513, 1.0), form));
        let integral = value(&report, "hypsometric_integral");
        assert!((integral - expected).abs() < 0.002, "{integral} {expected}");
        let curve = &report.series.iter().find(|series| series.name == "hypsometric_curve").unwrap().x.values;
        assert_eq!(curve[0], 1.0);
        // trapezoids over a hundred steps
        let area = (curve.iter().sum::<f64>() - 0.5 * (curve[0] + curve[100])) / 100.0;
        assert!((area - expected).abs() < 0.004, "{area} {expected}");
    }
}

#[test]
fn a_plane_has_one_slope_and_a_known_local_relief() {
    let report = report(&field(world(400, 300, 25.0), |x, _| 0.5 * x));
    let slope = libm::atan(0.5).to_degrees();
    for name in ["slope_mean", "slope_p5", "slope_p50", "slope_p95"] {
        assert!((value(&report, name) - slope).abs() < 1e-3, "{name}");
    }
    assert!((value(&report, "local_relief_mean") - 0.5 * 99.0 * 25.0).abs() < 1e-3);
    assert_eq!(value(&report, "local_window"), 2500.0);
    let histogram = &report.series.iter().find(|series| series.name == "slope_histogram").unwrap().y.values;
    assert_eq!(histogram[26], 1.0);
}

/// On a plane that falls to the east, each row is a channel from the column at which its drainage area is enough.
#[test]
fn parallel_rills_have_a_known_density() {
    let report = report(&field(world(202, 50, 100.0), |x, _| 1e4 - 0.1 * x));
    // 200 cells inside a row; those from the tenth on (1e5 m²) are channels, 191 links of 100 m
    let inside = 48.0 * 191.0 * 100.0;
    let density = value(&report, "drainage_density");
    assert!((density / (1e3 * inside / (202.0 * 50.0 * 1e4)) - 1.0).abs() < 0.01, "{density}");
}

#[test]
fn the_distance_to_itself_is_none_and_grows_with_the_difference() {
    let hills =
        |scale: f64| field(world(120, 100, 10.0), move |x, y| scale * libm::sin(x / 90.0) * libm::cos(y / 70.0));
    let names = ["elevation_distance", "slope_distance", "hypsometry_distance"];
    let none = compare(&hills(100.0), &hills(100.0));
    assert!(names.iter().all(|name| none.get(name) == Some(0.0)));
    let (near, far) = (compare(&hills(110.0), &hills(100.0)), compare(&hills(200.0), &hills(100.0)));
    for name in ["elevation_distance", "slope_distance"] {
        assert!(near.get(name).unwrap() > 0.0 && far.get(name).unwrap() > near.get(name).unwrap(), "{name}");
    }
    // the curve is of relative heights
    assert!(far.get("hypsometry_distance").unwrap() < 1e-3);
}

#[test]
fn any_land_is_measured() {
    for (nx, ny) in [(1, 1), (1, 9), (2, 2), (40, 3)] {
        let level = report(&field(world(nx, ny, 10.0), |_, _| 5.0));
        assert_eq!(value(&level, "relief"), 0.0);
        assert!(value(&level, "hypsometric_integral").is_nan());
    }
    let holes = report(&field(world(30, 30, 10.0), |x, y| if x < 50.0 { f64::NAN } else { x + y }));
    assert!(value(&holes, "elevation_mean").is_finite() && value(&holes, "slope_mean").is_finite());
    assert!(value(&holes, "drainage_density").is_nan());
    assert_eq!(holes.notes.len(), 3, "{:?}", holes.notes);
    let walled = World { boundary: Boundary::all(Edge::Wall), ..world(30, 30, 10.0) };
    report(&field(walled, |x, _| x));
}

#[test]
fn threads_and_simd_levels_give_the_same_bits() {
    let rough = field(world(300, 150, 10.0), |x, y| 400.0 * libm::sin(x / 80.0) * libm::cos(y / 60.0));
    let params = ParamValues::defaults(&NODE.specs());
    let text = |threads| format!("{:?}", run_in(threads, &NODE, &params, &[("height", &rough)]));
    assert_eq!(text(1), text(4));
    at_every_level(|| text(2));
}
