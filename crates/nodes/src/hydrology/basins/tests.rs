//! Tests of `Basins`.

use orograph_graph::{Boundary, Cancel, Edge, ParamValue, World};

use super::NODE;
use crate::{hydrology::flow, prelude::*, testing};

/// Two valleys that run south, side by side; the divide is at x = 1300 m, and the eastern valley is wider.
fn valleys() -> Field {
    let valley = |x: f64, y: f64| 2000.0 - 0.1 * y + 0.4 * (x - 550.0).abs().min((x - 2050.0).abs());
    let boundary = Boundary { south: Edge::Open, ..Boundary::all(Edge::Wall) };
    testing::field(World { boundary, ..testing::world(30, 50, 100.0) }, valley)
}

fn drained(height: &Field, changes: &str) -> Field {
    let params = testing::with_params(&flow::NODE, changes);
    let mut outputs = testing::outputs(&flow::NODE, &params, &[("height", height)]).expect("a result");
    outputs.take("flow").expect("an output").as_field().expect("a field").clone()
}

fn samples(outputs: &mut Outputs, name: &str) -> Vec<f32> {
    outputs.take(name).expect("an output").as_field().expect("a field").clone().into_samples()
}

#[test]
fn basins_are_numbered_by_size_and_meet_at_divides() {
    let flow = drained(&valleys(), "");
    let params = testing::with_params(&NODE, "smallest=1000000");
    let mut outputs = testing::outputs(&NODE, &params, &[("flow", &flow)]).expect("a result");
    let [basin, mask, divide] = ["basin", "mask", "divide"].map(|name| samples(&mut outputs, name));
    let report = outputs.take("report").expect("a report").as_report().expect("a report").clone();
    assert_eq!(report.get("basins"), Some(2.0));
    assert!(report.get("largest_area") > Some(6e6) && report.get("area") <= Some(15e6));
    let at = |x: usize, y: usize| basin[y * 30 + x];
    assert_eq!([at(5, 25), at(20, 25), at(12, 25), at(13, 25)], [2.0, 1.0, 2.0, 1.0]);
    assert_eq!([11, 12, 13, 14].map(|x| divide[25 * 30 + x]), [0.0, 1.0, 1.0, 0.0]);
    // a ring around each basin, with its area inside; the outer ring runs counter-clockwise with north up
    let outlines = outputs.take("outlines").expect("lines").as_lines().expect("lines").clone();
    assert_eq!(outlines.lines.iter().map(|line| line.order).collect::<Vec<_>>(), [2, 1]);
    for line in &outlines.lines {
        let ends = [line.vertices.first(), line.vertices.last()].map(|end| end.expect("vertices").position_m);
        assert_eq!(ends[0], ends[1]);
        let pairs = line.vertices.windows(2).map(|pair| [pair[0].position_m, pair[1].position_m]);
        let area_m2 = 0.5 * pairs.map(|[a, b]| a[1] * b[0] - a[0] * b[1]).sum::<f64>();
        assert_eq!(area_m2, 1e4 * basin.iter().filter(|number| **number == line.order as f32).count() as f64);
        // at the divide, the line is as high as its highest cell
        let at_divide = line.vertices.iter().find(|vertex| vertex.position_m == [1300.0, 0.0]).expect("a corner");
        assert!((at_divide.elevation_m - (1995.0 + 0.4 * 750.0)).abs() < 60.0, "{}", at_divide.elevation_m);
    }
    assert!(basin.iter().zip(&mask).all(|(basin, mask)| (*basin > 0.0) == (*mask == 1.0)));
}

/// Basins are those of directions where water spreads too, and sorted by the areas that the report gives.
#[test]
fn areas_fall_with_the_number() {
    let height = flow::tests::hills(testing::world(90, 70, 10.0));
    for changes in ["", "routing=mfd", "depressions=keep,routing=d_infinity", "depressions=jump"] {
        let params = testing::with_params(&NODE, "smallest=1500");
        let mut outputs = testing::outputs(&NODE, &params, &[("flow", &drained(&height, changes))]).expect("a result");
        let basin = samples(&mut outputs, "basin");
        let report = outputs.take("report").expect("a report").as_report().expect("a report").clone();
        let areas = &report.series[0].y.values;
        assert!(areas.len() > 3 && areas.windows(2).all(|pair| pair[0] >= pair[1]), "{changes}: {areas:?}");
        assert!(areas.iter().all(|area| *area >= 1500.0) && report.get("largest_area") == Some(areas[0]));
        let counted = |number: usize| 100.0 * basin.iter().filter(|&&of| of == number as f32).count() as f64;
        assert!(areas.iter().enumerate().all(|(at, area)| counted(at + 1) == *area), "{changes}");
    }
}

/// The catchment of a place is all that drains through it, and the place moves to the river beside it.
#[test]
fn the_catchment_of_a_place_snaps_to_its_river() {
    let flow = drained(&valleys(), "");
    let catchment = |changes: &[(&'static str, ParamValue)]| {
        let mut params = testing::with_params(&NODE, "choose=place");
        changes.iter().for_each(|(name, value)| params.set(name, value.clone()));
        let window = *flow.window();
        let (outputs, warnings) =
            testing::outputs_and_warnings(&Cancel::default(), window, &NODE, &params, &[("flow", &flow)]);
        (samples(&mut outputs.expect("a result"), "basin").iter().sum::<f32>() as usize, warnings)
    };
    let at = |x: f64, y: f64| ("at", ParamValue::Point([x, y]));
    let snap = |m: f64| ("snap", ParamValue::Float(m));
    let area = |x: usize, y: usize| (flow.plane(1)[y * 30 + x] / 1e4) as usize;
    // the river itself, 300 m beside it, and a cell of the slope alone
    let river = area(20, 30);
    assert!(river > 300);
    assert_eq!(catchment(&[at(2050.0, 3050.0), snap(0.0)]).0, river);
    assert_eq!(catchment(&[at(1750.0, 3050.0), snap(0.0)]).0, area(17, 30));
    let (snapped, warnings) = catchment(&[at(1750.0, 3050.0), snap(320.0)]);
    assert!(snapped >= river && warnings.is_empty(), "{snapped}");
    let (none, warnings) = catchment(&[at(-10.0, 50.0), snap(320.0)]);
    assert!(none == 0 && warnings[0].contains("outside the world"), "{warnings:?}");
}
