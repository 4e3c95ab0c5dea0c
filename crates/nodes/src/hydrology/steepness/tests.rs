//! Tests of `Steepness`: against rivers in balance, and sums that are taken cell by cell.

use orograph_graph::{Boundary, Edge, World};

use super::NODE;
use crate::{hydrology::flow, prelude::*, testing};

fn drained(height: &Field, changes: &str) -> Field {
    let params = testing::with_params(&flow::NODE, changes);
    let mut outputs = testing::outputs(&flow::NODE, &params, &[("height", height)]).expect("a result");
    outputs.take("flow").expect("an output").as_field().expect("a field").clone()
}

fn measured(flow: &Field, changes: &str) -> [Vec<f32>; 3] {
    let params = testing::with_params(&NODE, changes);
    let mut outputs = testing::outputs(&NODE, &params, &[("flow", flow)]).expect("a result");
    ["steepness", "chi", "distance"]
        .map(|name| outputs.take(name).expect("an output").as_field().expect("a field").clone().into_samples())
}

/// A world whose water leaves in the south.
fn open_in_the_south(nx: u32, ny: u32) -> World {
    World { boundary: Boundary { south: Edge::Base, ..Boundary::all(Edge::Wall) }, ..testing::world(nx, ny, 100.0) }
}

/// A river down a single column, in balance: its slope is k A^-θ. The lowest cell is the last.
fn river(cells: u32, steepness: f64, concavity: f64) -> Field {
    let cell_m = 100.0;
    let mut heights = vec![0.0; cells as usize];
    for cell in (0..heights.len() - 1).rev() {
        let area_m2 = (cell + 1) as f64 * cell_m * cell_m;
        heights[cell] = heights[cell + 1] + cell_m * steepness * libm::pow(area_m2, -concavity);
    }
    testing::field(open_in_the_south(1, cells), |_, y| heights[(y / cell_m) as usize])
}

/// The steepness is the same all along, with any reach, and height is a straight line over chi.
#[test]
fn rivers_in_balance_have_one_steepness() {
    for (concavity, k) in [(0.45, 120.0), (0.3, 20.0), (0.6, 900.0)] {
        let height = river(300, k, concavity);
        let flow = drained(&height, "");
        for reach in [0.0, 1000.0, 1e5] {
            let changes = format!("concavity={concavity},channel_area=0,reach={reach},reference_area=1e7");
            let [steepness, chi, distance] = measured(&flow, &changes);
            // heights are in single precision, with steps of a sixteenth of a millimetre
            let tolerance = if reach < 1.0 { 0.02 } else { 2e-3 };
            for cell in 0..300 {
                assert!(
                    (f64::from(steepness[cell]) / k - 1.0).abs() < tolerance,
                    "{reach} {cell}: {}",
                    steepness[cell]
                );
                let per_chi = k * libm::pow(1e7, -concavity);
                let expected = f64::from(height.samples()[cell]) / per_chi;
                assert!((f64::from(chi[cell]) - expected).abs() < 1e-4 * expected + 1e-3, "{cell}: {}", chi[cell]);
                assert_eq!(distance[cell], 100.0 * (299 - cell) as f32);
            }
        }
    }
}

/// The profiles of a river in balance: all of its length, and a straight line over chi.
#[test]
fn the_report_has_the_profile_of_the_largest_river() {
    let height = river(300, 120.0, 0.45);
    let params = testing::with_params(&NODE, "channel_area=0");
    let mut outputs = testing::outputs(&NODE, &params, &[("flow", &drained(&height, ""))]).expect("a result");
    let report = outputs.take("report").expect("a report").as_report().expect("a report").clone();
    let measure = |name: &str| report.get(name).expect("a measure");
    assert_eq!((measure("river_length"), measure("channels_length")), (29_900.0, 29_900.0));
    assert!((measure("steepness_p50") / 120.0 - 1.0).abs() < 2e-3);
    let [profile, over_chi] = ["profile", "chi_profile"]
        .map(|name| report.series.iter().find(|series| series.name == name).expect("a curve"));
    assert_eq!((profile.x.values.len(), profile.x.values[299]), (300, 29_900.0));
    assert_eq!(profile.y.values[299] as f32, height.samples()[0]);
    let slope = measure("river_relief") / measure("river_chi");
    let apart = over_chi.x.values.iter().zip(&over_chi.y.values).map(|(chi, level)| (chi * slope - level).abs());
    assert!(apart.fold(0.0, f64::max) < 1e-3 * measure("river_relief"));
}

/// On rough terrain, walking down from each cell gives the same.
#[test]
fn sums_are_those_of_walks() {
    let height = flow::tests::hills(testing::world(90, 150, 10.0));
    let (nx, flow) = (90, drained(&height, ""));
    let [direction, area, _, level] = [0, 1, 2, 3].map(|plane| flow.plane(plane));
    let steps: [(isize, f64); 8] = [1, -89, -90, -91, -1, 89, 90, 91].map(|step: isize| {
        (step, if step.abs() == 1 || step.abs() == nx { 10.0 } else { 10.0 * std::f64::consts::SQRT_2 })
    });
    let below = |cell: usize| {
        (direction[cell] >= 0.0)
            .then(|| steps[direction[cell] as usize])
            .map(|(step, m)| (cell.wrapping_add_signed(step), m))
    };
    let [base, least] = [1400.0, 5000.0];
    let [_, chi, distance] = measured(&flow, "channel_area=5000,reference_area=1000000,base=1400");
    let [steepness, bare, _] = measured(&flow, "channel_area=5000,reference_area=1000000,base=1400,hillslopes=false");
    for start in 0..area.len() {
        let (mut at, mut sums) = (start, [0.0_f64; 2]);
        while let Some((next, length_m)) = below(at) {
            let grows = f64::from(level[at]) > base && f64::from(area[at]) > least;
            sums[0] += if grows { length_m * libm::pow(1e6 / f64::from(area[at]), 0.45) } else { 0.0 };
            sums[1] += length_m;
            at = next;
        }
        assert!((f64::from(chi[start]) - sums[0]).abs() <= 1e-5 * sums[0], "{start}: {} {}", chi[start], sums[0]);
        assert!((f64::from(distance[start]) - sums[1]).abs() <= 1e-6 * sums[1]);
        let is_channel = f64::from(area[start]) > least;
        assert_eq!(bare[start], if is_channel { chi[start] } else { 0.0 });
        assert!(steepness[start] >= 0.0 && (is_channel || steepness[start] == 0.0));
    }
    assert!(steepness.iter().any(|&value| value > 0.0));
}

/// A step in the steepness is at the same place in the map; hillslopes have the value of their channel.
#[test]
fn a_step_of_steepness_shows_on_hillslopes_too() {
    // a valley along the middle column that is twice as steep above 5 km
    let valley = |x: f64, y: f64| {
        let along = if y < 5000.0 { 500.0 + 0.2 * (5000.0 - y) } else { 0.1 * (10_000.0 - y) };
        along + 0.5 * (x - 1050.0).abs()
    };
    let height = testing::field(open_in_the_south(21, 100), valley);
    let flow = drained(&height, "");
    let [steepness, ..] = measured(&flow, "concavity=0,channel_area=200000,reach=500");
    let at = |x: usize, y: usize| f64::from(steepness[y * 21 + x]);
    for x in [5, 10, 15] {
        assert!((at(x, 20) - 0.2).abs() < 1e-3 && (at(x, 80) - 0.1).abs() < 1e-3, "{x}: {} {}", at(x, 20), at(x, 80));
    }
}
