//! Tests of creep in rising land: closed forms, and land that depends neither on steps nor on cells.

use orograph_graph::{Boundary, Edge, World};

use super::tests::{outputs, samples, white};
use crate::{prelude::*, testing};

/// Heights of one row between a divide in the west and a base cell in the east, which rises and creeps.
fn hill(cells: u32, cell_m: f64, uplift: f64, diffusivity: f64, changes: &str) -> Vec<f32> {
    let boundary = Boundary { east: Edge::Base, ..Boundary::all(Edge::Wall) };
    let height = testing::field(World { boundary, ..testing::world(cells, 1, cell_m) }, |_, _| 0.0);
    let [uplift, diffusivity, erodibility, repose] =
        [uplift, diffusivity, 0.0, 90.0].map(|value| Field::constant(*height.window(), value as f32));
    let fields = [
        ("height", &height),
        ("uplift", &uplift),
        ("diffusivity", &diffusivity),
        ("erodibility", &erodibility),
        ("repose", &repose),
    ];
    let mut found = outputs(&format!("schedule=full,critical_area=0,{changes}"), &fields).expect("a result");
    for rate in &samples(&mut found, "erosion_rate")[..cells as usize - 1] {
        assert!((f64::from(*rate) / f64::from(uplift.samples()[0]) - 1.0).abs() < 0.03, "steady: {rate}");
    }
    samples(&mut found, "height")
}

/// Where uplift and creep balance, h = U / (2 D) (L² − x²), whatever the step.
#[test]
fn a_steady_hill_is_a_parabola() {
    for step_yr in [2e3, 2e4, 2e5, 2e6] {
        let found = hill(41, 5.0, 1e-4, 0.02, &format!("duration=2e7,time_step={step_yr}"));
        for (cell, height) in found.iter().enumerate() {
            let (x, l) = ((cell as f64 + 0.5) * 5.0, 202.5);
            let expected = 1e-4 / 0.04 * (l * l - x * x);
            // of 102 m: single precision of the result, and the last step's rounding where it is long
            assert!((f64::from(*height) - expected).abs() < 2e-3, "{step_yr} {cell}: {height} {expected}");
        }
    }
}

/// Far from the divide, slopes that carry much are straight at the critical slope, and those that carry less have the
/// slope at which q = D S / (1 − (S / Sc)²) is what comes from above.
#[test]
fn steady_slopes_near_the_critical_one() {
    let found = hill(81, 5.0, 1e-4, 0.01, "duration=2e7,critical_slope=1.2,time_step=5e3");
    for cell in 0..80 {
        let slope = f64::from(found[cell] - found[cell + 1]) / 5.0;
        // q = U x, solved for S; a share of 0.95 of the square is the most.
        let carried = 1e-4 * 5.0 * (cell as f64 + 1.0) / 0.01;
        let critical = 1.2;
        let over = critical * critical / (2.0 * carried);
        let expected = (over * over + critical * critical).sqrt() - over;
        assert!(expected < 0.97 * critical);
        // 3 %: how far the last slow changes have come.
        assert!((slope / expected - 1.0).abs() < 0.03, "{cell}: {slope} {expected}");
    }
    assert!(f64::from(found[79] - found[80]) / 5.0 > 1.0);
}

/// Rivers take what creeps into them: with cells well below the critical area the mean height hardly depends on the
/// cells, nor on the steps.
#[test]
fn creeping_relief_does_not_depend_on_cells_or_steps() {
    let mean = |cells: u32, step_yr: f64, diffusivity: f64| {
        let world = testing::world(cells, cells, 3200.0 / f64::from(cells));
        let height = testing::field(world, |x, y| 20.0 * white((x / 200.0).floor(), (y / 200.0).floor()));
        let [uplift, diffusivity, erodibility] =
            [1e-4, diffusivity, 2e-6].map(|value| Field::constant(*height.window(), value as f32));
        let fields =
            [("height", &height), ("uplift", &uplift), ("diffusivity", &diffusivity), ("erodibility", &erodibility)];
        let changes = format!("schedule=full,duration=6e6,critical_area=40000,time_step={step_yr}");
        let heights = samples(&mut outputs(&changes, &fields).expect("a result"), "height");
        heights.iter().sum::<f32>() / heights.len() as f32
    };
    let (coarse, fine, slow) = (mean(64, 6e4, 0.05), mean(128, 6e4, 0.05), mean(64, 2e4, 0.05));
    // 12 %: the networks differ, and smooth hollows of many cells gather less water in one.
    assert!((fine / coarse - 1.0).abs() < 0.12, "{coarse} {fine}");
    // 3 %: the networks differ.
    assert!((slow / coarse - 1.0).abs() < 0.03, "{coarse} {slow}");
}
