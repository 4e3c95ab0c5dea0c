//! Tests of shaded relief: Lambert's law, shadows and sky, water, windows, extreme terrain.

use super::*;
use crate::testing::{self, at_every_level, field, run, run_in, with_params, world};

fn hills() -> Field {
    field(world(300, 40, 25.0), |x, y| 900.0 * libm::sin(x / 700.0) * libm::cos(y / 300.0) + 200.0)
}

/// The cosine between normal and sun, on planes of known orientation.
#[test]
fn planes_reflect_by_lamberts_law() {
    let params = with_params(&NODE, "light=single, azimuth=315, altitude=30");
    let shade_of = |east: f64, south: f64| {
        let height = field(world(6, 6, 10.0), |x, y| east * x + south * y);
        run(&NODE, &params, &[("height", &height)], "shade").samples()[14]
    };
    assert!((shade_of(0.0, 0.0) - 0.5).abs() < 1e-6);
    // falls to the north-west at 60°: perpendicular to the sun's rays
    let t = 3.0_f64.sqrt() * 0.5_f64.sqrt();
    assert!((shade_of(t, t) - 1.0).abs() < 1e-6);
    // falls to the south-east at 60°: in shade
    assert_eq!(shade_of(-t, -t), 0.0);
}

#[test]
fn level_ground_is_the_sine_of_the_altitude_in_every_light() {
    let flat = field(world(5, 5, 10.0), |_, _| 120.0);
    for light in ["single", "oblique", "blend"] {
        let params = with_params(&NODE, &format!("light={light}, altitude=30"));
        let shade = run(&NODE, &params, &[("height", &flat)], "shade");
        assert!(shade.samples().iter().all(|s| (s - 0.5).abs() < 1e-6), "{light}");
    }
}

/// On a steep slope facing away from the sun, a single sun leaves everything black, and four suns show the gullies.
#[test]
fn oblique_light_shows_forms_in_the_shade() {
    // falls to the south-east at 1.4 m/m, with gullies down the slope
    let slope = field(world(64, 64, 10.0), |x, y| 4.0 * libm::sin((x - y) / 30.0) - x - y);
    let contrast = |light: &str| {
        let params = with_params(&NODE, &format!("light={light}"));
        let (low, high) = run(&NODE, &params, &[("height", &slope)], "shade").range(0).expect("values");
        high - low
    };
    assert_eq!(contrast("single"), 0.0);
    assert!(contrast("oblique") > 0.02, "{}", contrast("oblique"));
}

#[test]
fn wet_cells_are_drawn_as_level_water() {
    let height = hills();
    let wet = field(world(300, 40, 25.0), |x, _| if x < 2500.0 { 0.0 } else { f64::from(x > 5000.0) * 0.5 + 0.5 });
    let params = ParamValues::defaults(&NODE.specs());
    let dry = run(&NODE, &params, &[("height", &height)], "colour");
    let drawn = run(&NODE, &params, &[("height", &height), ("wet", &wet)], "colour");
    let level = field(world(1, 1, 25.0), |_, _| 0.0);
    let water = run(&NODE, &params, &[("height", &level), ("wet", &Field::constant(*level.window(), 1.0))], "colour");
    for plane in 0..3 {
        for ((drawn, dry), wet) in drawn.plane(plane).iter().zip(dry.plane(plane)).zip(wet.samples()) {
            let expected = dry + (water.plane(plane)[0] - dry) * wet;
            assert!((drawn - expected).abs() < 1e-6, "{drawn}, not {expected}");
        }
    }
}

/// Everything below the world's sea level is blue; nothing is if the world has no sea.
#[test]
fn only_a_sea_is_drawn_as_water() {
    let plain = field(world(40, 4, 25.0), |x, _| x - 500.0);
    let blue = |height: &Field, changes: &str| -> Vec<bool> {
        let colour = run(&NODE, &with_params(&NODE, changes), &[("height", height)], "colour");
        colour.plane(2).iter().zip(colour.plane(0)).map(|(blue, red)| blue > red).collect()
    };
    assert!(blue(&plain, "").iter().all(|blue| !blue), "no sea");
    for level in [-200.0, 0.0, 100.0] {
        let below: Vec<bool> = plain.samples().iter().map(|&height| f64::from(height) < level).collect();
        assert_eq!(blue(&testing::at_sea(&plain, level), ""), below, "{level}");
    }
    assert!(blue(&testing::at_sea(&plain, 0.0), "water=false").iter().all(|blue| !blue));
    let sea = testing::at_sea(&plain, 0.0);
    assert_eq!((Params::fitted(&plain).low, Params::fitted(&sea).low), (-487.5, 0.0));
}

#[test]
fn windows_threads_and_simd_levels_give_the_same_bits() {
    let height = hills();
    let params = with_params(&NODE, "distance=150");
    let inputs = [("height", &height)];
    let one = run_in(1, &NODE, &params, &inputs);
    assert_eq!(one, run_in(4, &NODE, &params, &inputs));
    at_every_level(|| run_in(2, &NODE, &params, &inputs));
    let part = Window { origin: [30, 11], cells: [260, 20], ..*height.window() };
    for output in ["shade", "colour"] {
        let whole = run(&NODE, &params, &inputs, output);
        let grown = part.grown(testing::reach_m(&NODE, &params, 25.0));
        let grown = run(&NODE, &params, &[("height", &height.crop(&grown))], output);
        assert!(grown.crop(&part) == whole.crop(&part), "{output}");
    }
    let plain = ParamValues::defaults(&NODE.specs());
    assert!(relief(&height, &Params::default())[1] == run(&NODE, &plain, &inputs, "colour"));
}

#[test]
fn colours_stay_within_range_on_any_land() {
    let cliff = field(world(4, 4, 1e-3), |x, _| if x > 2e-3 { 1e9 } else { -1e9 });
    for height in [cliff, field(world(1, 7, 1.0), |_, y| y), field(world(3, 1, 1.0), |_, _| 0.0), hills()] {
        for changes in ["light=oblique, exaggeration=1000, altitude=1", "exaggeration=0", "tints=false, azimuth=360"] {
            let params = with_params(&NODE, changes);
            for output in ["shade", "colour"] {
                let field = run(&NODE, &params, &[("height", &height)], output);
                assert!(field.samples().iter().all(|v| (0.0..=1.0).contains(v)), "{changes}");
            }
        }
        let fitted = Params::fitted(&height);
        assert!(fitted.low <= fitted.high && fitted.exaggeration >= 1.0);
    }
}

/// Gentle ground is exaggerated until it is visible, but not where a small part of it is steep.
#[test]
fn exaggeration_is_limited_by_the_steepest_ground() {
    let gentle = field(world(100, 100, 10.0), |x, _| 0.01 * x);
    assert!((Params::fitted(&gentle).exaggeration - 30.0).abs() < 0.01);
    // one row in a hundred is as steep as the lee of a dune
    let dune = field(world(100, 100, 10.0), |x, y| 0.01 * x + if y > 505.0 { 12.0 } else { 0.0 });
    let exaggeration = Params::fitted(&dune).exaggeration;
    assert!((1.0..2.0).contains(&exaggeration), "{exaggeration}");
}

/// A cliff of 100 m casts a shadow of 100 m / tan(altitude) on the plain below it.
#[test]
fn a_cliff_casts_a_shadow_of_its_height_over_the_tangent_of_the_sun() {
    for altitude in [20.0_f64, 30.0, 45.0] {
        // the sun is in the west
        let cliff = field(world(200, 9, 5.0), |x, _| if x < 510.0 { 100.0 } else { 0.0 });
        let shade = |shadows: f64| {
            let changes = format!("light=single,azimuth=270,altitude={altitude},shadows={shadows}");
            run(&NODE, &with_params(&NODE, &changes), &[("height", &cliff)], "shade")
        };
        let (open, cast) = (shade(0.0), shade(1.0));
        let row = 4 * 200;
        let end = (0..200).rfind(|&i| cast.samples()[row + i] < 0.5 * open.samples()[row + i]).expect("a shadow");
        let length = 5.0 * (end as f64 + 1.0) - 510.0;
        // cells of 5 m, and cliffs that are up to 8 % low from a distance
        let expected = 100.0 / libm::tan(altitude.to_radians());
        assert!((length - expected).abs() < 0.08 * expected + 5.0, "{altitude}°: {length} m, not {expected} m");
        assert_eq!(cast.samples()[row + (102 + end) / 2], 0.0);
    }
}

/// At the bottom of a long V-shaped valley with sides of 45°, the part of an even sky that is seen is that of the
/// closed form: the mean of cos² of the horizon's elevation, whose tangent is |sin| of the direction across the valley.
#[test]
fn a_valley_is_dimmer_by_the_sky_that_its_sides_hide() {
    let valley = field(world(401, 401, 5.0), |x, _| (x - 1002.5).abs());
    let colour = |shadows: f64| {
        let changes = format!("light=oblique,altitude=90,shadows={shadows},tints=false,distance=900");
        run(&NODE, &with_params(&NODE, &changes), &[("height", &valley)], "colour").plane(0)[200 * 401 + 200]
    };
    let seen = f64::from(colour(1.0) / colour(0.0));
    let expected: f64 = (0..12)
        .map(|k| {
            let across = libm::sin(f64::from(k) * std::f64::consts::TAU / 12.0);
            1.0 / (1.0 + across * across)
        })
        .sum::<f64>()
        / 12.0;
    // distant sides are smoothed
    assert!((seen - expected).abs() < 0.02, "{seen}, not {expected}");
}

/// The distance of shadows stays in its range, however large cells are.
#[test]
fn pictures_of_the_largest_worlds_have_light() {
    let height = field(world(16, 16, 3e6), |x, y| (x + y) * 1e-4);
    let light = Params::fitted(&height).casting(&height);
    assert_eq!(light.distance, 1e6);
    let [shade, _] = relief(&height, &light);
    assert!(shade.samples().iter().all(|v| (0.0..=1.0).contains(v)));
}
