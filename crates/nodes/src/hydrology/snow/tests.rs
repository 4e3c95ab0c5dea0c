//! Tests of snow: the published laws, balances, planes and walls with closed forms, edge cases.

use orograph_graph::{Boundary, Cancel, Edge, World};

use super::{Law, NODE, slide::held_m, weather};
use crate::{numerics::math, prelude::*, testing};

/// Cold and without wind, sun or season: nothing melts.
const STILL: &str = "wind=0,seasonality=0,lapse_rate=0,duration=1,steps=4";

struct Found {
    height: Vec<f32>,
    depth: Vec<f32>,
    mask: Vec<f32>,
    melt: Vec<f32>,
    report: Report,
}

impl Found {
    fn measure(&self, name: &str) -> f64 {
        let snow = self.report.balance_of("snow").expect("a balance");
        match name {
            "remains" => snow.end,
            "closure_error" => snow.error,
            name => snow.get(name).or(self.report.get(name)).expect("a measure"),
        }
    }
}

fn snow(changes: &str, fields: &[(&str, &Field)]) -> Found {
    let params = testing::with_params(&NODE, changes);
    let mut outputs = testing::outputs(&NODE, &params, fields).expect("a result");
    let report = outputs.take("report").expect("an output").as_report().expect("a report").clone();
    let mut take = |name| outputs.take(name).expect("an output").as_field().expect("a field").clone().into_samples();
    let found = Found { height: take("height"), depth: take("depth"), mask: take("mask"), melt: take("melt"), report };
    let all = [&found.height, &found.depth, &found.mask, &found.melt];
    assert!(all.into_iter().flatten().all(|v| v.is_finite()) && found.depth.iter().all(|depth| *depth >= 0.0));
    assert!(found.measure("closure_error").abs() < 1e-12, "{}", found.measure("closure_error"));
    found
}

fn everywhere(like: &Field, value: f32) -> Field {
    Field::constant(*like.window(), value)
}

/// Steep hills of 60 x 50 cells of 30 m.
fn hills(boundary: Boundary) -> Field {
    let world = World { boundary, ..testing::world(60, 50, 30.0) };
    testing::field(world, |x, y| {
        let wave = |at: f64, length_m: f64| 1.0 - (2.0 * ((at / length_m).fract() - 0.5)).abs();
        500.0 + 700.0 * wave(x + 0.4 * y, 1100.0) * wave(y - 0.2 * x, 900.0) + 60.0 * wave(x - y, 210.0)
    })
}

/// The two published laws, as the codes of their authors have them, in double precision.
#[test]
fn slopes_hold_what_the_published_laws_say() {
    for tenth in 1..=890 {
        let slope = f64::from(tenth) * 0.1;
        let exponential = (145.0 * math::exp(-0.14 * slope)).max(0.05);
        let power = (3178.4 / math::pow(slope, 1.998)).max(0.05);
        assert!((held_m(Law::Exponential, slope, 0.05) / exponential - 1.0).abs() < 1e-12);
        assert!((held_m(Law::Power, slope, 0.05) / power - 1.0).abs() < 1e-12);
    }
    let rounded = |law, slope| (held_m(law, slope, 0.05) * 100.0).round() / 100.0;
    assert_eq!([30.0, 45.0, 60.0].map(|slope| rounded(Law::Exponential, slope)), [2.17, 0.27, 0.05]);
    assert_eq!([30.0, 45.0, 60.0].map(|slope| rounded(Law::Power, slope)), [3.56, 1.58, 0.89]);
}

/// A plane that drains over one side keeps exactly the holding depth of its slope, up to 89°, and the rest leaves.
#[test]
fn planes_keep_their_holding_depth_and_the_rest_leaves() {
    let boundary = Boundary { west: Edge::Open, ..Boundary::all(Edge::Wall) };
    let world = World { boundary, ..testing::world(40, 20, 10.0) };
    for (law, name) in [(Law::Exponential, "exponential"), (Law::Power, "power")] {
        for slope in [35.0, 45.0, 60.0, 80.0, 89.0] {
            let plane = testing::field(world, |x, _| x * math::tan(f64::to_radians(slope)));
            let [cold, wet] = [everywhere(&plane, -10.0), everywhere(&plane, 20.0)];
            let fields = [("height", &plane), ("temperature", &cold), ("precipitation", &wet)];
            let found = snow(&format!("{STILL},law={name},slides=4"), &fields);
            let expected = held_m(law, slope, 0.05);
            for (cell, depth) in found.depth.iter().enumerate().filter(|(cell, _)| cell % 40 > 2 && cell % 40 < 37) {
                // 0.1 %: heights in single precision
                let difference = (f64::from(*depth) / expected - 1.0).abs();
                assert!(difference < 1e-3 || slope > 85.0 && difference < 0.02, "{name} {slope}° {cell}: {depth} m");
            }
            let fell = 20.0 * 40.0 * 20.0 * 100.0;
            assert!((found.measure("fell") / fell - 1.0).abs() < 1e-9);
            assert!(found.measure("slid_off_the_world") > 0.8 * fell && found.measure("melted") == 0.0);
        }
    }
}

/// Below a wall lies what the wall did not hold.
#[test]
fn walls_shed_their_snow_to_their_feet() {
    let world = World { boundary: Boundary::all(Edge::Wall), ..testing::world(60, 20, 10.0) };
    let open = World { boundary: Boundary { west: Edge::Open, ..world.boundary }, ..world };
    let cliff = testing::field(open, |x, _| if x < 300.0 { 0.02 * x } else { 6.0 + 2.0 * (x - 300.0).min(150.0) });
    let [cold, wet] = [everywhere(&cliff, -10.0), everywhere(&cliff, 1.0)];
    let fields = [("height", &cliff), ("temperature", &cold), ("precipitation", &wet)];
    let found = snow(STILL, &fields);
    let level = 1000.0 / 350.0;
    let column = |i: usize| f64::from(found.depth[10 * 60 + i]);
    assert!((column(10) - level).abs() < 1e-3 && (column(55) - level).abs() < 0.2, "{} {}", column(10), column(55));
    assert!((33..42).all(|i| column(i) < 0.1), "63° holds 5 cm");
    assert!((24..31).any(|i| column(i) > 2.0 * level), "a bank at the foot");
    let still = snow(&format!("{STILL},slides=0"), &fields);
    assert!(still.depth.iter().all(|depth| (f64::from(*depth) - level).abs() < 1e-3));
}

/// One metre of snow on a real basin, against the arrays of OGGM/Snowslide with one and with many receivers: the same
/// bare cells, the same mean depth on gentle and on steep ground, and depths that differ from theirs about as much as
/// theirs from each other (0.991). Cells beside the sides are left out, where Snowslide moves nothing.
#[test]
fn snow_of_a_real_basin_lies_where_snowslide_has_it() {
    const NX: usize = 200;
    let land = include_bytes!("../../../../../tests/data/talefre_150x200.f32").chunks_exact(4);
    let land = land.map(|bytes| f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])).collect();
    let boundary = Boundary { west: Edge::Open, east: Edge::Open, north: Edge::Open, south: Edge::Open };
    let height = Field::new(Window::whole(World { boundary, ..testing::world(NX as u32, 150, 30.0) }), land);
    let truths = include_bytes!("../../../../../tests/data/talefre_150x200_snow.u16").chunks_exact(2);
    let truths: Vec<f64> = truths.map(|mm| 1e-3 * f64::from(u16::from_le_bytes([mm[0], mm[1]]))).collect();
    // 350 kg/m³ make 1 m of 0.35 m of water
    let changes = format!("{STILL},slides=6,melt_factor=0,radiation_factor=0").replace("steps=4", "steps=36");
    let fields = [
        ("height", &height),
        ("temperature", &everywhere(&height, -40.0)),
        ("precipitation", &everywhere(&height, 0.35)),
    ];
    let found = snow(&changes, &fields);
    let inner: Vec<usize> =
        (0..found.depth.len()).filter(|at| (2..NX - 2).contains(&(at % NX)) && (2..148).contains(&(at / NX))).collect();
    let own: Vec<f64> = inner.iter().map(|at| f64::from(found.depth[*at])).collect();
    assert_eq!(truths.len(), 2 * found.depth.len());
    for theirs in truths.chunks_exact(found.depth.len()) {
        let theirs: Vec<f64> = inner.iter().map(|at| theirs[*at]).collect();
        let is_bare = |depth: f64| depth < 0.06;
        let same = own.iter().zip(&theirs).filter(|(a, b)| is_bare(**a) == is_bare(**b)).count() as f64;
        let mean = |depths: &[f64]| depths.iter().sum::<f64>() / depths.len() as f64;
        let logs =
            [&own, &theirs].map(|depths| depths.iter().map(|depth| math::ln(depth + 0.01)).collect::<Vec<f64>>());
        let [a, b] = [mean(&logs[0]), mean(&logs[1])];
        let product = |of: usize, with: usize| {
            let means = [a, b];
            logs[of].iter().zip(&logs[with]).map(|(x, y)| (x - means[of]) * (y - means[with])).sum::<f64>()
        };
        let correlation = product(0, 1) / (product(0, 0) * product(1, 1)).sqrt();
        let ratio = mean(&own) / mean(&theirs);
        println!("bare alike {:.3}, means {ratio:.3}, correlation {correlation:.3}", same / own.len() as f64);
        assert!(same > 0.96 * own.len() as f64 && (ratio - 1.0).abs() < 0.02 && correlation > 0.955);
    }
}

#[test]
fn the_balance_closes_for_all_kinds_of_sides_laws_and_climates() {
    for edge in [Edge::Base, Edge::Open, Edge::Inland] {
        let height = hills(Boundary::all(edge));
        let bands = testing::field(height.window().world, |x, y| 1.0 + math::sin(x * 0.01) * math::cos(y * 0.02));
        for law in ["exponential", "power"] {
            let found =
                snow(&format!("law={law},duration=1.5,steps=9"), &[("height", &height), ("precipitation", &bands)]);
            let [fell, melted, left, remains] =
                ["fell", "melted", "slid_off_the_world", "remains"].map(|name| found.measure(name));
            assert!(fell > 0.0 && melted > 0.0 && left >= 0.0 && remains > 0.0);
            // the rasters say the same, in single precision
            let volume = |of: &[f32], scale: f64| of.iter().map(|v| f64::from(*v)).sum::<f64>() * 900.0 * scale;
            assert!((volume(&found.depth, 0.35) / remains - 1.0).abs() < 1e-5);
            assert!((volume(&found.melt, 1.0) / melted - 1.0).abs() < 1e-5);
        }
    }
    let periodic = Boundary { west: Edge::Periodic, east: Edge::Periodic, north: Edge::Wall, south: Edge::Open };
    snow("", &[("height", &hills(periodic))]);
}

#[test]
fn wind_moves_snow_into_the_lee_and_keeps_its_sum() {
    let ridge = testing::field(testing::world(80, 20, 20.0), |x, _| 400.0 - 0.3 * (x - 800.0).abs());
    let cold = everywhere(&ridge, -20.0);
    let fields = [("height", &ridge), ("temperature", &cold)];
    let blown = |changes: &str| snow(&format!("slides=0,wind=0.6,{changes}"), &fields);
    let [calm, west, east] = ["wind=0", "", "wind_azimuth=90"].map(blown);
    assert!((calm.measure("fell") / west.measure("fell") - 1.0).abs() < 1e-9);
    let at = |found: &Found, i: usize| found.depth[10 * 80 + i];
    assert!(at(&west, 25) < 0.9 * at(&calm, 25) && at(&west, 55) > 1.1 * at(&calm, 55), "the west side is windward");
    assert!((at(&west, 25) - at(&east, 54)).abs() < 1e-4 * at(&west, 25), "a mirror");
    assert!(at(&west, 40) < at(&west, 55), "the crest is blown bare");
}

/// Melt on level ground is Hock's law; slopes to the north keep more snow than those to the south.
#[test]
fn melt_follows_temperature_and_sun() {
    let level = testing::field(testing::world(12, 12, 100.0), |_, _| 0.0);
    let warm = everywhere(&level, 1.0);
    let fields = [("height", &level), ("temperature", &warm)];
    let found = snow(&format!("{STILL},radiation_factor=0"), &fields);
    // half of the precipitation of 1.5 m is snow; 1.8 mm/d/K
    assert!((found.measure("fell") / 144e4 - 0.75).abs() < 1e-9);
    assert!((found.measure("melted") / 144e4 - 1.8e-3 * 365.25).abs() < 1e-6);
    let day =
        format!("wind=0,seasonality=0,lapse_rate=0,duration={},day=80,steps=1,melt_factor=0,slides=0", 2.0 / 365.25);
    let params = testing::with_params(&crate::select::sun::NODE, "day=79,azimuths=24");
    let sun = testing::run(&crate::select::sun::NODE, &params, &[("height", &level)], "irradiance");
    let wet = everywhere(&level, 20.0);
    let found = snow(&day, &[fields[0], fields[1], ("precipitation", &wet)]);
    // two days; 24 steps of the sun instead of 48
    let expected = 2.0 * 1e-3 * 0.0192 * f64::from(sun.samples()[70]);
    let melted = found.measure("melted") / 144e4;
    assert!((melted / expected - 1.0).abs() < 0.01, "{melted} m of {expected} m, {} W/m²", sun.samples()[70]);
    let roof = testing::field(testing::world(12, 40, 50.0), |_, y| 2000.0 - 0.4 * (y - 1000.0).abs());
    let mild = everywhere(&roof, 10.0);
    let found = snow("slides=0,wind=0,day=140,duration=0.8", &[("height", &roof), ("temperature", &mild)]);
    let [north, south] = [10, 29].map(|row| found.melt[row * 12 + 6]);
    assert!(north < 0.9 * south && south > 0.0, "less melts on the north side: {north} m and {south} m");
}

#[test]
fn nothing_happens_in_no_time_and_where_it_is_warm() {
    let height = hills(Boundary::all(Edge::Base));
    let none = snow("duration=0", &[("height", &height)]);
    assert!(
        none.height == height.samples() && none.depth.iter().chain(&none.melt).chain(&none.mask).all(|v| *v == 0.0)
    );
    assert_eq!((none.measure("fell"), none.measure("remains"), none.measure("closure_error")), (0.0, 0.0, 0.0));
    let hot = everywhere(&height, 45.0);
    let params = testing::with_params(&NODE, "");
    let fields = [("height", &height), ("temperature", &hot)];
    let (outputs, warnings) =
        testing::outputs_and_warnings(&Cancel::default(), *height.window(), &NODE, &params, &fields);
    let mut outputs = outputs.expect("a result");
    let depth = outputs.take("depth").expect("an output");
    assert!(depth.as_field().expect("a field").samples().iter().all(|depth| *depth == 0.0));
    assert!(warnings.iter().any(|warning| warning.starts_with("no snow falls")), "{warnings:?}");
}

#[test]
fn negative_precipitation_voids_single_rows_and_flat_land_are_sound() {
    let height = hills(Boundary::all(Edge::Open));
    let mixed = testing::field(height.window().world, |x, _| if x < 900.0 { -3.0 } else { 2.0 });
    let params = testing::with_params(&NODE, "wind=0,slides=0");
    let fields = [("height", &height), ("precipitation", &mixed)];
    let (outputs, warnings) =
        testing::outputs_and_warnings(&Cancel::default(), *height.window(), &NODE, &params, &fields);
    let depth = outputs.expect("a result").take("depth").expect("an output");
    assert!(depth.as_field().expect("a field").samples()[..25].iter().all(|depth| *depth == 0.0));
    assert!(warnings.iter().any(|warning| warning.contains("negative")), "{warnings:?}");

    let holed = |field: &Field, value: f32| {
        let mut samples = field.samples().to_vec();
        samples[700] = value;
        samples[1500] = f32::INFINITY;
        Field::new(*field.window(), samples)
    };
    let plain = everywhere(&height, 3.0);
    let [height_nan, warm_nan, wet_nan] = [&height, &plain, &plain].map(|field| holed(field, f32::NAN));
    let fields = [("height", &height_nan), ("temperature", &warm_nan), ("precipitation", &wet_nan)];
    assert!(snow("", &fields).measure("fell") > 0.0);
    let nothing = everywhere(&height, f32::NAN);
    snow("", &[("height", &nothing)]);

    for (nx, ny) in [(40, 1), (1, 40), (1, 1), (2, 3)] {
        let flat = testing::field(testing::world(nx, ny, 10.0), |_, _| 1800.0);
        let found = snow("", &[("height", &flat)]);
        assert!(found.depth.iter().all(|depth| (depth - found.depth[0]).abs() < 1e-5 && *depth > 0.5), "{nx} x {ny}");
        let steep = testing::field(testing::world(nx, ny, 10.0), |x, y| 1800.0 + 3.0 * (x + y));
        snow("", &[("height", &steep)]);
    }
    let sea = testing::at_sea(&height, 900.0);
    let found = snow("", &[("height", &sea)]);
    assert!(found.depth.iter().zip(sea.samples()).all(|(depth, land)| *land >= 900.0 || *depth == 0.0));
    let closed = hills(Boundary::all(Edge::Wall));
    let refused = testing::outputs(&NODE, &testing::with_params(&NODE, ""), &[("height", &closed)]);
    assert!(refused.is_err_and(|error| error.to_string().contains("no side of the world lets water out")));
    snow("slides=0", &[("height", &closed)]);
}

#[test]
fn steps_cover_the_time_before_the_day_and_the_south_has_its_own_winter() {
    let steps = |changes: &str| weather::steps(&super::Params::read(&testing::with_params(&NODE, changes)));
    let year = steps("duration=1,steps=12,day=100");
    assert!((year.iter().map(|step| step.days).sum::<f64>() - 365.25).abs() < 1e-9);
    assert!(year.iter().map(|step| step.season_c).sum::<f64>().abs() < 1e-9);
    assert!(
        (year[11].day - (100.0 - 365.25 / 24.0)).abs() < 1e-9 && (year[0].day - (100.0 + 365.25 / 24.0)).abs() < 1e-9
    );
    let [north, south] =
        ["45", "-45"].map(|at| steps(&format!("day=20,duration=0.1,steps=1,latitude={at}"))[0].season_c);
    assert!(north < -7.0 && (north + south).abs() < 1e-9);
    assert!(steps("duration=0").is_empty());
}

#[test]
fn the_same_for_any_thread_count_and_simd_level() {
    let height = hills(Boundary::all(Edge::Open));
    let params = testing::with_params(&NODE, "day=140,steps=4");
    let fields = [("height", &height)];
    assert_eq!(testing::run_in(1, &NODE, &params, &fields), testing::run_in(5, &NODE, &params, &fields));
    testing::at_every_level(|| testing::outputs(&NODE, &params, &fields));
    let cancel = Cancel::default();
    cancel.cancel();
    let stopped = testing::outputs_until(&cancel, *height.window(), &NODE, &params, &fields);
    assert!(matches!(stopped, Err(NodeError::Cancelled)));
}
