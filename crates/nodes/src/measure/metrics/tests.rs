//! Tests of Metrics against terrain with known measures.

use orograph_graph::{Boundary, Edge, World};

use super::*;
use crate::testing::{at_every_level, at_sea, field, outputs, run_in, world};

fn report(height: &Field) -> Report {
    let mut outputs = outputs(&NODE, &ParamValues::defaults(&NODE.specs()), &[("height", height)]).expect("a result");
    outputs.take("report").expect("a report").as_report().expect("a report").clone()
}

fn value(report: &Report, name: &str) -> f64 {
    report.get(name).unwrap_or_else(|| panic!("no {name}"))
}

/// The hypsometric integral of solids of known volume; 513 cells per side give it to 0.002.
#[test]
fn simple_forms_have_their_hypsometric_integral() {
    let centre = 256.5;
    type Form<'a> = &'a dyn Fn(f64, f64) -> f64;
    let forms: [(Form<'_>, f64); 4] = [
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

/// On a plane that falls to the east, each row is a channel from the column at which its drainage area reaches the
/// critical area.
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
    // the curves are of relative heights
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

/// A roof whose lower half is under water: only the upper half is measured.
#[test]
fn a_sea_leaves_the_land_above_it() {
    let roof = field(world(101, 60, 10.0), |x, _| 505.0 - (x - 505.0).abs());
    let [dry, wet] = [&roof, &at_sea(&roof, 252.0)].map(report);
    assert!(dry.get("sea_level").is_none() && dry.get("land_share").is_none());
    assert_eq!((value(&wet, "sea_level"), value(&wet, "elevation_min")), (252.0, 255.0));
    assert_eq!((value(&wet, "land_share"), value(&wet, "relief")), (51.0 / 101.0, 250.0));
    assert!((value(&wet, "slope_p50") - 45.0).abs() < 1e-3 && value(&wet, "slope_mean") < 45.0, "a crest");
    assert!(wet.notes.iter().all(|note| !note.contains("without a height")), "{:?}", wet.notes);
    // a critical area of one cell: every land cell is a channel, with a link of one cell
    let mut params = ParamValues::defaults(&NODE.specs());
    params.set("channel_area", orograph_graph::ParamValue::Float(100.0));
    let density = |height: &Field| {
        let mut outputs = outputs(&NODE, &params, &[("height", height)]).expect("a result");
        outputs.take("report").expect("a report").as_report().expect("a report").get("drainage_density")
    };
    // base sides have no receiver: 58 of 60 rows; the crest drains too
    let expected = 1e3 * 58.0 / 60.0 / 10.0;
    assert!((density(&at_sea(&roof, 252.0)).expect("measured") - expected).abs() < 1e-9);

    let drowned = report(&at_sea(&roof, 1e4));
    assert_eq!(value(&drowned, "land_share"), 0.0);
    assert!(
        value(&drowned, "elevation_mean").is_nan() && drowned.notes.iter().any(|note| note.contains("below the sea"))
    );
    // the upper half of a roof differs from the whole
    let [same, other] = [at_sea(&roof, 252.0), roof.clone()].map(|land| compare(&land, &at_sea(&roof, 252.0)));
    let distance = |report: &Report| value(report, "elevation_distance");
    assert!(distance(&same) == 0.0 && distance(&other) > 0.1, "{:?}", other.measures);
}

#[test]
fn threads_and_simd_levels_give_the_same_bits() {
    let rough = field(world(300, 150, 10.0), |x, y| 400.0 * libm::sin(x / 80.0) * libm::cos(y / 60.0));
    let params = ParamValues::defaults(&NODE.specs());
    let text = |threads| format!("{:?}", run_in(threads, &NODE, &params, &[("height", &rough)]));
    assert_eq!(text(1), text(4));
    at_every_level(|| text(2));
}

/// A part of the San Gabriel Mountains without pits or flats, compared with NumPy in double precision: sums, Horn's
/// slopes and `numpy.percentile`, and D8 links along directions on which four other programs agree.
#[test]
fn real_land_measures_what_other_programs_say() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/data/bigtujunga_drained_256.f32");
    let bytes = std::fs::read(path).expect("the test's data");
    let samples = bytes.as_chunks().0.iter().map(|&b| f32::from_le_bytes(b)).collect();
    let report = report(&Field::new(Window::whole(world(256, 256, 30.0)), samples));
    for (name, expected, tolerance) in [
        ("elevation_min", 1000.0545654296875, 0.0),
        ("elevation_max", 1903.0260009765625, 0.0),
        ("elevation_mean", 1320.7361728847027, 1e-9),
        ("elevation_std", 178.45011649368, 1e-9),
        ("hypsometric_integral", 0.355_140_367_492_132, 1e-12),
        ("local_relief_mean", 521.1275634765625, 1e-9),
        ("local_relief_max", 736.040771484375, 1e-9),
        // slopes are in single precision: a few units in the seventh digit
        ("slope_mean", 17.914_759_694_872_668, 1e-5),
        ("slope_p5", 5.452_440_775_685_238, 1e-5),
        ("slope_p25", 12.546_791_649_439_532, 1e-5),
        ("slope_p50", 18.020_843_929_600_694, 1e-5),
        ("slope_p75", 23.230_302_303_910_594, 1e-5),
        ("slope_p95", 30.057_230_753_985_15, 1e-5),
        ("drainage_density", 1.936_087_045_136_852_8, 1e-9),
    ] {
        let got = value(&report, name);
        assert!((got - expected).abs() <= tolerance, "{name}: {got}, not {expected}");
    }
    let curve = &report.series.iter().find(|series| series.name == "hypsometric_curve").unwrap().x.values;
    assert_eq!([curve[20], curve[50], curve[100]], [0.759_216_308_593_75, 0.231_796_264_648_437_5, 1.0 / 65536.0]);
    let histogram = &report.series.iter().find(|series| series.name == "slope_histogram").unwrap().y.values;
    // one cell of 64516 may fall into the next bin by rounding
    assert!((histogram[20] - 0.048_685_597_371_194_746).abs() < 1.6e-5);
    assert!((histogram[35] - 0.002_929_505_859_011_718).abs() < 1.6e-5);
}
