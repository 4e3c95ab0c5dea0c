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
    for name in ["slope.mean", "slope.p5", "slope.p50", "slope.p95"] {
        assert!((value(&report, name) - slope).abs() < 1e-3, "{name}");
    }
    assert!((value(&report, "local_relief.mean") - 0.5 * 99.0 * 25.0).abs() < 1e-3);
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
fn any_land_is_measured() {
    for (nx, ny) in [(1, 1), (1, 9), (2, 2), (40, 3)] {
        let level = report(&field(world(nx, ny, 10.0), |_, _| 5.0));
        assert_eq!(value(&level, "relief"), 0.0);
        assert!(value(&level, "hypsometric_integral").is_nan());
    }
    let holes = report(&field(world(30, 30, 10.0), |x, y| if x < 50.0 { f64::NAN } else { x + y }));
    assert!(value(&holes, "elevation.mean").is_finite() && value(&holes, "slope.mean").is_finite());
    // water leaves at the voids
    assert!(value(&holes, "drainage_density").is_finite() && value(&holes, "spectrum.beta").is_nan());
    assert!(holes.notes.iter().any(|note| note.contains("150 cells without a height")), "{:?}", holes.notes);
    let walled = World { boundary: Boundary::all(Edge::Wall), ..world(30, 30, 10.0) };
    report(&field(walled, |x, _| x));
}

/// A roof whose lower half is under water: only the upper half is measured.
#[test]
fn a_sea_leaves_the_land_above_it() {
    let roof = field(world(101, 60, 10.0), |x, _| 505.0 - (x - 505.0).abs());
    let [dry, wet] = [&roof, &at_sea(&roof, 252.0)].map(report);
    assert!(dry.get("sea_level").is_none() && dry.get("land_share").is_none());
    assert_eq!((value(&wet, "sea_level"), value(&wet, "elevation.min")), (252.0, 255.0));
    assert_eq!((value(&wet, "land_share"), value(&wet, "relief")), (51.0 / 101.0, 250.0));
    assert!((value(&wet, "slope.p50") - 45.0).abs() < 1e-3 && value(&wet, "slope.mean") < 45.0, "a crest");
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
        value(&drowned, "elevation.mean").is_nan() && drowned.notes.iter().any(|note| note.contains("below the sea"))
    );
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
        ("elevation.min", 1000.0545654296875, 0.0),
        ("elevation.max", 1903.0260009765625, 0.0),
        ("elevation.mean", 1320.7361728847027, 1e-9),
        ("elevation.std", 178.45011649368, 1e-9),
        ("hypsometric_integral", 0.355_140_367_492_132, 1e-12),
        ("local_relief.mean", 521.1275634765625, 1e-9),
        ("local_relief.max", 736.040771484375, 1e-9),
        // slopes are in single precision: a few units in the seventh digit
        ("slope.mean", 17.914_759_694_872_668, 1e-5),
        ("slope.p5", 5.452_440_775_685_238, 1e-5),
        ("slope.p25", 12.546_791_649_439_532, 1e-5),
        ("slope.p50", 18.020_843_929_600_694, 1e-5),
        ("slope.p75", 23.230_302_303_910_594, 1e-5),
        ("slope.p95", 30.057_230_753_985_15, 1e-5),
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

/// Seven elevation models against measures that NumPy, SciPy and four programs of drainage agree on. Sums are exact;
/// slopes are in single precision; ways over flats are a free choice, so that basins and densities may differ by 2 %
/// (norfolk is nearly flat: 5 %), medians of valley sections by a few sections of equal area.
#[test]
fn seven_elevation_models_measure_as_expected() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/data/dems");
    let text = std::fs::read_to_string(format!("{folder}/expected.json")).expect("the test's data");
    let expected: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    for (model, expected) in expected.as_object().expect("models") {
        let raster = crate::raster::read(format!("{folder}/{model}.tif").as_ref()).expect("the test's data");
        let height = crate::raster::height_field(raster, [0.0, 1.0], None).expect("a field").field;
        let found = report(&height);
        for (name, value) in expected["measures"].as_object().expect("measures") {
            let value = value.as_f64().expect("a number");
            let tolerance = match name.as_str() {
                name if name.starts_with("elevation") || name == "hypsometric_integral" => 1e-6 * value.abs(),
                name if name.starts_with("slope") => 5e-5 * value,
                "spectrum.beta" => 0.02,
                "valleys.v_index" => 0.01,
                "valleys.exponent" => 0.04,
                _ => 0.02 * value.abs(),
            };
            let got = self::value(&found, name);
            assert!((got - value).abs() <= tolerance, "{model} {name}: {got}, not {value}");
        }
        let series = |name: &str| found.series.iter().find(|series| series.name == name).expect("a series");
        let histogram = &series("slope_histogram").y.values;
        for (bin, share) in expected["slope_histogram_5_degrees"].as_array().expect("bins").iter().enumerate() {
            let got: f64 = histogram[5 * bin..5 * bin + 5].iter().sum();
            assert!((got - share.as_f64().expect("a share")).abs() < 1e-4, "{model}, {} degrees: {got}", 5 * bin);
        }
        let curve = &series("hypsometric_curve").x.values;
        for (tenth, share) in expected["hypsometric_area_at_tenths"].as_array().expect("steps").iter().enumerate() {
            // whole metres can lie on the level itself, on either side of its rounding
            let class = 1e-3;
            assert!((curve[10 * tenth] - share.as_f64().expect("a share")).abs() < class, "{model}, {tenth} tenths");
        }
        for (area, density) in expected["drainage_density"].as_object().expect("densities") {
            let density = density.as_f64().expect("a density");
            let got = density_at(&height, area.parse().expect("an area"));
            let tolerance = if model == "norfolk" { 0.05 } else { 0.02 };
            assert!((got / density - 1.0).abs() < tolerance, "{model}, {area} m²: {got}, not {density}");
        }
    }
}

fn density_at(height: &Field, area_m2: f64) -> f64 {
    let land = Land::of(height, None);
    let network = Network::of(&land, &order::from_the_top(land.height.plane(0)), &|| Ok(())).expect("a network");
    let mut params = ParamValues::defaults(&NODE.specs());
    params.set("channel_area", orograph_graph::ParamValue::Float(area_m2));
    let mut report = Report::default();
    drainage::density(&land, &network, &Params::read(&params), &mut report);
    value(&report, "drainage_density")
}

/// Parallel valleys of a given section that fall to the south.
fn comb(power: f64) -> Field {
    field(world(320, 480, 50.0), move |x, y| {
        let across = ((x - 8025.0) / 4000.0).abs() % 1.0;
        let rise = if across > 0.5 { 1.0 - across } else { across };
        600.0 * libm::pow(2.0 * rise, power) - 0.01 * y
    })
}

#[test]
fn a_v_has_index_0_and_a_parabola_a_third() {
    for (power, index) in [(1.0, 0.0), (2.0, 1.0 / 3.0), (1.5, 0.2)] {
        let found = report(&comb(power));
        assert!(value(&found, "valleys.sections") >= 5.0);
        assert!((value(&found, "valleys.exponent") - power).abs() < 0.03, "{power}: {found:?}");
        // sections are cut at nine tenths, where a power is still one
        assert!((value(&found, "valleys.v_index") - index).abs() < 0.02, "{power}: {found:?}");
    }
}

/// Rows that drain to the east side by side, with slopes k A^-theta: z = ∫ k A^-theta dx with A = cell x.
#[test]
fn rivers_in_balance_have_their_concavity() {
    let theta = 0.45;
    let nx = 1200;
    let land = field(world(nx, 40, 100.0), move |x, _| {
        let from = x + 50.0;
        let total = f64::from(nx) * 100.0;
        let power = 1.0 - theta;
        20.0 * (libm::pow(total, power) - libm::pow(from, power)) / power
    });
    let mut params = ParamValues::defaults(&NODE.specs());
    params.set("channel_area", orograph_graph::ParamValue::Float(1e5));
    let mut outputs = outputs(&NODE, &params, &[("height", &land)]).expect("a result");
    let found = outputs.take("report").expect("a report").as_report().expect("a report").clone();
    assert!((value(&found, "concavity") - theta).abs() < 0.01, "{}", value(&found, "concavity"));
    assert!(value(&found, "concavity.error") < 0.02 && value(&found, "chi.r2") > 0.99);
}

/// A tree in which every stream of an order has two of the order below on it: a bifurcation ratio of two.
#[test]
fn a_binary_tree_has_ratios_of_two() {
    // a network by hand: 2^7 sources, joined in pairs
    let levels = 7_u32;
    let mut receiver = Vec::new();
    let mut start = 0;
    for level in 0..levels {
        let count = 1_u32 << (levels - 1 - level);
        receiver.extend((0..count).map(|k| if level + 1 == levels { start } else { start + count + k / 2 }));
        start += count;
    }
    let cells = receiver.len();
    let order: Vec<u32> = (0..cells as u32).rev().collect();
    let mut area = vec![40_u32; cells];
    for &cell in order.iter().rev() {
        let below = receiver[cell as usize];
        if below != cell {
            area[below as usize] += area[cell as usize];
        }
    }
    let level = (0..cells).map(|cell| (cells - cell) as f64).collect();
    let network = Network { nx: cells, ny: 1, cell_m: 1.0, level, receiver, order, area, flooded: [0; 2] };
    let land = field(world(cells as u32, 1, 1.0), |x, _| -x);
    let orders = orders::orders(&network, 30.0);
    assert_eq!(orders.iter().copied().max(), Some(7));
    let mut report = Report::default();
    orders::horton(&Land::of(&land, None), &network, &orders, &mut report);
    assert_eq!(value(&report, "streams.order"), 7.0);
    assert!((value(&report, "streams.bifurcation_ratio") - 2.0).abs() < 1e-9);
}

/// Water leaves at voids that an import has filled: the basin above them ends there.
#[test]
fn known_ground_alone_is_measured() {
    let land_at = |x: f64, y: f64| 2000.0 - 0.1 * x + 0.05 * (y - 2500.0).abs();
    let land = field(world(200, 100, 50.0), land_at);
    let data = field(world(200, 100, 50.0), |x, _| if x < 6000.0 { 1.0 } else { 0.0 });
    let params = ParamValues::defaults(&NODE.specs());
    let measured = |inputs: &[(&str, &Field)]| {
        let mut outputs = outputs(&NODE, &params, inputs).expect("a result");
        outputs.take("report").expect("a report").as_report().expect("a report").clone()
    };
    let [whole, known] = [measured(&[("height", &land)]), measured(&[("height", &land), ("data", &data)])];
    assert_eq!(value(&known, "elevation.min"), 1403.75);
    let shares = value(&known, "basin.area") / value(&whole, "basin.area");
    assert!((0.5..0.65).contains(&shares), "{shares}");
    let void = field(world(200, 100, 50.0), |x, y| if x < 6000.0 { land_at(x, y) } else { f64::NAN });
    // as text, in which a measure that cannot be taken equals itself
    assert_eq!(format!("{known:?}"), format!("{:?}", measured(&[("height", &void)])));
}

#[test]
fn a_mask_restricts_what_is_measured() {
    let land = field(world(200, 100, 50.0), |x, y| if x < 5000.0 { 0.2 * y } else { 0.6 * y });
    let mask = field(world(200, 100, 50.0), |x, _| if x < 4000.0 { 1.0 } else { 0.0 });
    let params = ParamValues::defaults(&NODE.specs());
    let mut outputs = outputs(&NODE, &params, &[("height", &land), ("mask", &mask)]).expect("a result");
    let masked = outputs.take("report").expect("a report").as_report().expect("a report").clone();
    assert!((value(&masked, "slope.p95") - libm::atan(0.2).to_degrees()).abs() < 1e-3);
    assert!((value(&report(&land), "slope.p95") - libm::atan(0.6).to_degrees()).abs() < 1e-3);
    assert_eq!(value(&masked, "slope.p50"), value(&masked, "slope.p5"));
}

/// The first bins hold some five waves each, so that the exponent of one draw is uncertain by 0.13: three times that.
#[test]
fn white_noise_has_a_level_spectrum() {
    let noise = field(world(256, 256, 10.0), |x, y| {
        f64::from(orograph_graph::mix((x / 10.0) as u32 * 1024 + (y / 10.0) as u32)) / f64::from(u32::MAX)
    });
    assert!(value(&report(&noise), "spectrum.beta").abs() < 0.4);
}

/// Marks of a computation: rivers along columns, hillsides that are planes.
#[test]
fn planes_and_straight_rivers_are_marked() {
    let found = report(&comb(1.0));
    assert!(value(&found, "planar_share") > 0.9, "{}", value(&found, "planar_share"));
    assert!(value(&found, "channels.straight") > 0.9 && value(&found, "channels.eight_fold") > 0.9);
}
