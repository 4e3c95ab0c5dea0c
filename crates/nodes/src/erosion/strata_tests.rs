//! Processes in layers of rock: each finds the layer at the present level of the rock.

use orograph_graph::Strata;

use super::{glacial, hydraulic_pipe, landslide, thermal, weathering};
use crate::{numerics::math, prelude::*, testing};

fn flat(on: &Field, top_m: f64, layers: &[(f64, f64, f64)]) -> Strata {
    testing::strata(Field::constant(*on.window(), 0.0), top_m, layers)
}

fn output(strata: &Strata, node: &'static Node, changes: &str, fields: &[(&str, &Field)], name: &str) -> Vec<f32> {
    let params = testing::with_params(node, changes);
    let mut outputs = testing::outputs_in_rock(strata, node, &params, fields).expect("a result");
    outputs.take(name).expect("an output").as_field().expect("a field").samples().to_vec()
}

/// A wall of three layers leans back to the angle of each: from its foot the profile climbs at 50°, 25° and 70°.
#[test]
fn thermal_leaves_each_layer_at_its_own_angle() {
    let height = testing::field(testing::world(240, 12, 5.0), |x, _| if x < 900.0 { 300.0 } else { 0.0 });
    let bare = Field::constant(*height.window(), 0.0);
    let angles = [70.0_f64, 25.0, 50.0];
    let rock = flat(&height, 300.0, &angles.map(|angle| (100.0, 1.0, angle)));
    let crumbled = output(&rock, &thermal::NODE, "", &[("height", &height), ("debris", &bare)], "crumbled");
    // the foot is the first cell beyond the wall
    let foot_m = 902.5;
    for cell in 0..180 {
        let mut far_m = foot_m - (cell as f64 + 0.5) * 5.0;
        let mut expected = 0.0;
        for angle in [50.0_f64, 25.0, 70.0] {
            let slope = math::tan(angle.to_radians());
            let length_m = (100.0 / slope).min(far_m);
            expected += length_m * slope;
            far_m -= length_m;
        }
        let found = f64::from(height.samples()[6 * 240 + cell] - crumbled[6 * 240 + cell]);
        // heights of 300 m in single precision, added up over 66 cells
        assert!((found - expected).abs() < 1e-2, "{cell}: {found}, expected {expected}");
    }
}

/// In rock of hardness 4 a flat bench weathers by the closed form at a quarter of the rate.
#[test]
fn weathering_is_slower_in_hard_rock() {
    let bench = testing::field(testing::world(20, 12, 10.0), |_, _| 2000.0);
    let debris = |hardness: f64| {
        let rock = flat(&bench, 2100.0, &[(50.0, 1.0, 38.0), (100.0, hardness, 38.0)]);
        output(&rock, &weathering::NODE, "duration=30000", &[("height", &bench)], "debris")[65]
    };
    let rate = 5e-4 * math::exp(-0.5 * (4.0 / 3.0) * (4.0 / 3.0)) + 1e-4;
    for hardness in [1.0, 4.0] {
        let expected = 0.5 * math::ln(1.0 + 1.3 * rate / hardness * 30_000.0 / 0.5);
        // single precision over some 16 rounds
        assert!((f64::from(debris(hardness)) / expected - 1.0).abs() < 1e-4, "{hardness}");
    }
}

/// Hard rock is a threshold for the water; layers of hardness 1 are plain rock, byte for byte.
#[test]
fn a_storm_erodes_hard_rock_less() {
    let land = testing::field(testing::world(48, 40, 10.0), |x, y| 0.2 * x + 4.0 * math::sin(x / 30.0 + y / 17.0));
    let bare = Field::constant(*land.window(), 0.0);
    let fields = [("height", &land), ("regolith", &bare)];
    let changes = "duration=600, rock=0.5, width=0";
    let change = |hardness: f64| {
        let rock = flat(&land, 200.0, &[(100.0, 3.0, 38.0), (300.0, hardness, 38.0)]);
        output(&rock, &hydraulic_pipe::NODE, changes, &fields, "deposition")
    };
    let lost = |change: &[f32]| change.iter().map(|change| f64::from(change.min(0.0))).sum::<f64>();
    let params = testing::with_params(&hydraulic_pipe::NODE, changes);
    let plain = testing::run(&hydraulic_pipe::NODE, &params, &fields, "deposition");
    assert_eq!(change(1.0), plain.samples());
    let (soft, hard) = (lost(&change(1.0)), lost(&change(10.0)));
    assert!(hard < 0.0 && hard / soft < 0.5, "{hard} m and {soft} m");
}

/// One step of a glacier takes a quarter from a bed of hardness 4; layers of hardness 1 are plain rock, byte for byte.
#[test]
fn glaciers_wear_hard_beds_more_slowly() {
    let height = testing::field(testing::world(40, 40, 200.0), |x, y| {
        1200.0 + 300.0 * math::cos(x / 1300.0) * math::cos(y / 1100.0)
    });
    let ela = Field::constant(*height.window(), 900.0);
    let fields = [("height", &height), ("ela", &ela)];
    let changes = "steps=1,duration=2000,method=fast,ice_cell=200,walls=85,plucking=0";
    let eroded = |hardness: f64| {
        let rock = flat(&height, 1600.0, &[(900.0, hardness, 85.0)]);
        output(&rock, &glacial::NODE, changes, &fields, "erosion")
    };
    let params = testing::with_params(&glacial::NODE, changes);
    let plain = testing::run(&glacial::NODE, &params, &fields, "erosion");
    assert_eq!(eroded(1.0), plain.samples());
    let total = |eroded: &[f32]| eroded.iter().map(|&metres| f64::from(metres)).sum::<f64>();
    let ratio = total(&eroded(4.0)) / total(&eroded(1.0));
    // heights of 1500 m in single precision
    assert!((ratio - 0.25).abs() < 0.01, "{ratio}");
}

/// Layers of equal rock change no byte of any process, whatever their number.
#[test]
fn the_number_of_layers_of_equal_rock_changes_no_byte() {
    let height = testing::field(testing::world(32, 32, 50.0), |x, y| 600.0 + 200.0 * math::sin(x / 200.0 + y / 330.0));
    let bare = Field::constant(*height.window(), 0.0);
    for (node, changes, second) in [
        (&thermal::NODE, "", "debris"),
        (&weathering::NODE, "duration=3000", "debris"),
        (&hydraulic_pipe::NODE, "duration=600,rock=0.5", "regolith"),
        (&glacial::NODE, "steps=3,ice_cell=50,duration=3000,method=fast", "ela"),
        (&glacial::NODE, "steps=1,ice_cell=100,duration=200", "ela"),
        (&landslide::NODE, "duration=100000,cohesion=1000,shaking=0.5", "soil"),
    ] {
        let [few, many] = [8, 200].map(|count| {
            let layers = vec![(1600.0 / f64::from(count), 3.0, 44.0); count as usize];
            output(&flat(&height, 1000.0, &layers), node, changes, &[("height", &height), (second, &bare)], "height")
        });
        assert_eq!(few, many, "{}", node.id);
        assert_ne!(few, height.samples(), "{} changes the terrain", node.id);
    }
}
