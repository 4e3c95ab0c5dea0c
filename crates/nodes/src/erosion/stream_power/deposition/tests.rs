//! Tests of erosion and deposition: steady states in closed form, filled water, and the limits of the law.

use crate::{
    erosion::stream_power::tests::{PLAIN, largest_relative_error, outputs, samples, steady, strip, white},
    prelude::*,
    testing,
};

/// Results for even uplift, erodibility and deposition; nothing slides.
fn run(height: &Field, changes: &str, uplift: f32, erodibility: f32, deposition: f32) -> Outputs {
    let [uplift, erodibility, deposition, repose] =
        [uplift, erodibility, deposition, 90.0].map(|value| Field::constant(*height.window(), value));
    let mut fields = vec![("height", height), ("uplift", &uplift), ("erodibility", &erodibility), ("repose", &repose)];
    if deposition.samples()[0] > 0.0 {
        fields.push(("deposition", &deposition));
    }
    outputs(&format!("{PLAIN},{changes}"), &fields).expect("a result")
}

/// Rock that is gone from under sediment is eroded too.
#[test]
fn what_is_eroded_is_what_is_missing_below_the_sediment() {
    let height = testing::field(testing::world(60, 60, 100.0), |x, y| 0.05 * x + 120.0 * white(x, y));
    // a rising half that feeds a sinking one
    let uplift = testing::field(testing::world(60, 60, 100.0), |x, _| if x > 3000.0 { 0.001 } else { -0.0003 });
    let [deposition, erodibility] = [1.0, 1e-5].map(|value| Field::constant(*height.window(), value));
    let fields = [("height", &height), ("uplift", &uplift), ("deposition", &deposition), ("erodibility", &erodibility)];
    let mut found = outputs("duration=1e6", &fields).expect("a result");
    let [after, erosion, sediment] = ["height", "erosion", "sediment"].map(|name| samples(&mut found, name));
    let mut buried = 0;
    for y in 1..59 {
        for cell in y * 60 + 1..y * 60 + 59 {
            let missing = height.samples()[cell] + uplift.samples()[cell] * 1e6 - after[cell];
            // 5e-2 m: sediment is added up in single precision over a hundred steps
            assert!((erosion[cell] - (missing + sediment[cell]).max(0.0)).abs() < 5e-2, "{cell}");
            buried += usize::from(sediment[cell] > 0.5 && erosion[cell] > missing + 0.5);
        }
    }
    assert!(buried > 20, "{buried}");
}

/// At steady state Q = U A, so that slopes are those of the plain law with K / (1 + G): 1 / K = 1 / K_d + 1 / K_t.
#[test]
fn steady_slopes_are_those_of_both_coefficients() {
    let height = strip(100, |x| 500.0 * white(x, 0.5));
    for (erodibility, deposition) in [(1.5e-5, 0.5), (2e-5, 1.0), (4e-5, 3.0), (1.001e-2, 1000.0)] {
        for step_yr in [1e5, 4e6] {
            let changes = format!("duration=8e7,time_step={step_yr}");
            let mut found = run(&height, &changes, 0.001, erodibility, deposition);
            // 1e-6: constants and heights are f32.
            let error = largest_relative_error(&samples(&mut found, "height"), &steady(100, 100.0, 0.5));
            assert!(error < 1e-6, "G {deposition}, step {step_yr}: {error}");
            // All that rises above it leaves through a cell.
            for (cell, flux) in samples(&mut found, "sediment_flux")[..100].iter().enumerate() {
                let expected = 0.001 * 1e4 * (cell + 1) as f32;
                assert!((flux / expected - 1.0).abs() < 1e-5, "{cell}: {flux} {expected}");
            }
        }
    }
}

#[test]
fn relief_is_that_of_both_coefficients() {
    let height = testing::field(testing::world(64, 64, 100.0), white);
    let mean = |erodibility: f32, deposition: f32| {
        let heights =
            samples(&mut run(&height, "duration=2e7,time_step=5e4", 0.001, erodibility, deposition), "height");
        heights.iter().sum::<f32>() / heights.len() as f32
    };
    let (plain, both) = (mean(1e-5, 0.0), mean(2e-5, 1.0));
    // 3 %: other networks formed on the way.
    assert!((both / plain - 1.0).abs() < 0.03, "{plain} {both}");
}

#[test]
fn a_map_of_no_deposition_is_the_plain_law() {
    // Too steep for lakes.
    let height = testing::field(testing::world(50, 150, 100.0), |x, y| 0.5 * x + 10.0 * white(x, y));
    let changes = "duration=1e5,time_step=1e5";
    let plain = samples(&mut run(&height, changes, 0.001, 1e-5, 0.0), "height");
    let none = testing::field(height.window().world, |x, _| if x < 1000.0 { 0.0 } else { -1.0 });
    let [uplift, erodibility, repose] = [0.001, 1e-5, 90.0].map(|value| Field::constant(*height.window(), value));
    let fields = [
        ("height", &height),
        ("uplift", &uplift),
        ("erodibility", &erodibility),
        ("deposition", &none),
        ("repose", &repose),
    ];
    let mapped = samples(&mut outputs(&format!("{PLAIN},{changes}"), &fields).expect("a result"), "height");
    for (cell, (plain, mapped)) in plain.iter().zip(&mapped).enumerate() {
        // 1e-3 m: heights are f32.
        assert!((plain - mapped).abs() < 1e-3, "{cell}: {plain} {mapped}");
    }
}

/// A hillside above a lake of known volume behind a bar.
fn lake() -> Field {
    strip(60, |x| match (x / 100.0) as usize {
        cell @ 0..20 => 200.0 - 5.0 * cell as f64,
        20..40 => 80.0,
        _ => 100.0 - 0.001 * (x - 4000.0),
    })
}

/// The lake after a time, and what was carried at its end; the bar is not eroded.
fn fill_lake(duration_yr: f64) -> (Field, Vec<f32>, Vec<f32>) {
    let height = lake();
    let erodibility = testing::field(height.window().world, |x, _| if x < 4000.0 { 1e-5 } else { 0.0 });
    let [deposition, repose] = [0.1, 90.0].map(|value| Field::constant(*height.window(), value));
    let fields = [("height", &height), ("erodibility", &erodibility), ("deposition", &deposition), ("repose", &repose)];
    let changes = format!("{PLAIN},duration={duration_yr},time_step={duration_yr}");
    let mut found = outputs(&changes, &fields).expect("a result");
    (height, samples(&mut found, "height"), samples(&mut found, "sediment_flux"))
}

#[test]
fn a_lake_keeps_what_it_can_hold() {
    let (height, after, flux) = fill_lake(2e3);
    let change = |cells: std::ops::Range<usize>| -> f64 {
        cells.map(|cell| f64::from(after[cell]) - f64::from(height.samples()[cell])).sum()
    };
    // 1e-3 m: heights are f32.
    assert!(change(0..20) < -1.0 && (change(0..20) + change(20..40)).abs() < 1e-3, "{}", change(0..20));
    assert!((change(0..20) + f64::from(flux[19]) * 2e3 / 1e4).abs() < 1e-3);
    assert!(flux[39] == 0.0 && after[20] > 80.0);
    // No higher than the bar, and the thinner the farther from the shore.
    assert!(after[20..40].iter().all(|&after| after <= height.samples()[40]));
    assert!(after[20..40].windows(2).all(|pair| pair[0] >= pair[1]) && after[39] < 80.0 + 0.1 * (after[20] - 80.0));
}

#[test]
fn a_full_lake_passes_on_the_rest() {
    let (height, after, flux) = fill_lake(5e5);
    let level = height.samples()[40];
    for height in &after[20..40] {
        assert!((height - level).abs() < 1e-4, "{height}");
    }
    assert!(flux[19] > flux[39] && flux[39] > 0.0);
    let filled_m3_yr = 20.0 * (level - 80.0) * 1e4 / 5e5;
    assert!((flux[19] - flux[39] - filled_m3_yr).abs() < 1e-3 * filled_m3_yr, "{} {}", flux[19], flux[39]);
}

#[test]
fn a_delta_grows_to_the_level_of_the_sea() {
    let height = testing::at_sea(&strip(100, |x| 150.0 - 0.02 * x), 50.0);
    let changes = "duration=2e4,time_step=1e3";
    let mut found = run(&height, changes, 0.0, 1e-5, 0.5);
    let (after, sediment) = (samples(&mut found, "height"), samples(&mut found, "sediment"));
    let shore = height.samples().iter().position(|&height| height < 50.0).expect("a shore");
    assert!(after[shore] >= 50.0 && sediment[shore] > 0.0, "{}", after[shore]);
    // ten times as far as the sediment of a step spreads
    assert!(sediment[99] < 1e-3 * sediment[shore], "{} {}", sediment[99], sediment[shore]);
    for (after, before) in after[shore..].iter().zip(&height.samples()[shore..]) {
        assert!(after >= before, "the sea's floor is not eroded");
    }
    // Without deposition the floor of the sea stays, and rivers end at the shore.
    let plain = samples(&mut run(&height, changes, 0.0, 1e-5, 0.0), "height");
    assert!(plain[shore..] == height.samples()[shore..] && plain[..shore].iter().all(|&height| height >= 50.0));
}

/// A river out of a valley builds a delta on a level floor of the sea that is round and smooth: no streaks, no ponds.
#[test]
fn a_delta_is_round() {
    let world = testing::world(81, 81, 100.0);
    let coast =
        testing::field(
            world,
            |x, y| {
                if x < 2500.0 { 10.0 + 0.04 * (2500.0 - x) + 0.2 * (y - 4050.0).abs() } else { -60.0 }
            },
        );
    let height = testing::at_sea(&coast, 0.0);
    let mut found = run(&height, "duration=3e5,time_step=1e4", 0.0, 2e-5, 0.5);
    let sediment = samples(&mut found, "sediment");
    let at = |x: usize, y: usize| sediment[y * 81 + x];
    // around the mouth, at a distance of a kilometre: straight out to sea, and 45° to both sides
    let [ahead, left, right] = [at(35, 40), at(32, 33), at(32, 47)];
    assert!(ahead > 1.0, "{ahead}");
    for side in [left, right] {
        assert!((side / ahead - 1.0).abs() < 0.3, "{ahead} {side}");
    }
    let under_water = |x: usize, y: usize| at(x, y) < 59.0;
    for (x, y) in (27..79).flat_map(|x| (2..79).map(move |y| (x, y))) {
        let beside = [(x - 1, y), (x + 1, y), (x, y - 1), (x, y + 1)];
        if under_water(x, y) && beside.iter().all(|&(x, y)| under_water(x, y)) {
            let mean = beside.iter().map(|&(x, y)| at(x, y)).sum::<f32>() / 4.0;
            assert!((at(x, y) - mean).abs() < 1.0 + 0.1 * mean, "{x} {y}: {} {mean}", at(x, y));
        }
    }
}

#[test]
fn extreme_inputs_give_heights() {
    for (nx, ny) in [(1, 1), (1, 20), (20, 1), (2, 3), (33, 70)] {
        let rough = testing::field(testing::world(nx, ny, 10.0), |x, y| 500.0 * white(x, y));
        for (uplift, erodibility, deposition) in
            [(0.001, 1e3, 1e3), (-1.0, 1e-30, 1e3), (1.0, 0.0, 0.5), (0.0, 1e3, 1e-30)]
        {
            for (changes, sea_m) in [("m=2,receivers=rho_infinity", -1.0), ("m=0", 250.0)] {
                let changes = format!("{changes},duration=1e9,time_step=1e8");
                let rough = testing::at_sea(&rough, sea_m);
                for output in ["height", "sediment", "sediment_flux"] {
                    let found = samples(&mut run(&rough, &changes, uplift, erodibility, deposition), output);
                    assert!(found.iter().all(|value| value.is_finite()), "{changes}: {output}");
                }
            }
        }
    }
}

#[test]
fn without_water_all_settles() {
    let height = strip(40, |x| 100.0 - 0.01 * x);
    let dry = Field::constant(*height.window(), 0.0);
    let deposition = Field::constant(*height.window(), 0.5);
    let mut found =
        outputs("duration=1e5", &[("height", &height), ("rain", &dry), ("deposition", &deposition)]).expect("a result");
    assert!(samples(&mut found, "sediment_flux").iter().all(|&flux| flux < 1e-6));
}

/// At steady state Q = U A for every exponent: K Aᵐ Sⁿ = U (1 + G).
#[test]
fn steady_slopes_follow_every_exponent() {
    let height = strip(100, |x| 500.0 * white(x, 0.5));
    for (erodibility, m, n) in [(1e-7, 1.0, 2.0), (1e-6, 0.75, 1.5), (1e-4, 0.25, 0.5)] {
        for deposition in [0.5, 3.0] {
            let changes = format!("duration=8e7,time_step=2e5,m={m},n={n}");
            let mut found = run(&height, &changes, 0.001, erodibility * (1.0 + deposition), deposition);
            // 1e-6: constants and heights are f32; the rounds of a step end at 1e-4 m, but start from the last step's.
            let error = largest_relative_error(&samples(&mut found, "height"), &steady(100, 100.0, 0.5));
            assert!(error < 1e-6, "n {n}, G {deposition}: {error}");
        }
    }
}

#[test]
fn relief_is_that_of_both_coefficients_for_other_exponents() {
    let height = testing::field(testing::world(48, 48, 100.0), white);
    for n in [0.8, 1.5] {
        let mean = |erodibility: f32, deposition: f32| {
            let changes = format!("duration=2e7,time_step=1e5,n={n}");
            let heights = samples(&mut run(&height, &changes, 0.001, erodibility, deposition), "height");
            heights.iter().sum::<f32>() / heights.len() as f32
        };
        let (plain, both) = (mean(1e-5, 0.0), mean(2e-5, 1.0));
        // 3 %: other networks formed on the way.
        assert!((both / plain - 1.0).abs() < 0.03, "n {n}: {plain} {both}");
    }
}
