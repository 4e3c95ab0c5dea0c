//! Tests of the shape of single craters and of fields.

use super::*;
use crate::{
    numerics::math,
    testing::{at_every_level, generate, world},
};

#[test]
fn one_crater_has_its_depth_its_rim_and_its_ejecta() {
    let land = generate(
        Window::whole(world(1024, 1024, 16.0)),
        &NODE,
        "pattern=one,diameter=4000,depth=0.2,irregularity=0,ejecta=0",
    );
    let at = |metres: usize| f64::from(land.samples()[512 * 1024 + 512 + metres / 16]);
    // the cell's centre is 11 m from the crater's, where the slope is 5e-4
    assert!((at(0) + 800.0).abs() < 0.1, "{}", at(0));
    let (_, rim) = land.range(0).expect("values");
    // the crest is a cusp with a slope of 0.96, and its top may lie between cells
    assert!((150.0..160.1).contains(&f64::from(rim)), "{rim}");
    let r = math::hypot(3000.0, 8.0);
    assert!((at(3000) - 160.0 * 8e9 / (r * r * r)).abs() < 0.02, "{}", at(3000));
    assert_eq!(at(6000), 0.0);
}

/// A crater of twice the transition diameter is fully complex: 2^−0.7 of the depth-to-diameter ratio of a simple
/// crater, a flat floor with a peak, and terraces that only rise outwards. At the transition it is simple.
#[test]
fn a_complex_crater_is_shallow_with_a_floor_a_peak_and_terraces() {
    let shape = Shape { depth: 0.16, rim: 0.04, transition_m: 10_000.0, irregularity: 0.0, ejecta: 0.0 };
    let (simple, complex) = (shape.of(10_000.0), shape.of(20_000.0));
    assert!(simple.even(0.0) == -0.16 && (simple.even(1.0) - 0.04).abs() < 1e-12);
    let floor = -0.16 * math::pow(2.0, -0.7);
    assert!((complex.even(0.0) - (floor + 0.02)).abs() < 1e-12);
    assert!((complex.even(0.3) - floor).abs() < 1e-12 && (complex.even(0.43) - floor).abs() < 1e-12);
    assert!((complex.even(1.0) - 0.04).abs() < 1e-12 && complex.even(1.1) < 0.04);
    let heights: Vec<f64> = (440..=1000).map(|k| complex.even(0.001 * f64::from(k))).collect();
    assert!(heights.windows(2).all(|pair| pair[1] > pair[0]));
    // Pike's depths in kilometres, 0.196 D^1.01 and 1.044 D^0.301, meet near 11 km; ours scale in the same way
    let pike = |d: f64| 1.044 * math::pow(d, 0.301);
    let depth = |d: f64| -shape.of(1000.0 * d).even(0.25) * d;
    assert!((depth(80.0) / depth(20.0) / (pike(80.0) / pike(20.0)) - 1.0).abs() < 0.01);
}

#[test]
fn each_octave_covers_its_share_and_large_craters_are_rare() {
    let octave = Octave { largest_m: 1.0, smallest_m: 0.0, chance: 0.3 / SHARE, wear: 0.0, seed: 3 };
    let craters: Vec<Crater> = (0..300)
        .flat_map(|line| (0..300).map(move |column| (column, line)))
        .filter_map(|(c, l)| octave.crater(c, l))
        .collect();
    let area: f64 = craters.iter().map(|c| std::f64::consts::PI * c.radius_m * c.radius_m).sum();
    // 75 000 craters
    assert!((area / 90_000.0 / 0.3 - 1.0).abs() < 0.01, "{}", area / 90_000.0);
    // N(> 0.7) / N(> 0.5) = (0.7⁻² − 1) / (0.5⁻² − 1)
    let large = craters.iter().filter(|c| c.radius_m > 0.35).count() as f64 / craters.len() as f64;
    assert!((large - (1.0 / 0.49 - 1.0) / 3.0).abs() < 0.01, "{large}");
}

#[test]
fn a_window_has_the_craters_of_the_whole() {
    let whole = Window::whole(world(131, 97, 120.0));
    let land = generate(whole, &NODE, "smallest=600");
    let part = Window { origin: [17, 31], cells: [83, 40], ..whole };
    assert_eq!(land.crop(&part), generate(part, &NODE, "smallest=600"));
    assert_ne!(land, generate(whole, &NODE, "smallest=600,seed=1"));
    assert!(land.range(0).is_some_and(|(low, high)| low < -100.0 && high > 10.0));
}

/// Heights around a circle of `radii` around the middle of a single crater of 6 km in a world of 16 km.
fn ring(land: &Field, radii: f64) -> Vec<f64> {
    let nx = land.window().nx();
    let at = |degrees: i32| {
        let angle = f64::from(degrees).to_radians();
        let cell = |metres: f64| (metres / land.window().cell_m()) as usize;
        let x = 8192.0 + 3000.0 * radii * math::sin(angle);
        let y = 8192.0 - 3000.0 * radii * math::cos(angle);
        f64::from(land.samples()[cell(y) * nx + cell(x)])
    };
    (0..360).map(at).collect()
}

fn mean_and_deviation(values: &[f64]) -> [f64; 2] {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    [mean, (values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / values.len() as f64).sqrt()]
}

/// Pike (1977): from rim to floor a fresh simple crater is a fifth of its diameter deep, also if it is uneven. Its rim
/// differs around the circle by some percent of the diameter, and ejecta are rough to three radii.
#[test]
fn an_uneven_crater_keeps_its_depth_and_is_not_round() {
    let window = Window::whole(world(512, 512, 32.0));
    let land = generate(window, &NODE, "pattern=one,diameter=6000");
    let even = generate(window, &NODE, "pattern=one,diameter=6000,irregularity=0,ejecta=0");
    let crest = |land: &Field| {
        let rings: Vec<Vec<f64>> = (88..=112).map(|k| ring(land, 0.01 * f64::from(k))).collect();
        (0..360).map(|at| rings.iter().map(|ring| ring[at]).fold(f64::MIN, f64::max)).collect::<Vec<f64>>()
    };
    let [rim, uneven] = mean_and_deviation(&crest(&land));
    let (floor, _) = land.range(0).expect("values");
    assert!(((rim - f64::from(floor)) / 6000.0 - 0.2).abs() < 0.02, "{rim} {floor}");
    assert!(uneven > 15.0 && mean_and_deviation(&crest(&even))[1] < 15.0, "{uneven}");
    for radii in [1.3, 1.7, 2.2] {
        let [mean, deviation] = mean_and_deviation(&ring(&land, radii));
        assert!(
            deviation > 0.15 * mean.abs() && mean_and_deviation(&ring(&even, radii))[1] < 4.0,
            "{radii} {deviation}"
        );
    }
}

/// Terraces of a complex crater are arcs: along a circle halfway up the wall heights differ by more than a tenth of
/// the depth, and its depth is still Pike's.
#[test]
fn terraces_end_and_the_floor_stays_level() {
    let window = Window::whole(world(512, 512, 32.0));
    let land = generate(window, &NODE, "pattern=one,diameter=6000,transition=3000");
    let depth = 0.16 * 6000.0 * math::pow(2.0, -0.7);
    let [floor, hills] = mean_and_deviation(&ring(&land, 0.35));
    assert!((floor + depth).abs() < 0.06 * depth && hills < 0.06 * depth, "{floor} {hills} {depth}");
    let wall = mean_and_deviation(&ring(&land, 0.75))[1];
    assert!(wall > 0.06 * depth, "{wall} {depth}");
    let peak = (0..15).flat_map(|k| ring(&land, 0.01 * f64::from(k))).fold(f64::MIN, f64::max) - floor;
    assert!((0.01..0.04).contains(&(peak / 6000.0)), "{peak}");
}

#[test]
fn all_instruction_sets_and_finer_cells_show_the_same_craters() {
    let part = Window { origin: [17, 31], cells: [83, 40], ..Window::whole(world(131, 97, 120.0)) };
    at_every_level(|| generate(part, &NODE, "smallest=600"));
    let land =
        |cells: u32| generate(Window::whole(world(cells, cells, 16_384.0 / f64::from(cells))), &NODE, "smallest=1500");
    let [coarse, fine] =
        [(land(256), 4), (land(1024), 16)].map(|(land, side)| crate::testing::block_means(&land, side));
    let apart = coarse.iter().zip(&fine).map(|(a, b)| f64::from((a - b) * (a - b))).sum::<f64>() / coarse.len() as f64;
    assert!(apart.sqrt() < 4.0, "{}", apart.sqrt());
}
