//! Tests of the cover: measured colours where one kind of ground is alone, weights, and the fractions of patches.

use super::{
    NODE,
    cover::{Cover, Ground},
    reflectance::{DEEP_WATER, Rock, SNOW},
};
use crate::{
    prelude::*,
    testing::{self, at_every_level, field, outputs, run, run_in, with_params, world},
};

fn cover(changes: &str) -> Cover {
    Cover::new(&super::Params::read(&with_params(&NODE, changes)), 10.0, 1)
}

const ROCK: [f32; 3] = Rock::Gneiss.reflectance();
/// Flat ground in the forest belt.
const LOW: Ground = Ground {
    height: 500.0,
    slope: 3.0,
    rock: ROCK,
    wear: 0.0,
    deposits: 0.0,
    area: 0.0,
    moisture: 0.0,
    exposed: 0.0,
    snow: 0.0,
    water: 0.0,
};

fn places() -> impl Iterator<Item = [f64; 2]> {
    (0..4000).map(|k| [131.0 * f64::from(k % 63), 173.0 * f64::from(k / 63)])
}

fn mean(cover: &Cover, ground: &Ground) -> [f64; 7] {
    let mut sum = [0.0; 7];
    for place in places() {
        for (sum, value) in sum.iter_mut().zip(cover.of(ground, place)) {
            *sum += f64::from(value) / 4000.0;
        }
    }
    sum
}

#[test]
fn one_kind_of_ground_alone_has_its_measured_colour() {
    let cover = cover("");
    let snow = cover.of(&Ground { snow: 1.0, ..LOW }, [0.0; 2]);
    assert!(snow[..3].iter().zip(SNOW).all(|(got, of)| (got - of).abs() < 1e-6), "{snow:?}"); // one rounding
    assert_eq!(snow[3..], [0.0, 0.0, 0.0, 1.0]);
    let sea = cover.of(&Ground { water: 500.0, ..LOW }, [0.0; 2]);
    assert!(sea[..3].iter().zip(DEEP_WATER).all(|(got, of)| (got - of).abs() < 1e-6), "{sea:?}");
    // walls: the rock, with changes of tone of a tenth
    let wall = mean(&cover, &Ground { slope: 60.0, height: 3500.0, ..LOW });
    for part in 0..3 {
        assert!((wall[part] / f64::from(ROCK[part]) - 1.0).abs() < 0.05, "{wall:?}");
    }
    assert!(wall[3] > 0.99);
    // worn ground is rock, debris covers it
    assert!(mean(&cover, &Ground { wear: 20.0, ..LOW })[3] > 0.5);
    assert!(mean(&cover, &Ground { slope: 60.0, height: 3500.0, deposits: 20.0, ..LOW })[4] > 0.8);
}

/// Through two metres of water: the law of Beer with the two-way path, over wet ground.
#[test]
fn water_absorbs_by_the_law_of_beer() {
    let cover = cover("");
    let of = |water| cover.of(&Ground { slope: 60.0, height: 3500.0, water, ..LOW }, [500.0; 2]).map(f64::from);
    let (dry, wet) = (of(0.0), of(2.0));
    for (part, per_m) in [0.39, 0.1065, 0.0592].into_iter().enumerate() {
        let deep = f64::from(DEEP_WATER[part]);
        let expected = deep + (0.55 * dry[part] - deep) * libm::exp(-4.0 * per_m);
        assert!((wet[part] - expected).abs() < 1e-5, "{part}: {} {expected}", wet[part]); // single precision
    }
}

#[test]
fn forest_covers_the_fraction_that_is_asked_for() {
    // trees alone have no straw: compare with the colours of meadow and forest
    let slope = Ground { slope: 18.0, ..LOW };
    let meadow = mean(&cover("forest=0,dryness=0"), &slope)[0];
    let wood = mean(&cover("forest=1,dryness=0"), &slope)[0];
    for asked in [0.25, 0.5, 0.75] {
        let red = mean(&cover(&format!("forest={asked},dryness=0")), &slope)[0];
        let found = (red - meadow) / (wood - meadow);
        // the edges of patches are soft, and the distribution of the noise is only nearly normal
        assert!((found - asked).abs() < 0.08, "{found} of {asked}");
    }
    // no trees above their line, no plants above the line of grass
    assert!(mean(&cover("forest=1"), &Ground { height: 3500.0, ..LOW })[5] < 0.01);
    assert!(mean(&cover("forest=1"), &slope)[5] > 0.9);
}

#[test]
fn weights_sum_to_one_and_nothing_is_nearly_black() {
    let land = field(world(60, 50, 40.0), |x, y| 1800.0 + 1500.0 * libm::sin(x / 300.0) * libm::cos(y / 400.0));
    let area = field(world(60, 50, 40.0), |x, _| 100.0 * libm::exp(x / 250.0));
    let snow = field(world(60, 50, 40.0), |_, y| (y / 2000.0).clamp(0.0, 1.0));
    let fields = [("height", &land), ("area", &area), ("snow", &snow), ("wear", &area)];
    for changes in ["", "dryness=1,forest=1", "dryness=1,forest=0,rock=schist", "rock=basalt,wear_depth=100"] {
        let params = with_params(&NODE, changes);
        let weights = run(&NODE, &params, &fields, "weights");
        let colour = run(&NODE, &params, &fields, "colour");
        for cell in 0..land.window().len() {
            let parts = [0, 1, 2, 3].map(|plane| weights.plane(plane)[cell]);
            assert!(parts.iter().all(|part| (0.0..=1.0).contains(part)), "{parts:?}");
            assert!((parts.iter().sum::<f32>() - 1.0).abs() < 1e-5, "{parts:?}"); // four roundings
            let [r, g, b] = [0, 1, 2].map(|plane| colour.plane(plane)[cell]);
            assert!(0.2126 * r + 0.7152 * g + 0.0722 * b > 0.04, "{r} {g} {b}");
        }
    }
}

#[test]
fn every_input_counts_and_one_output_alone_is_the_same() {
    let side = world(30, 20, 40.0);
    let land = field(side, |x, y| 900.0 + 0.4 * x + 80.0 * libm::sin(y / 90.0));
    let params = with_params(&NODE, "");
    let plain = run(&NODE, &params, &[("height", &land)], "colour");
    let some = field(side, |x, _| x / 1200.0);
    let thick = field(side, |x, _| x);
    let rock = Field::with_planes(Window::whole(side), 3, vec![0.5; 3 * 600]);
    for (name, other) in [
        ("wear", &thick),
        ("deposits", &thick),
        ("area", &field(side, |x, _| 1000.0 * x)),
        ("moisture", &some),
        ("exposed", &some),
        ("snow", &some),
        ("water", &thick),
        ("rock_colour", &rock),
    ] {
        assert!(run(&NODE, &params, &[("height", &land), (name, other)], "colour") != plain, "{name}");
    }
    let fields = [("height", &land), ("wear", &thick)];
    assert!(run_in(1, &NODE, &params, &fields) == run_in(5, &NODE, &params, &fields));
    at_every_level(|| outputs(&NODE, &params, &fields));
}

#[test]
fn ranges_that_fall_are_refused() {
    let land = field(world(4, 4, 10.0), |x, _| x);
    for changes in ["bare_from=50,bare_to=40", "tree_line=3000,grass_line=2000"] {
        let refused = outputs(&NODE, &with_params(&NODE, changes), &[("height", &land)]);
        assert!(matches!(refused, Err(NodeError::Failed { hint: Some(_), .. })), "{changes}");
    }
}

/// Below the level of the world's sea lies water, as deep as a wired one of that depth; above it nothing changes.
#[test]
fn the_sea_is_drawn_as_deep_as_it_is() {
    let land = field(world(64, 8, 10.0), |x, _| 0.1 * x - 30.0);
    let depth = field(world(64, 8, 10.0), |x, _| (30.0 - 0.1 * x).max(0.0));
    let sea = testing::at_sea(&land, 0.0);
    let wired = outputs(&NODE, &with_params(&NODE, ""), &[("height", &land), ("water", &depth)]).expect("a cover");
    let found = outputs(&NODE, &with_params(&NODE, ""), &[("height", &sea)]).expect("a cover");
    let without = outputs(&NODE, &with_params(&NODE, "with_sea=false"), &[("height", &sea)]).expect("a cover");
    let dry = outputs(&NODE, &with_params(&NODE, ""), &[("height", &land)]).expect("a cover");
    let [mut wired, mut found, mut without, mut dry] = [wired, found, without, dry];
    for name in ["colour", "weights"] {
        let samples = |outputs: &mut Outputs| {
            outputs.take(name).and_then(|value| value.as_field().cloned()).expect("a field").samples().to_vec()
        };
        let (wired, found) = (samples(&mut wired), samples(&mut found));
        // depths that differ by a rounding of single precision
        assert!(wired.iter().zip(&found).all(|(a, b)| (a - b).abs() < 1e-5), "{name}");
        let (without, dry) = (samples(&mut without), samples(&mut dry));
        assert!(without == dry && found != dry, "{name}");
        if name == "weights" {
            // 30 m deep: soil alone
            assert_eq!([0, 1, 2, 3].map(|plane| found[plane * 64 * 8]), [0.0, 1.0, 0.0, 0.0]);
        }
        // the last cells lie above the level
        assert_eq!(found[40..64], dry[40..64], "{name}");
    }
}
