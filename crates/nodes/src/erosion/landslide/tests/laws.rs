//! The strength of rock and soil.

use super::{
    super::{
        land::{Land, Room},
        scar::Scar,
        soil::Soil,
        wedge::critical_m,
    },
    *,
};

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
    assert!(found.measure("soil_slides") > 20.0 && found.rock() == 0.0);
    let cells = || (0..150 * 100).filter(|cell| found.scars[*cell] > 0.0);
    assert!(cells().all(|cell| cell % 150 >= 74 && cell / 150 <= 71), "only where it is wet and steep");
    assert!(cells().any(|cell| found.deposit[cell] == 0.0 && found.soil[cell] == 0.0), "bare rock");
    assert!(found.volume("soil", "became_debris") > 0.0 && found.deposit.iter().any(|deposit| *deposit > 0.1));
    let without = slide(changes, &[("height", &ramp)]);
    assert_eq!(without.slides(), 0.0);
}

/// The slopes that `StreamPower` leaves are at its threshold: without shaking they hold here, in the same rock.
#[test]
fn slopes_of_rivers_hold_in_the_same_rock() {
    let base = testing::field(testing::world(96, 96, 60.0), |x, y| 30.0 * math::sin(x / 400.0) * math::cos(y / 300.0));
    let uplift = everywhere(&base, 0.004);
    let changes = "duration=4e5,schedule=full,seed=5,irregularity=0";
    let params = testing::with_params(&crate::erosion::stream_power::NODE, changes);
    let fields = [("height", &base), ("uplift", &uplift)];
    let land = testing::run(&crate::erosion::stream_power::NODE, &params, &fields, "height");
    let count = |changes: &str| {
        let common = "rate=100,duration=1e4,cohesion=20e3,scatter=0,largest=2000";
        slide(&format!("{common},{changes}"), &[("height", &land)]).measure("rock_slides")
    };
    let [same, other, shaken, even] =
        ["seed=5,shaking=0", "seed=6,shaking=0", "seed=5,shaking=0.3", "seed=5,shaking=0,knolls=0"].map(count);
    assert!(same < 0.2 * other && same < 0.1 * shaken, "{same} {other} {shaken}");
    // without knolls, rough ground would be too steep
    assert!(same < 0.5 * even, "{same} {even}");
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
