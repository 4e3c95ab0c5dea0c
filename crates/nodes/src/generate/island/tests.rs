//! Tests of outlines and shores.

use super::*;
use crate::testing::{field, outputs_on, with_params, world};

/// Changes that keep the coast the same everywhere.
const EVEN: &str = "irregularity=0,variety=0,cliffs=0";

fn island(changes: &str, fields: &[(&str, &Field)]) -> [Field; 2] {
    let params = with_params(&NODE, &format!("{EVEN},{changes}"));
    let window = Window::whole(world(160, 120, 100.0));
    let mut outputs = outputs_on(window, &NODE, &params, fields).expect("a result");
    ["height", "inland"].map(|name| outputs.take(name).expect("an output").as_field().expect("a field").clone())
}

#[test]
fn the_coast_follows_the_edges_and_the_profile_is_its_formula() {
    let [height, inland] = island("roughness=0,margin=2000,slope=3000,shelf=1000,depth=200,sea=10", &[]);
    let at = |i: usize, j: usize| (height.samples()[j * 160 + i], inland.samples()[j * 160 + i]);
    // a row halfway between north and south of 16 km x 12 km
    for i in [0, 15, 25, 40, 80] {
        let x = 100.0 * i as f64 + 50.0;
        let sum: f64 = [x, 16_000.0 - x, 6050.0, 5950.0].iter().map(|side| 1.0 / (side * side)).sum();
        let d = 1.0 / sum.sqrt() - 2000.0;
        let t = (if d > 0.0 { d / 3000.0 } else { -d / 1000.0 }).min(1.0);
        let expected = 10.0 + t * (2.0 - t) * if d > 0.0 { 490.0 } else { -200.0 };
        assert!((f64::from(at(i, 60).1) - d).abs() < 1e-3 && (f64::from(at(i, 60).0) - expected).abs() < 1e-3, "{i}");
    }
    // rises monotonically from the edge to the middle, along any row and column
    assert!((1..80).all(|i| (0..120).all(|j| at(i, j).0 >= at(i - 1, j).0)));
}

#[test]
fn it_takes_land_and_an_outline() {
    let world = world(160, 120, 100.0);
    let hills = field(world, |x, _| 300.0 + 0.01 * x);
    let distance = field(world, |x, _| 8000.0 - x);
    let changes = "form=outline,roughness=0,slope=1000,depth=50,shelf=100";
    let [height, _] = island(changes, &[("height", &hills), ("distance", &distance)]);
    assert_eq!(height.samples()[70], -50.0);
    assert_eq!(height.samples()[100], hills.samples()[100]);
    let params = with_params(&NODE, "form=outline");
    let error = outputs_on(Window::whole(world), &NODE, &params, &[]);
    assert!(matches!(error, Err(NodeError::Failed { hint: Some(_), .. })));
}

/// The circle keeps its area to 5 %: bays and capes balance.
#[test]
fn bays_and_capes_move_the_coast_both_ways() {
    let [_, inland] = island("form=disc,radius=3500,roughness=1500,wavelength=1500", &[]);
    // its centre, (8192, 8192), is 300 m from the southern third of this world
    let land = inland.samples().iter().filter(|d| **d > 0.0).count() as f64 * 1e4;
    let circle = std::f64::consts::PI * 3500.0 * 3500.0;
    assert!((land / circle - 1.0).abs() < 0.05, "{}", land / circle);
    let rough = inland.samples().iter().filter(|d| d.abs() < 50.0).count() as f64;
    let smooth =
        island("form=disc,radius=3500,roughness=0", &[])[1].samples().iter().filter(|d| d.abs() < 50.0).count();
    assert!(rough > 1.15 * smooth as f64, "{rough} {smooth}");
}

/// Distances of the first coast from the middle of a disc, in 72 directions, in a world of 164 x 164 cells of 100 m.
fn coast(inland: &Field) -> Vec<f64> {
    let at = |degrees: f64, metres: f64| {
        let angle = degrees.to_radians();
        let cell = |metres: f64| ((metres / 100.0) as usize).min(163);
        let [x, y] = [8192.0 + metres * libm::cos(angle), 8192.0 + metres * libm::sin(angle)];
        f64::from(inland.samples()[cell(y) * 164 + cell(x)])
    };
    let first = |degrees: f64| (5..82).map(|k| 100.0 * f64::from(k)).find(|metres| at(degrees, *metres) < 0.0);
    (0..72).map(|k| first(5.0 * f64::from(k)).unwrap_or(8192.0)).collect()
}

/// A disc has bays and headlands: the distance of its coast differs by a tenth of the radius and more, and stays near
/// the radius on average over seeds. The sides of the world stay in the sea.
#[test]
fn outlines_have_bays_and_headlands() {
    let spread = |changes: &str| {
        let mut means = [0.0; 2];
        for seed in 0..4 {
            let params = format!("{EVEN},form=disc,radius=4000,roughness=0,seed={seed},{changes}");
            let window = Window::whole(world(164, 164, 100.0));
            let mut outputs = outputs_on(window, &NODE, &with_params(&NODE, &params), &[]).expect("a result");
            let inland = outputs.take("inland").expect("an output");
            let coast = coast(inland.as_field().expect("a field"));
            let mean = coast.iter().sum::<f64>() / 72.0;
            let deviation = (coast.iter().map(|d| (d - mean) * (d - mean)).sum::<f64>() / 72.0).sqrt();
            means = [means[0] + 0.25 * mean, means[1] + 0.25 * deviation];
        }
        means
    };
    let [radius, even] = spread("");
    assert!((radius - 4050.0).abs() < 60.0 && even < 60.0, "{radius} {even}");
    let [mean, uneven] = spread("irregularity=0.5");
    assert!(uneven > 400.0 && (mean - 4000.0).abs() < 1200.0, "{mean} {uneven}");
    let [height, _] = island("irregularity=1,variety=1,cliffs=100,roughness=2000,margin=2500", &[]);
    let h = height.samples();
    let sides =
        (0..160).flat_map(|i| [h[i], h[119 * 160 + i]]).chain((0..120).flat_map(|j| [h[j * 160], h[j * 160 + 159]]));
    assert!(sides.filter(|h| *h > 0.0).count() < 30);
}

/// Exposed coasts have cliffs of the given height, sheltered ones are flat.
#[test]
fn coasts_have_cliffs_and_beaches() {
    let params = Params::read(&with_params(&NODE, "variety=1,cliffs=80,slope=4000"));
    let [cliff, behind] = params.shore(60.0, 1.0);
    assert!(cliff == 80.0 && behind == 60.0);
    let [none, flat] = params.shore(60.0, 0.0);
    assert!(none == 0.0 && flat < 0.12 * 60.0);
    let window = Window::whole(world(320, 240, 50.0));
    let params = with_params(&NODE, "variety=1,cliffs=80");
    let height = outputs_on(window, &NODE, &params, &[]).expect("a result").take("height").expect("an output");
    let height = height.as_field().expect("a field");
    let h = height.samples();
    let shore: Vec<f32> =
        (0..320 * 240 - 1).filter(|at| at % 320 < 319 && h[*at] < 0.0 && h[at + 1] > 0.0).map(|at| h[at + 1]).collect();
    let [steep, flat] = [40.0, 8.0].map(|limit| shore.iter().filter(|h| (**h > limit) == (limit > 10.0)).count());
    let share = |count: usize| count as f64 / shore.len() as f64;
    assert!(share(steep) > 0.1 && share(flat) > 0.1, "{steep} {flat} of {}", shore.len());
}

#[test]
fn islands_are_the_same_in_windows_and_on_finer_cells() {
    let whole = Window::whole(world(131, 97, 120.0));
    let land = crate::testing::generate(whole, &NODE, "");
    let part = Window { origin: [17, 31], cells: [83, 40], ..whole };
    assert_eq!(land.crop(&part), crate::testing::generate(part, &NODE, ""));
    crate::testing::at_every_level(|| crate::testing::generate(part, &NODE, ""));
    let means = |cells: u32, side: usize| {
        let land = crate::testing::generate(Window::whole(world(cells, cells, 16_384.0 / f64::from(cells))), &NODE, "");
        crate::testing::block_means(&land, side)
    };
    let (coarse, fine) = (means(256, 8), means(1024, 32));
    let apart = coarse.iter().zip(&fine).map(|(a, b)| f64::from((a - b) * (a - b))).sum::<f64>() / coarse.len() as f64;
    assert!(apart.sqrt() < 8.0, "{}", apart.sqrt());
}
