//! Tests of rivers in layers of rock.

use orograph_graph::Strata;

use super::{
    NODE,
    tests::{PLAIN, RIVERS, strip, white},
};
use crate::{numerics::math, prelude::*, testing};

/// Flat layers under a strip, from the height of its plateau down.
fn layers(on: &Field, top_m: f64, layers: &[(f64, f64, f64)]) -> Strata {
    testing::strata(Field::constant(*on.window(), 0.0), top_m, layers)
}

fn heights(height: &Field, strata: &Strata, changes: &str) -> Vec<f32> {
    let erodibility = Field::constant(*height.window(), 1e-5);
    let fields = [("height", height), ("erodibility", &erodibility)];
    let params = testing::with_params(&NODE, &format!("{RIVERS},{PLAIN},{changes}"));
    let mut found = testing::outputs_in_rock(strata, &NODE, &params, &fields).expect("a result");
    found.take("height").expect("an output").as_field().expect("a field").samples().to_vec()
}

/// With n = 1 every height of a profile travels upstream at the celerity K √A of its own layer. So a scarp that is cut
/// into a plateau of soft rock over hard rock becomes two knickpoints, with a bench at the contact between them.
#[test]
fn knickpoints_at_layer_tops_travel_at_the_celerity_of_their_layer() {
    let cells = 400;
    let height = strip(cells, |_| 400.0);
    let rock = layers(&height, 400.0, &[(200.0, 1.0, 90.0), (200.0, 4.0, 90.0)]);
    let found = heights(&height, &rock, "duration=1e6,time_step=2e3");
    for (level, celerity) in [(300.0, 1e-5), (100.0, 2.5e-6)] {
        // the westernmost cell below the level
        let at = found.iter().position(|height| *height < level).expect("a knickpoint");
        let travel_yr: f64 =
            (at..cells as usize).map(|cell| 100.0 / (celerity * ((cell + 1) as f64 * 1e4).sqrt())).sum();
        // 3 %: one cell, and the centre of a smeared step
        assert!((travel_yr / 1e6 - 1.0).abs() < 0.03, "{level} m: {travel_yr} yr at cell {at}");
    }
    let bench = found.iter().filter(|height| (**height - 200.0).abs() < 10.0).count();
    assert!(bench > 60, "a bench of {bench} cells");
}

/// Layers are cut one after the other within a step, so that a few long steps give what many short ones do.
#[test]
fn the_cut_hardly_depends_on_the_step() {
    let height = testing::field(testing::world(64, 64, 100.0), |x, y| 800.0 + 20.0 * white(x, y));
    let height = Field::new(
        *height.window(),
        (0..64 * 64)
            .map(|cell| {
                let is_border = [cell / 64, cell % 64].iter().any(|&at| at == 0 || at == 63);
                if is_border { 0.0 } else { height.samples()[cell] }
            })
            .collect(),
    );
    let bands: Vec<(f64, f64, f64)> = (0..10).map(|k| (90.0, if k % 2 == 0 { 5.0 } else { 0.6 }, 75.0)).collect();
    let rock = layers(&height, 850.0, &bands);
    for n in ["n=1", "n=1.5,m=0.6", "n=0.8,m=0.4"] {
        let mean = |step: f64| {
            let found = heights(&height, &rock, &format!("{n},duration=4e5,time_step={step}"));
            testing::moments(&found).0
        };
        let (long, short) = (mean(1e4), mean(2.5e3));
        // 5 % of what is left for steps four times as long; a tenth of 750 m and more is gone
        assert!((long / short - 1.0).abs() < 0.05 && short < 680.0, "{n}: {long} m and {short} m");
    }
}

#[test]
fn the_number_of_layers_of_equal_rock_changes_no_byte() {
    let height = testing::field(testing::world(48, 48, 100.0), |x, y| 300.0 * white(x, y) + 0.1 * x);
    let [eight, many] = [8, 200].map(|count| {
        let rock = layers(&height, 900.0, &vec![(1600.0 / f64::from(count), 2.0, 40.0); count as usize]);
        heights(
            &height,
            &rock,
            "duration=5e5,variation_size=8e3,variation=0.5,repose_variation=7,headwater_area=1e5,rounding=0.05",
        )
    });
    assert_eq!(eight, many);
    // and is that of uniform rock that is as hard: constants are rounded to single precision
    let [erodibility, repose] = [5e-6, 40.0].map(|value| Field::constant(*height.window(), value));
    let fields = [("height", &height), ("erodibility", &erodibility), ("repose", &repose)];
    let changes = "duration=5e5,variation_size=8e3,variation=0.5,repose_variation=0,headwater_area=1e5,rounding=0.05";
    let params = testing::with_params(&NODE, &format!("{RIVERS},{PLAIN},{changes}"));
    let uniform = testing::run(&NODE, &params, &fields, "height");
    let rock = layers(&height, 900.0, &[(100.0, 2.0, 40.0)]);
    for (found, expected) in heights(&height, &rock, changes).iter().zip(uniform.samples()) {
        assert!((found - expected).abs() < 1e-2, "{found} {expected}");
    }
}

/// Rock that nothing erodes keeps its layers at the surface while it rises.
#[test]
fn layers_rise_with_the_land() {
    let height = testing::field(testing::world(40, 40, 50.0), |x, y| 300.0 * white(x, y));
    let [uplift, erodibility] = [0.002, 0.0].map(|value| Field::constant(*height.window(), value));
    let offset = testing::field(height.window().world, |x, _| 0.1 * x);
    let rock = testing::strata(offset, 300.0, &[(50.0, 1.0, 89.0); 6]);
    let fields = [("height", &height), ("uplift", &uplift), ("erodibility", &erodibility)];
    // the levels of a world that has none are on other cells, where sides are clamped: within a cell of the slope of
    // 0.1
    for (schedule, tolerance) in [("full", 1e-2), ("coarse_to_fine", 5.0)] {
        let changes = format!("schedule={schedule},duration=1e6,rounding=0,repose_variation=0");
        let params = testing::with_params(&NODE, &changes);
        let mut found = testing::outputs_in_rock(&rock, &NODE, &params, &fields).expect("a result");
        let moved = found.take("strata").expect("an output");
        let offsets = moved.as_strata().expect("strata").offset();
        for (after, before) in offsets.samples().iter().zip(rock.offset().samples()) {
            assert!((after - before - 2000.0).abs() < tolerance, "{schedule}: {after} {before}");
        }
    }
}

/// Hard layers stand as cliffs and soft ones as slopes: each layer keeps to its own steepest slope.
#[test]
fn layers_stand_at_their_own_slopes() {
    let height = testing::field(testing::world(200, 40, 10.0), |x, _| if x < 1000.0 { 300.0 } else { 0.0 });
    let rock = layers(&height, 300.0, &[(100.0, 1.0, 60.0), (100.0, 1.0, 25.0), (100.0, 1.0, 45.0)]);
    let fields = [("height", &height)];
    let changes = "schedule=full,duration=2e5,time_step=2e3,winding=0,variation=0,repose_variation=0,rounding=0,\
                   receivers=d8,headwater_area=0,critical_area=1e9,valley_width=0";
    let params = testing::with_params(&NODE, changes);
    let mut found = testing::outputs_in_rock(&rock, &NODE, &params, &fields).expect("a result");
    let found = found.take("height").expect("an output").as_field().expect("a field").samples().to_vec();
    let row = &found[20 * 200..21 * 200];
    for (degrees, [low, high]) in [(60.0_f64, [210.0, 290.0]), (25.0, [115.0, 190.0]), (45.0, [15.0, 90.0])] {
        let slopes = row.windows(2).filter(|pair| pair.iter().all(|h| (low..high).contains(h)));
        let steepest = slopes.map(|pair| (pair[0] - pair[1]) / 10.0).fold(0.0, f32::max);
        let allowed = math::tan(degrees.to_radians()) as f32;
        assert!(steepest <= 1.01 * allowed, "{degrees}: {steepest}");
    }
}

#[test]
fn the_analytical_method_refuses_layers() {
    let height = strip(10, |x| 0.01 * x);
    let rock = layers(&height, 0.0, &[(10.0, 1.0, 38.0)]);
    let params = testing::with_params(&NODE, "method=analytical");
    let refused = testing::outputs_in_rock(&rock, &NODE, &params, &[("height", &height)]);
    assert!(refused.is_err_and(|error| error.to_string().contains("rock at depth")));
}
