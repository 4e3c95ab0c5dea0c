//! Tests of landslides: closed forms, balances, published exponents, and runs on land of many kinds.

use orograph_graph::{Boundary, Cancel, Edge, World};

use super::{
    NODE, Params,
    draw::{self, Kind},
    land::{Land, Room},
    record::{scaling, tail},
    soil::Soil,
    wedge::{Scar, critical_m},
};
use crate::{numerics::math, prelude::*, testing};

struct Found {
    height: Vec<f32>,
    scars: Vec<f32>,
    deposit: Vec<f32>,
    soil: Vec<f32>,
    report: Report,
}

impl Found {
    fn measure(&self, name: &str) -> f64 {
        self.report.get(name).expect("a measure")
    }

    fn slides(&self) -> f64 {
        self.measure("rock_slides") + self.measure("soil_slides")
    }

    /// The values of the table of events.
    fn column(&self, series: &str, of_y: bool) -> &[f64] {
        let series = self.report.series.iter().find(|found| found.name == series).expect("a series");
        if of_y { &series.y.values } else { &series.x.values }
    }
}

fn found(mut outputs: Outputs) -> Found {
    let report = outputs.take("report").expect("an output").as_report().expect("a report").clone();
    let mut take = |name| outputs.take(name).expect("an output").as_field().expect("a field").clone().into_samples();
    let found =
        Found { height: take("height"), scars: take("scars"), deposit: take("deposit"), soil: take("soil"), report };
    let all = [&found.height, &found.scars, &found.deposit, &found.soil];
    assert!(all.into_iter().flatten().all(|value| value.is_finite()));
    assert!(all[1..].iter().all(|field| field.iter().all(|thickness| *thickness >= 0.0)));
    assert!(found.measure("closure_error") < 1e-9, "{}", found.measure("closure_error"));
    found
}

fn slide(changes: &str, fields: &[(&str, &Field)]) -> Found {
    found(testing::outputs(&NODE, &testing::with_params(&NODE, changes), fields).expect("a result"))
}

fn everywhere(like: &Field, value: f32) -> Field {
    Field::constant(*like.window(), value)
}

/// Mountains with straight slopes of about 35 to 45°, as functions of place.
fn mountains(cells: [u32; 2], cell_m: f64, boundary: Boundary) -> Field {
    let world = World { boundary, ..testing::world(cells[0], cells[1], cell_m) };
    testing::field(world, |x, y| {
        let wave = |at: f64, length_m: f64| 1.0 - (2.0 * ((at / length_m).rem_euclid(1.0) - 0.5)).abs();
        let bend = 180.0 * math::sin(x / 310.0) + 150.0 * math::cos(y / 270.0);
        900.0 * wave(x + 0.3 * y + bend, 2600.0) + 350.0 * wave(y - 0.4 * x + bend, 1100.0) + 90.0 * wave(x - y, 410.0)
    })
}

const OPEN: Boundary = Boundary { west: Edge::Open, east: Edge::Open, north: Edge::Open, south: Edge::Open };

#[test]
fn the_critical_height_is_that_of_culmann() {
    for (slope, friction) in [(45.0, 30.0), (60.0, 25.0), (89.0, 38.0), (90.0, 0.0), (30.1, 30.0)] {
        let [slope, friction] = [slope, friction].map(f64::to_radians);
        let expected = 4.0 * 50e3 / 25e3 * math::sin(slope) * math::cos(friction) / (1.0 - math::cos(slope - friction));
        assert!((critical_m(50e3, 25e3, slope, friction) / expected - 1.0).abs() < 1e-6);
    }
    // a vertical cut in clay without friction: 4 c / γ
    assert!((critical_m(20e3, 20e3, 90_f64.to_radians(), 0.0) - 4.0).abs() < 1e-12);
    assert_eq!(critical_m(20e3, 20e3, 0.6, 0.6), f64::INFINITY);
}

/// A long slope below level land loses H² (cot θ − cot β) / 2 per metre.
#[test]
fn a_wedge_has_the_volume_of_the_closed_form() {
    for (slope, dip) in [(60.0, 40.0), (45.0, 35.0), (75.0, 50.0)] {
        let [slope, dip] = [slope, dip].map(|angle| math::tan(f64::to_radians(angle)));
        let height_m = 100.0;
        let field = testing::field(testing::world(400, 12, 1.0), |x, _| (slope * (x - 100.0)).clamp(0.0, height_m));
        let mut land = Land::new(field.window(), field.samples(), Vec::new()).expect("land");
        let scar = Scar {
            toe_m: [100.0, 6.0],
            toe_height_m: 0.0,
            up: [1.0, 0.0],
            dip,
            thickness_m: f64::INFINITY,
            length_m: 1000.0,
            width_m: 1e6,
            roughness: 0.0,
            outline: 0,
        };
        let mut room = Room::new(field.samples().len()).expect("room");
        let cells = scar.cells(&land, &mut room);
        let moved: f64 = cells.iter().map(|(cell, depth)| land.remove(*cell as usize, *depth, 1.25)).sum();
        let expected = 12.0 * 0.5 * height_m * height_m * (1.0 / dip - 1.0 / slope);
        assert!((land.ledger.rock / expected - 1.0).abs() < 0.01, "{} m³ of {expected} m³", land.ledger.rock);
        assert!((moved / (1.25 * expected) - 1.0).abs() < 0.01);
        // the floor of the scar is the plane
        assert!(cells.iter().all(|(cell, _)| {
            let x = land.centre_m(*cell as usize)[0] - 100.0;
            (land.ground[*cell as usize] - dip * x).abs() < 1e-3
        }));
    }
}

#[test]
fn fits_find_the_exponents_of_drawn_numbers() {
    for exponent in [1.7, 2.4, 3.1] {
        let drawn = (0..4000).map(|k| 100.0 * math::pow(draw::unit(orograph_graph::mix(k)), -1.0 / (exponent - 1.0)));
        let tail = tail(drawn).expect("a tail");
        let error = (exponent - 1.0) / (tail.count as f64).sqrt();
        assert!((tail.exponent - exponent).abs() < 4.0 * error, "{} of {exponent}", tail.exponent);
    }
    let line = (1..50).map(|k| (f64::from(k), 3.0 * math::pow(f64::from(k), 1.35)));
    assert!((scaling(line).expect("a line") - 1.35).abs() < 1e-12);
    assert_eq!(scaling((0..50).map(|_| (1.0, 2.0))), None);
    assert_eq!(tail((0..29).map(f64::from)), None);
    assert_eq!(tail((0..50).map(|_| 7.0)), None);
}

/// Malamud et al. (2004) find an exponent of 2.4 for the areas of three inventories, and others lie between 1.9 and 2.9;
/// Larsen et al. (2010) 1.3 to 1.6 for the volumes of slides in rock, Guzzetti et al. (2009) 1.45, the specification 1.2 to 1.5.
#[test]
fn areas_and_volumes_have_the_published_exponents() {
    let land = mountains([600, 600], 15.0, OPEN);
    for seed in [0, 1] {
        let found = slide(&format!("rate=4,duration=2e4,seed={seed},variation_size=0"), &[("height", &land)]);
        let [count, area, scaling, volume] =
            ["rock_slides", "area_exponent", "volume_area_exponent", "volume_exponent"].map(|name| found.measure(name));
        println!(
            "{count} slides: areas {area:.2}, V-A {scaling:.2}, volumes {volume:.2}, largest {}",
            found.measure("largest_area")
        );
        assert!(count > 300.0, "{count}");
        assert!((1.9..2.9).contains(&area), "{area}");
        assert!((1.2..1.5).contains(&scaling), "{scaling}");
        assert!((1.5..2.4).contains(&volume), "{volume}");
    }
}

#[test]
fn the_factor_of_safety_is_the_closed_form() {
    let soil = Soil { cohesion: 0.0, friction: math::tan(f64::to_radians(33.0)), unit_weight: 18e3 };
    for degrees in [5.0, 20.0, 33.0, 45.0, 70.0, 89.0] {
        let slope = f64::to_radians(degrees);
        // without cohesion and water: tan φ / tan β
        let dry = soil.safety(2.0, math::tan(slope), 0.0);
        assert!((dry * math::tan(slope) / soil.friction - 1.0).abs() < 1e-12);
        let cohesive = Soil { cohesion: 4e3, ..soil };
        for (depth, wet) in [(0.5, 0.0), (1.0, 0.5), (3.0, 1.0)] {
            let (sine, cosine) = (math::sin(slope), math::cos(slope));
            let expected = (4e3 + (18e3 - wet * 9810.0) * depth * cosine * cosine * soil.friction)
                / (18e3 * depth * sine * cosine);
            assert!((cohesive.safety(depth, math::tan(slope), wet) / expected - 1.0).abs() < 1e-9);
        }
    }
    assert_eq!(soil.safety(0.0, 1.0, 1.0), f64::INFINITY);
    assert_eq!(soil.safety(1.0, 0.0, 1.0), f64::INFINITY);
}

/// Soil of 30° with an angle of friction of 37° slides when it is wet, down to the rock, and only there.
#[test]
fn wet_soil_slides_to_the_rock_below_it() {
    let world = World { boundary: OPEN, ..testing::world(150, 100, 10.0) };
    let ramp = testing::field(world, |_, y| 0.577 * (1000.0 - y).max(300.0));
    let [thick, dry] = [1.5, 0.0].map(|value| everywhere(&ramp, value));
    let half = testing::field(world, |x, _| if x < 750.0 { 0.0 } else { 1.0 });
    let changes = "rate=0,soil_rate=300,soil_cohesion=500,soil_friction=37,smallest=40,largest=200";
    let still = slide(changes, &[("height", &ramp), ("soil", &thick), ("wetness", &dry)]);
    assert_eq!(still.slides(), 0.0);
    assert!(still.height == ramp.samples() && still.soil.iter().all(|soil| *soil == 1.5));
    let found = slide(changes, &[("height", &ramp), ("soil", &thick), ("wetness", &half)]);
    assert!(found.measure("soil_slides") > 20.0 && found.measure("rock_broken") == 0.0);
    let cells = || (0..150 * 100).filter(|cell| found.scars[*cell] > 0.0);
    assert!(cells().all(|cell| cell % 150 >= 74 && cell / 150 <= 71), "only where it is wet and steep");
    assert!(cells().any(|cell| found.deposit[cell] == 0.0 && found.soil[cell] == 0.0), "bare rock");
    assert!(found.measure("loose_moved") > 0.0 && found.deposit.iter().any(|deposit| *deposit > 0.1));
    let without = slide(changes, &[("height", &ramp)]);
    assert_eq!(without.slides(), 0.0);
}

/// Without cohesion every place of a steep slope fails, so that events follow from the rate. A longer run begins with those of
/// a shorter one.
#[test]
fn events_have_the_rate_and_begin_alike() {
    let world = World { boundary: OPEN, ..testing::world(300, 300, 20.0) };
    let ramp = testing::field(world, |x, _| 4.0 * x);
    let run = |duration: f64| {
        let changes = format!("duration={duration},rate=2,cohesion=0,largest=200,seed=3");
        let params = Params::read(&testing::with_params(&NODE, &changes));
        let fields = [("height", &ramp)];
        let tests = testing::with_job(*ramp.window(), |job| draw::tests(job, &params, false).expect("tests").resolved);
        (slide(&changes, &fields), tests)
    };
    let (short, _) = run(5e3);
    let (long, tests) = run(20e3);
    // 36 km², 2 per km² and kyr, 20 kyr
    let expected = 36.0 * 2.0 * 20.0;
    assert!((tests.len() as f64 - expected).abs() < 4.0 * expected.sqrt(), "{} of {expected}", tests.len());
    // those at the upper side have no land above them
    assert!(long.slides() > 0.85 * expected && long.slides() <= long.measure("tested_places"), "{}", long.slides());
    let count = short.slides() as usize;
    assert!(count > 200);
    for (series, of_y) in [("places", false), ("places", true), ("sizes", false), ("sizes", true), ("times", false)] {
        assert_eq!(short.column(series, of_y), &long.column(series, of_y)[..count], "{series}");
    }
    assert!(tests.windows(2).all(|pair| pair[0].time_yr <= pair[1].time_yr && pair[0].kind == Kind::Rock));
}

/// The same events at cells of 10 and of 20 m: their number agrees to 6 %, their volume to 10 %.
#[test]
fn events_are_the_same_at_two_cell_sizes() {
    let changes = "rate=3,smallest=100,variation_size=0";
    let [fine, coarse] = [(480, 10.0), (240, 20.0)].map(|(cells, cell_m)| {
        let land = mountains([cells; 2], cell_m, OPEN);
        slide(changes, &[("height", &land)])
    });
    let [number, volume] = ["rock_slides", "rock_broken"].map(|name| [fine.measure(name), coarse.measure(name)]);
    println!("{number:?} {volume:?}");
    assert!(number[0] > 100.0 && (number[1] / number[0] - 1.0).abs() < 0.06, "{number:?}");
    assert!((volume[1] / volume[0] - 1.0).abs() < 0.1, "{volume:?}");
    assert_eq!(fine.measure("tested_places"), coarse.measure("tested_places"));
}

#[test]
fn the_balance_closes_for_all_kinds_of_sides_and_materials() {
    for edge in [Edge::Base, Edge::Open, Edge::Inland, Edge::Wall, Edge::Periodic] {
        let land = mountains([120, 90], 25.0, Boundary::all(edge));
        let [soil, wet] = [2.0, 1.0].map(|value| everywhere(&land, value));
        for changes in ["bulking=1", "", "bulking=2,spread=2,shaking=0.4", "spread=500,deposit_slope=3"] {
            let found = slide(&format!("rate=6,{changes}"), &[("height", &land), ("soil", &soil), ("wetness", &wet)]);
            let [rock, loose, settled, left] =
                ["rock_broken", "loose_moved", "settled", "left_the_world"].map(|name| found.measure(name));
            assert!(found.measure("rock_slides") > 5.0 && found.measure("soil_slides") > 20.0, "{edge:?}");
            assert!(rock > 0.0 && loose > 0.0 && settled > 0.0);
            assert!(left > 0.0 || matches!(edge, Edge::Wall | Edge::Periodic));
            assert!(left == 0.0 || !matches!(edge, Edge::Wall | Edge::Periodic), "{edge:?}: {left} m³");
            // the rasters say the same, in single precision
            let sum = |of: &[f32]| of.iter().map(|value| f64::from(*value)).sum::<f64>() * 625.0;
            assert!((sum(&found.scars) / (rock + loose) - 1.0).abs() < 1e-5);
            let change = sum(&found.height) - sum(land.samples());
            assert!((change - (settled - rock - loose)).abs() < 1e-3 * settled, "{change}");
            let deposit = everywhere(&land, 0.0);
            assert!(found.deposit.len() == deposit.samples().len() && sum(&found.deposit) <= settled * (1.0 + 1e-6));
        }
    }
}

/// A deposit covers `spread` V^(2/3) and has no spikes.
#[test]
fn deposits_cover_the_published_area() {
    let world = World { boundary: Boundary::all(Edge::Wall), ..testing::world(400, 300, 10.0) };
    let slope = testing::field(world, |x, _| 0.9 * (1500.0 - x).max(0.0) + 0.05 * (4000.0 - x).min(2500.0));
    for spread in [20.0, 60.0] {
        // one slide
        let changes = format!("rate=0.4,duration=1e3,smallest=400,largest=401,cohesion=0,spread={spread}");
        let found = slide(&changes, &[("height", &slope)]);
        let count = found.slides();
        let volume = 1.25 * found.measure("rock_broken") / count;
        let covered = found.deposit.iter().filter(|deposit| **deposit > 0.05).count() as f64 * 100.0 / count;
        let expected = spread * math::pow(volume, 2.0 / 3.0);
        let most = found.deposit.iter().fold(0.0_f32, |most, deposit| most.max(*deposit));
        let sheet = math::pow(volume, 1.0 / 3.0) / spread;
        println!("{count} of {volume:.0} m³: {covered:.0} m² of {expected:.0} m², {most} m of {sheet:.1} m");
        assert!(count > 0.0 && (0.5..2.0).contains(&(covered / expected)), "{covered} of {expected}");
        assert!(f64::from(most) < 6.0 * sheet, "{most} m of {sheet} m");
        assert!(found.column("runouts", false).iter().any(|runout| *runout > 1000.0));
    }
}

/// The slopes that `StreamPower` leaves are at its threshold: without shaking they hold here, in the same rock.
#[test]
fn slopes_of_rivers_hold_in_the_same_rock() {
    let base = testing::field(testing::world(96, 96, 60.0), |x, y| 30.0 * math::sin(x / 400.0) * math::cos(y / 300.0));
    let uplift = everywhere(&base, 0.004);
    let changes = "duration=4e5,schedule=full,seed=5";
    let params = testing::with_params(&crate::erosion::stream_power::NODE, changes);
    let fields = [("height", &base), ("uplift", &uplift)];
    let land = testing::run(&crate::erosion::stream_power::NODE, &params, &fields, "height");
    let count = |changes: &str| {
        let common = "rate=100,duration=1e4,cohesion=20e3,scatter=0,largest=2000";
        slide(&format!("{common},{changes}"), &[("height", &land)]).measure("rock_slides")
    };
    let [same, other, shaken] = ["seed=5,shaking=0", "seed=6,shaking=0", "seed=5,shaking=0.3"].map(count);
    println!("{same} {other} {shaken}");
    assert!(same < 0.2 * other && same < 0.1 * shaken, "{same} {other} {shaken}");
}

/// Rock that is soft and weak fails at its own angle, and the hard layer above holds.
#[test]
fn layers_fail_at_their_own_angles() {
    let world = World { boundary: OPEN, ..testing::world(200, 200, 10.0) };
    let ramp = testing::field(world, |x, _| x);
    // below 1000 m rock that stands at 30°, above it rock that stands at 80°
    let strata = testing::strata(everywhere(&ramp, 0.0), 1000.0 + 500.0, &[(500.0, 5.0, 80.0), (500.0, 0.5, 30.0)]);
    let params = testing::with_params(&NODE, "rate=20,shaking=0,variation_size=0,smallest=50,largest=150,cohesion=1e3");
    let found = found(testing::outputs_in_rock(&strata, &NODE, &params, &[("height", &ramp)]).expect("a result"));
    let scars = |columns: std::ops::Range<usize>| {
        (0..200 * 200).filter(|cell| columns.contains(&(cell % 200)) && found.scars[*cell] > 0.0).count()
    };
    assert!(scars(0..95) > 1000, "{}", scars(0..95));
    assert_eq!(scars(125..200), 0);
}

#[test]
fn nothing_happens_without_time_rate_or_slopes() {
    let land = mountains([80, 80], 25.0, OPEN);
    for changes in ["duration=0", "rate=0", "cohesion=1e8"] {
        let found = slide(changes, &[("height", &land)]);
        assert!(found.height == land.samples() && found.slides() == 0.0, "{changes}");
        assert!(found.scars.iter().chain(&found.deposit).chain(&found.soil).all(|value| *value == 0.0));
        assert!(found.report.series.is_empty());
    }
    for (nx, ny) in [(1, 1), (60, 1), (1, 60), (2, 2), (50, 40)] {
        for edge in [Edge::Open, Edge::Wall, Edge::Periodic, Edge::Base] {
            let world = World { boundary: Boundary::all(edge), ..testing::world(nx, ny, 20.0) };
            let flat = testing::field(world, |_, _| 700.0);
            let [soil, wet] = [2.0, 1.0].map(|value| everywhere(&flat, value));
            let fields = [("height", &flat), ("soil", &soil), ("wetness", &wet)];
            assert_eq!(slide("rate=500,soil_rate=500,cohesion=0", &fields).slides(), 0.0);
            let steep = testing::field(world, |x, y| math::tan(f64::to_radians(89.0)) * (x + y));
            let fields = [("height", &steep), ("soil", &soil), ("wetness", &wet)];
            slide("rate=500,soil_rate=500", &fields);
        }
    }
    let many = testing::outputs(&NODE, &testing::with_params(&NODE, "rate=1e4,duration=1e9"), &[("height", &land)]);
    assert!(many.is_err_and(|error| error.to_string().contains("places would be tested")));
    let [mut odd, mut half] = [OPEN; 2];
    odd.west = Edge::Periodic;
    half.south = Edge::Periodic;
    for boundary in [odd, half] {
        let land = mountains([40, 40], 25.0, boundary);
        let refused = testing::outputs(&NODE, &testing::with_params(&NODE, ""), &[("height", &land)]);
        assert!(refused.is_err_and(|error| error.to_string().contains("periodic")));
    }
}

#[test]
fn voids_and_cliffs_are_sound() {
    let land = mountains([80, 80], 25.0, OPEN);
    let holed = |field: &Field| {
        let mut samples = field.samples().to_vec();
        samples[700] = f32::NAN;
        samples[1500..1540].fill(f32::NAN);
        samples[3000] = f32::INFINITY;
        Field::new(*field.window(), samples)
    };
    let [soil, wet, repose] = [1.0, 1.0, 30.0].map(|value| holed(&everywhere(&land, value)));
    let holed_land = holed(&land);
    let fields = [("height", &holed_land), ("soil", &soil), ("wetness", &wet), ("repose", &repose)];
    assert!(slide("rate=20", &fields).slides() > 10.0);
    slide("rate=20,variation_size=0", &fields);
    let nothing = everywhere(&land, f32::NAN);
    assert_eq!(slide("rate=20", &[("height", &nothing)]).slides(), 0.0);
    let cliff = testing::field(land.window().world, |x, _| if x < 1000.0 { 900.0 } else { 0.0 });
    assert!(slide("rate=20", &[("height", &cliff)]).slides() > 0.0);
    let negative = everywhere(&land, -1.0);
    let (outputs, warnings) = testing::outputs_and_warnings(
        &Cancel::default(),
        *land.window(),
        &NODE,
        &testing::with_params(&NODE, ""),
        &[("height", &land), ("soil", &negative)],
    );
    assert_eq!(found(outputs.expect("a result")).measure("soil_slides"), 0.0);
    assert!(warnings.iter().any(|warning| warning.contains("negative")), "{warnings:?}");
}

#[test]
fn the_same_for_any_thread_count_and_simd_level() {
    let land = mountains([150, 120], 25.0, OPEN);
    let [soil, wet] = [2.0, 1.0].map(|value| everywhere(&land, value));
    let params = testing::with_params(&NODE, "rate=10");
    let fields = [("height", &land), ("soil", &soil), ("wetness", &wet)];
    assert_eq!(testing::run_in(1, &NODE, &params, &fields), testing::run_in(5, &NODE, &params, &fields));
    testing::at_every_level(|| testing::outputs(&NODE, &params, &fields));
    let cancel = Cancel::default();
    cancel.cancel();
    let stopped = testing::outputs_until(&cancel, *land.window(), &NODE, &params, &fields);
    assert!(matches!(stopped, Err(NodeError::Cancelled)));
}
