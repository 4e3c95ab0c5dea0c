//! Tests of the volcano's parts and measures.

use super::*;
use crate::{
    numerics::math,
    testing::{at_every_level, generate, outputs_on, with_params, world},
};

/// Changes that make a volcano a body of revolution.
const EVEN: &str = "breach=0,gullies=0,flows=0,cones=0,irregularity=0";

/// Returns a profile from the centre to the east.
fn profile(changes: &str) -> Vec<f32> {
    let land = generate(Window::whole(world(1025, 1025, 16.0)), &NODE, &format!("{EVEN},{changes}"));
    land.samples()[511 * 1025 + 511..][..514].to_vec()
}

#[test]
fn a_stratovolcano_is_as_high_as_asked_and_nowhere_steeper_than_repose() {
    for (height, repose) in [(2200.0_f64, 32.0_f64), (600.0, 32.0), (3500.0, 30.0)] {
        let profile = profile(&format!("height={height},repose={repose},caldera_radius=0"));
        // the middle of the world is 8 m from the centre of the nearest cell
        assert!((f64::from(profile[0]) - height).abs() < 10.0, "{}", profile[0]);
        let steepest = math::tan(repose.to_radians());
        let slopes: Vec<f64> = profile.windows(2).map(|pair| f64::from(pair[0] - pair[1]) / 16.0).collect();
        // rounding of thousands of metres in single precision over 16 m
        assert!(slopes[1..].iter().all(|slope| (-1e-4..steepest + 1e-4).contains(slope)), "{slopes:?}");
        // concave without a break: the slope changes by at most 2 % of the steepest per cell
        assert!(slopes[20..430].windows(2).all(|pair| pair[1] <= pair[0] + 1e-4 && pair[0] - pair[1] < 0.02));
        assert_eq!(profile[440], 0.0);
    }
}

#[test]
fn a_shield_is_its_power_and_a_caldera_a_floor_with_steep_walls() {
    let profile = profile("form=shield,height=800,caldera_radius=1600,caldera_depth=300");
    let cone = |r: f64| 800.0 * math::pow(1.0 - r / 7000.0, 1.2);
    let distance = |k: usize| math::hypot(16.0 * k as f64 - 8.0, 8.0);
    for k in [120, 200, 400] {
        assert!((f64::from(profile[k]) - cone(distance(k))).abs() < 0.1, "{k}: {}", profile[k]);
    }
    assert!((f64::from(profile[3]) - (cone(1600.0) - 300.0)).abs() < 1e-3);
    assert!((f64::from(profile[98] - profile[97]) / 16.0 - 1.732).abs() < 0.01);
}

#[test]
fn a_volcano_too_steep_for_ash_is_refused_with_the_radius_it_needs() {
    let params = with_params(&NODE, "height=3000,radius=2000");
    let error = outputs_on(Window::whole(world(8, 8, 10.0)), &NODE, &params, &[]);
    assert!(matches!(error, Err(NodeError::Failed { hint: Some(hint), .. }) if hint.contains("above 4802")));
}

/// Returns the land, and its heights around a circle, every degree.
fn ring(land: &Field, radius_m: f64) -> Vec<f64> {
    let (nx, cell_m) = (land.window().nx(), land.window().cell_m());
    let at = |degrees: i32| {
        let angle = f64::from(degrees).to_radians();
        let cell = |metres: f64| (metres / cell_m) as usize;
        let [x, y] = [8192.0 + radius_m * math::sin(angle), 8192.0 - radius_m * math::cos(angle)];
        f64::from(land.samples()[cell(y) * nx + cell(x)])
    };
    (0..360).map(at).collect()
}

fn deviation(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    (values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / values.len() as f64).sqrt()
}

/// Around a circle an even volcano is level; a gullied one is not, most of all half-way down, where gullies are
/// deepest: tens of metres, less than the deepest gully.
#[test]
fn gullies_deepen_downslope_and_end_at_the_foot() {
    let window = Window::whole(world(512, 512, 32.0));
    let even = generate(window, &NODE, EVEN);
    let cut = generate(window, &NODE, "breach=0,gullies=0.6,flows=0,cones=0,irregularity=0");
    assert!([2000.0, 4000.0].iter().all(|r| deviation(&ring(&even, *r)) < 10.0));
    let depth = |radius_m: f64| {
        let pairs = ring(&even, radius_m).into_iter().zip(ring(&cut, radius_m));
        deviation(&pairs.map(|(before, after)| before - after).collect::<Vec<f64>>())
    };
    let [head, middle, foot] = [900.0, 3300.0, 6700.0].map(depth);
    assert!(middle > 15.0 && middle > 1.5 * head && middle > 3.0 * foot, "{head} {middle} {foot}");
    let cuts = even.samples().iter().zip(cut.samples()).map(|(a, b)| f64::from(a - b));
    let (least, most) = cuts.fold((0.0_f64, 0.0_f64), |(least, most), cut| (least.min(cut), most.max(cut)));
    // and side gullies deepen them by less than a fifth
    assert!(least > -1e-3 && (80.0..1.2 * 0.46 * 0.6 * 600.0).contains(&most), "{least} {most}");
    assert!(cut.samples().iter().all(|h| *h >= 0.0));
}

/// The largest scoria cone is 665 m wide and 0.18 times as high, and higher above the ground downslope of its summit.
#[test]
fn scoria_cones_have_the_proportions_of_cinder_cones() {
    assert_eq!(flows::SCORIA, [0.18, 0.40]);
    let window = Window::whole(world(512, 512, 32.0));
    let even = generate(window, &NODE, EVEN);
    let cones = generate(window, &NODE, "breach=0,gullies=0,flows=0,cones=30,irregularity=0");
    let raised: Vec<f64> = even.samples().iter().zip(cones.samples()).map(|(a, b)| f64::from(b - a)).collect();
    let most = raised.iter().fold(0.0, |most: f64, rise| most.max(*rise));
    assert!(raised.iter().all(|rise| *rise > -1e-3) && (60.0..0.18 * 665.0 + 70.0).contains(&most), "{most}");
    // 30 cones with a mean width of about 350 m
    let share = raised.iter().filter(|rise| **rise > 5.0).count() as f64 * 32.0 * 32.0 / 30.0;
    assert!((0.25..2.2).contains(&(share / (0.25 * std::f64::consts::PI * 350.0 * 350.0))), "{share}");
}

#[test]
fn flows_thicken_the_flank_and_a_breach_opens_the_rim() {
    let window = Window::whole(world(512, 512, 32.0));
    let even = generate(window, &NODE, EVEN);
    let flows = generate(window, &NODE, "breach=0,gullies=0,flows=20,cones=0,irregularity=0");
    let thick = even.samples().iter().zip(flows.samples()).map(|(a, b)| b - a).fold(0.0, f32::max);
    // at most 2 % of 2200 m, with swells of a fifth, and on other flows
    assert!((15.0..90.0).contains(&thick), "{thick}");
    let open = generate(window, &NODE, "breach=1,breach_azimuth=90,gullies=0,flows=0,cones=0,irregularity=0");
    let rims = [&even, &open].map(|land| ring(land, 450.0));
    assert!(rims[0][90] - rims[1][90] > 150.0 && (rims[0][270] - rims[1][270]).abs() < 1.0);
}

/// A window and finer cells show the same volcano, and so do all instruction sets.
#[test]
fn the_same_volcano_in_a_window_and_on_finer_cells() {
    let whole = Window::whole(world(256, 256, 64.0));
    let land = generate(whole, &NODE, "seed=4");
    let part = Window { origin: [37, 91], cells: [103, 60], ..whole };
    assert_eq!(land.crop(&part), generate(part, &NODE, "seed=4"));
    assert_ne!(land, generate(whole, &NODE, "seed=5"));
    let fine = generate(Window::whole(world(1024, 1024, 16.0)), &NODE, "seed=4");
    let [coarse, fine] = [(&land, 4), (&fine, 16)].map(|(land, side)| crate::testing::block_means(land, side));
    let apart = coarse.iter().zip(&fine).map(|(a, b)| f64::from((a - b) * (a - b))).sum::<f64>() / coarse.len() as f64;
    assert!(apart.sqrt() < 6.0, "{}", apart.sqrt());
    at_every_level(|| generate(part, &NODE, ""));
}

#[test]
fn nothing_extreme_breaks_it() {
    for changes in [
        "gully_spacing=1",
        "gully_spacing=1e6,irregularity=1,breach=1",
        "radius=1,height=0.1,caldera_radius=1e6",
        "height=0,cones=200,flows=200",
        "form=shield,height=30000,radius=1,caldera_depth=10000",
    ] {
        for cell_m in [1e-3, 1.0, 1e4] {
            let land = generate(Window::whole(world(40, 5, cell_m)), &NODE, changes);
            assert!(land.samples().iter().all(|h| h.is_finite()), "{changes} {cell_m}");
        }
    }
}
