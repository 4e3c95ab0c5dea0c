//! Tests of even and uneven steps.

use orograph_graph::ParamValue;

use super::*;
use crate::testing::{at_every_level, field, outputs, run as result, run_in, with_params, world};

#[test]
fn treads_and_middles_of_risers_stay_and_order_is_kept() {
    let slope = field(world(801, 1, 1.0), |x, _| (x - 0.5) * 0.5 - 100.0); // −100 to 300 m
    let cut = result(
        &NODE,
        &with_params(&NODE, "step=50,sharpness=4,variation=0,edges=0,talus=0"),
        &[("height", &slope)],
        "height",
    );
    assert!(cut.samples().is_sorted());
    for (before, after) in slope.samples().iter().zip(cut.samples()) {
        if (before / 25.0).fract() == 0.0 {
            assert!((before - after).abs() < 1e-3, "{before} {after}"); // rounding of the power
        }
        assert!((before - after).abs() < 25.0);
    }
    // a quarter of a step up: ½ (½)⁴ of it
    assert!((cut.samples()[225] - 50.0 / 32.0).abs() < 1e-3, "{}", cut.samples()[225]);
}

#[test]
fn nothing_changes_at_sharpness_one_or_without_a_mask() {
    let land = field(world(70, 9, 5.0), |x, y| 900.0 * libm::sin(x * y));
    assert_eq!(result(&NODE, &with_params(&NODE, "sharpness=1"), &[("height", &land)], "height"), land);
    let nowhere = field(world(70, 9, 5.0), |_, _| 0.0);
    assert_eq!(result(&NODE, &with_params(&NODE, ""), &[("height", &land), ("mask", &nowhere)], "height"), land);
}

/// Treads of a table are unchanged, as are the middle of each riser and all terrain beyond the table.
#[test]
fn layers_lie_where_the_table_says() {
    let slope = field(world(1601, 1, 1.0), |x, _| (x - 0.5) - 200.0); // −200 to 1400 m
    let table = [[0.0, 4.0], [100.0, 1.0], [300.0, 12.0], [700.0, 2.0], [800.0, 1.0]];
    let through = |table: &[[f64; 2]]| {
        let mut params = with_params(&NODE, "steps=layers,variation=0,edges=0,talus=0");
        params.set("layers", ParamValue::Curve(table.to_vec()));
        params
    };
    let cut = result(&NODE, &through(&table), &[("height", &slope)], "height");
    assert!(cut.samples().is_sorted());
    for (before, after) in slope.samples().iter().zip(cut.samples()) {
        if !(0.0..800.0).contains(before) || (100.0..300.0).contains(before) {
            assert_eq!(before, after);
        } else if [0.0, 50.0, 300.0, 500.0, 700.0, 750.0].contains(before) {
            assert!((before - after).abs() < 1e-3, "{before} {after}");
        }
    }
    assert!((cut.samples()[200 + 400] - 300.0 - 200.0 / 4096.0).abs() < 1e-3, "{}", cut.samples()[600]);
    at_every_level(|| result(&NODE, &through(&table), &[("height", &slope)], "height"));
    let even = [[-10.0, 1.0], [2000.0, 1.0]];
    assert_eq!(result(&NODE, &through(&even), &[("height", &slope)], "height"), slope);
    let wrong = outputs(&NODE, &through(&[[0.0, 0.5], [9.0, 1.0]]), &[("height", &slope)]);
    assert!(wrong.expect_err("too soft").to_string().contains("sharpness of 0.5"));
}

#[test]
fn a_wired_base_is_a_base() {
    let land = field(world(300, 5, 5.0), |x, y| x + 3.0 * y);
    let level = field(world(300, 5, 5.0), |_, _| 30.0);
    let fixed = field(world(300, 5, 5.0), |x, y| x + 3.0 * y - 30.0);
    let params = with_params(&NODE, "step=64,variation=0,edges=0,talus=0");
    let wired = result(&NODE, &params, &[("height", &land), ("base", &level)], "height");
    let moved = result(&NODE, &params, &[("height", &fixed)], "height");
    assert!(wired.samples().iter().zip(moved.samples()).all(|(a, b)| (a - b - 30.0).abs() < 1e-3));
    at_every_level(|| run_in(2, &NODE, &params, &[("height", &land), ("base", &level)]));
}

/// A slope of 20 m/km in both directions under uneven steps of 40 m.
fn stepped(cells: u32, changes: &str) -> Field {
    let slope = field(world(cells, cells, 8192.0 / f64::from(cells)), |x, y| 0.06 * x + 0.03 * y);
    result(&NODE, &with_params(&NODE, &format!("step=40,sharpness=6,{changes}")), &[("height", &slope)], "height")
}

/// Returns the heights of benches: maxima of the histogram of heights in bins of 2 m, among cells with a slope below
/// half of the terrain's.
fn benches(land: &Field) -> Vec<f64> {
    let (nx, cell_m) = (land.window().nx(), land.window().cell_m());
    let mut bins = vec![0_u32; 400];
    for at in (0..land.samples().len() - nx).filter(|at| at % nx + 1 < nx) {
        let h = land.samples();
        let slope = f64::from(math::f32::hypot(h[at + 1] - h[at], h[at + nx] - h[at])) / cell_m;
        if slope < 0.03 && h[at] >= 0.0 {
            bins[(h[at] / 2.0) as usize] += 1;
        }
    }
    let wide = |k: usize| bins[k - 3..=k + 3].iter().sum::<u32>();
    let most = (5..380).map(wide).max().unwrap_or(0);
    let peak = |k: &usize| {
        let here = wide(*k);
        here > most / 4 && (k.max(&11) - 8..*k).all(|k| wide(k) < here) && (k + 1..k + 8).all(|k| wide(k) <= here)
    };
    (5..380).filter(peak).map(|k| 2.0 * k as f64).collect()
}

/// Benches of a staircase lie 40 m apart; with variation their spacing differs by at least a tenth of that, and its
/// mean stays. Heights leave the terrain by less than a step and a half.
#[test]
fn benches_have_their_own_heights() {
    let spacings = |changes: &str| {
        let benches = benches(&stepped(512, changes));
        benches.windows(2).map(|pair| pair[1] - pair[0]).collect::<Vec<f64>>()
    };
    let deviation = |values: &[f64]| {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        (mean, (values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / values.len() as f64).sqrt())
    };
    let (even, spread) = deviation(&spacings("variation=0,edges=0,talus=0"));
    assert!((even - 40.0).abs() < 2.5 && spread < 3.0, "{even} {spread}");
    let (mean, spread) = deviation(&spacings("variation=0.6,edges=0,talus=0"));
    assert!((30.0..75.0).contains(&mean) && spread > 4.0, "{mean} {spread}");
}

/// Along the course of a step, its riser is steep in some places and absent in others: the share of steep cells differs
/// from place to place. The edge is longer than the contour line.
#[test]
fn steps_are_absent_in_places_and_their_edges_are_broken() {
    let steep = |changes: &str| {
        let land = stepped(512, changes);
        let h = land.samples();
        let is_steep = |at: usize| (math::f32::hypot(h[at + 1] - h[at], h[at + 512] - h[at]) / 16.0) > 0.12;
        let shares: Vec<f64> = (0..49)
            .map(|tile| {
                let (x, y) = (tile % 7 * 72, tile / 7 * 72);
                let cells = (y..y + 72).flat_map(|j| (x..x + 72).map(move |i| j * 512 + i));
                cells.filter(|at| is_steep(*at)).count() as f64 / (72.0 * 72.0)
            })
            .collect();
        let mean = shares.iter().sum::<f64>() / 49.0;
        (mean, (shares.iter().map(|s| (s - mean) * (s - mean)).sum::<f64>() / 49.0).sqrt() / mean)
    };
    let (_, even) = steep("variation=0,edges=0,talus=0");
    let (share, uneven) = steep("variation=0.8,edges=0.6");
    assert!(uneven > 0.15 && uneven > 3.0 * even && share > 0.03, "{share} {uneven} {even}");
}

#[test]
fn uneven_steps_are_continuous_and_the_same_everywhere() {
    let land = stepped(512, "variation=1,edges=1,talus=1");
    // the steepest riser is some tens of times as steep as the terrain, but no wall of a whole step
    let h = land.samples();
    let most = (0..512 * 511).filter(|at| at % 512 < 511).map(|at| (h[at + 512] - h[at]).abs()).fold(0.0, f32::max);
    assert!(most < 20.0, "{most}");
    let [coarse, fine] =
        [(stepped(256, ""), 8), (stepped(1024, ""), 32)].map(|(land, side)| crate::testing::block_means(&land, side));
    let apart = coarse.iter().zip(&fine).map(|(a, b)| f64::from((a - b) * (a - b))).sum::<f64>() / coarse.len() as f64;
    assert!(apart.sqrt() < 2.0, "{}", apart.sqrt());
    let slope = field(world(70, 40, 60.0), |x, y| 0.1 * x + 0.3 * y);
    at_every_level(|| result(&NODE, &with_params(&NODE, ""), &[("height", &slope)], "height"));
    at_every_level(|| result(&NODE, &with_params(&NODE, "steps=layers"), &[("height", &slope)], "height"));
}
