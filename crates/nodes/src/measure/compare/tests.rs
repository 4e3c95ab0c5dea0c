//! Tests of Compare: real land scores about 1, noise and grids score low, and distances are in natural spreads.

use orograph_graph::ParamValue;

use super::*;
use crate::{
    raster,
    testing::{field, outputs, world},
};

fn model(name: &str) -> Field {
    let path = format!("{}/../../tests/data/dems/{name}.tif", env!("CARGO_MANIFEST_DIR"));
    let read = raster::read(path.as_ref()).expect("the test's data");
    raster::height_field(read, [0.0, 1.0], None).expect("a field").field
}

fn compared(kind: &'static str, inputs: &[(&str, &Field)]) -> Report {
    let mut params = ParamValues::defaults(&NODE.specs());
    params.set("kind", ParamValue::Choice(kind));
    let mut outputs = outputs(&NODE, &params, inputs).expect("a result");
    outputs.take("report").expect("a report").as_report().expect("a report").clone()
}

/// The scores of whole models, each left out of the table.
fn reals() -> Vec<f64> {
    let wholes = Real::table().tiles.iter().filter(|tile| tile.part == "whole");
    wholes.map(|tile| Score::left_out(tile).least()).collect()
}

#[test]
fn real_land_that_is_left_out_scores_about_one() {
    let mut reals = reals();
    reals.sort_unstable_by(f64::total_cmp);
    assert_eq!(reals.len(), 7);
    assert!((0.7..=1.1).contains(&reals[3]), "{reals:?}");
    assert!(reals[0] > 0.5 && reals[6] < 1.3, "{reals:?}");
}

/// Heights that no land has: white noise, sums of waves of halved lengths in random directions, and a valley network
/// that follows rows and columns.
#[test]
fn noise_and_grids_score_below_half_of_the_least_real_model() {
    let least = reals().into_iter().fold(f64::INFINITY, f64::min);
    let tile = world(333, 333, 90.0);
    let random = |seed: u32| f64::from(orograph_graph::mix(seed)) / f64::from(u32::MAX);
    let white = field(tile, |x, y| 400.0 * random((x / 90.0) as u32 * 4096 + (y / 90.0) as u32));
    let fractal = field(tile, |x, y| {
        (0..96)
            .map(|wave: u32| {
                let length = 12_000.0 * libm::pow(0.93, f64::from(wave));
                let turn = std::f64::consts::TAU * random(2 * wave);
                let along = x * libm::cos(turn) + y * libm::sin(turn);
                0.05 * length * libm::sin(std::f64::consts::TAU * (along / length + random(2 * wave + 1)))
            })
            .sum()
    });
    let grid = field(tile, |x, y| {
        let ditch = |at: f64| (at % 1800.0 - 900.0).abs();
        2000.0 + 0.05 * y + 0.5 * ditch(x) + 0.02 * ditch(y)
    });
    for (name, land) in [("white", white), ("fractal", fractal), ("grid", grid)] {
        let score = compared("none", &[("height", &land)]).get("score").expect("a score");
        assert!(score < 0.5 * least, "{name}: {score}, real land at least {least}");
    }
}

#[test]
fn land_is_near_itself_and_its_kind() {
    let [glen, norfolk] = ["glencoe", "norfolk"].map(model);
    let own = compared("none", &[("height", &glen), ("reference", &glen)]);
    assert_eq!(own.get("distance.slope.p50"), Some(0.0));
    assert_eq!(own.get("slope_distance"), Some(0.0));
    let far = |report: &Report| {
        let distances: Vec<f64> =
            report.measures.iter().filter(|m| m.name.starts_with("distance.")).map(|m| m.value.abs()).collect();
        distances.iter().sum::<f64>() / distances.len() as f64
    };
    let [at_home, abroad] = [&glen, &norfolk].map(|land| far(&compared("glaciated", &[("height", land)])));
    assert!(at_home < 1.2 && abroad > 2.0 * at_home, "{at_home} {abroad}");
    let window = compared("highlands", &[("height", &glen)]);
    // the window of relief is 900 to 1500 m
    let relief = window.get("distance.relief").expect("a window");
    assert!((relief - (1346.1 - 1200.0) / 300.0).abs() < 0.15, "{relief}");
}

#[test]
fn curves_have_those_of_the_reference_or_of_the_models_of_the_kind() {
    let glen = model("glencoe");
    let slopes = |report: &Report| -> Vec<(Option<String>, Vec<f64>)> {
        let curves = report.series.iter().filter(|curve| curve.name == "slope_histogram");
        curves.map(|curve| (curve.of.clone(), curve.y.values.clone())).collect()
    };
    assert!(slopes(&compared("none", &[("height", &glen)])).is_empty());
    let kind = slopes(&compared("highlands", &[("height", &glen)]));
    let reference = slopes(&compared("none", &[("height", &glen), ("reference", &glen)]));
    assert_eq!([&kind[0].0, &kind[1].0], [&None, &Some("glencoe".to_owned())]);
    assert_eq!([&reference[0].0, &reference[1].0], [&None, &Some("reference".to_owned())]);
    assert_eq!(reference[0].1, reference[1].1);
    // the table has five digits
    let same = kind[0].1.iter().zip(&kind[1].1).all(|(own, real)| (own - real).abs() <= 1e-4 * own.abs());
    assert!(same, "the table has the curves of the model: run the example `real_tiles`");
}

#[test]
fn a_reference_is_measured_once_for_all_distances() {
    let cancel = Cancel::default();
    let [glen, norfolk] = ["glencoe", "norfolk"].map(model);
    let reference = Reference::of(&glen, &cancel).expect("measures");
    let own = reference.distances(&glen, &cancel).expect("distances");
    assert!(own.len() > 40 && own.iter().all(|(_, distance)| *distance == 0.0), "{own:?}");
    let report = compared("none", &[("height", &norfolk), ("reference", &glen)]);
    for (name, distance) in reference.distances(&norfolk, &cancel).expect("distances") {
        let reported = report.get(&format!("distance.{name}"));
        assert!(reported.map_or(distance.is_nan(), |reported| reported == distance), "{name}: {distance} {reported:?}");
    }
    cancel.cancel();
    assert_eq!(reference.distances(&glen, &cancel), Err(NodeError::Cancelled));
}

/// At finer cells of the same land, the score hardly changes: both are averaged.
#[test]
fn finer_cells_are_averaged() {
    let coarse = model("mandakini");
    let fine = {
        let world = World { cells: coarse.window().cells.map(|cells| cells * 3), ..coarse.window().world };
        let nx = coarse.window().nx();
        let (width, height) = (3 * nx, 3 * coarse.window().ny());
        let samples = (0..width * height).map(|at| coarse.plane(0)[at / width / 3 * nx + at % width / 3]).collect();
        Field::new(Window::whole(world), samples)
    };
    let [a, b] = [&coarse, &fine].map(|land| compared("none", &[("height", land)]).get("score").expect("a score"));
    assert!((a - b).abs() < 0.1, "{a} {b}");
    let large = Field::new(Window::whole(world(100, 100, 500.0)), vec![0.0; 10_000]);
    let report = compared("fluvial", &[("height", &large)]);
    assert!(report.notes.iter().any(|note| note.starts_with("cells of 500 m")), "{:?}", report.notes);
}

#[test]
fn any_land_is_compared() {
    for (nx, ny) in [(1, 1), (3, 2), (40, 1)] {
        let land = field(world(nx, ny, 90.0), |x, _| x);
        let report = compared("alps", &[("height", &land), ("reference", &land)]);
        assert!(report.get("score").expect("a score").is_nan());
    }
    let voids = field(world(50, 50, 90.0), |_, _| f64::NAN);
    assert!(compared("alps", &[("height", &voids)]).get("score").expect("a score").is_nan());
}
