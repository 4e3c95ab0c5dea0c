//! Tests of paths.

use orograph_graph::{Boundary, Cancel, Edge, ParamValue, ParamValues, World};

use super::*;
use crate::testing::{outputs_and_warnings, with_params, world};

fn path(world: World, params: &ParamValues) -> (Lines, Field, Vec<String>) {
    let (outputs, warnings) = outputs_and_warnings(&Cancel::default(), Window::whole(world), &NODE, params, &[]);
    let mut outputs = outputs.expect("a result");
    let lines = outputs.take("lines").expect("lines").as_lines().expect("lines").clone();
    (lines, outputs.take("mask").expect("a mask").as_field().expect("a field").clone(), warnings)
}

fn through(changes: &str, points: Vec<Waypoint>) -> ParamValues {
    let mut params = with_params(&NODE, changes);
    params.set("points", ParamValue::Waypoints(points));
    params
}

#[test]
fn heights_and_widths_are_interpolated_along_the_way() {
    let at = |x: f64, height, width| Waypoint { at: [x, 500.0], height, width };
    let points = vec![
        at(0.0, None, None),
        at(100.0, Some(10.0), Some(4.0)),
        at(200.0, None, None),
        at(500.0, Some(50.0), None),
        at(900.0, None, None),
    ];
    let (lines, _, warnings) = path(world(10, 10, 100.0), &through("curve=0", points));
    assert!(!lines.draped && warnings.is_empty());
    let vertices = &lines.lines[0].vertices;
    let heights: Vec<f64> = vertices.iter().map(|vertex| vertex.elevation_m).collect();
    assert_eq!(heights, [10.0, 10.0, 20.0, 50.0, 50.0]);
    assert!(vertices.iter().all(|vertex| vertex.width_m == 4.0));
    let plain = [0.0, 700.0].map(|x| at(x, None, None)).to_vec();
    let (lines, ..) = path(world(10, 10, 100.0), &through("curve=0,width=35", plain));
    assert!(lines.draped && lines.lines[0].vertices.iter().all(|vertex| vertex.width_m == 35.0));
}

/// The mask of a straight path of 60 m on cells of 20 m covers three rows, and its sum is the path's area.
#[test]
fn the_mask_covers_the_width() {
    let points = [[-500.0, 500.0], [1500.0, 500.0]].map(Waypoint::new).to_vec();
    let (_, mask, _) = path(world(50, 50, 20.0), &through("curve=0,width=60", points));
    let area: f32 = mask.samples().iter().sum::<f32>() * 400.0;
    assert!((area - 60_000.0).abs() < 1.0, "{area}");
    let periodic = Boundary { east: Edge::Periodic, west: Edge::Periodic, ..Boundary::default() };
    let world = World { boundary: periodic, ..world(50, 50, 20.0) };
    let points = [[1010.0, 100.0], [1010.0, 900.0]].map(Waypoint::new).to_vec();
    let (_, mask, _) = path(world, &through("curve=0,width=40", points));
    assert_eq!((mask.samples()[25 * 50], mask.samples()[25 * 50 + 30]), (1.0, 0.0), "across the side");
}

/// A round path passes through its points, and a closed one ends where it begins without a corner.
#[test]
fn round_paths_pass_through_their_points() {
    let corners = [[200.0, 200.0], [800.0, 200.0], [800.0, 800.0], [200.0, 800.0]];
    let (lines, ..) = path(world(10, 10, 100.0), &through("closed=true", corners.map(Waypoint::new).to_vec()));
    let places: Vec<[f64; 2]> = lines.lines[0].vertices.iter().map(|vertex| vertex.position_m).collect();
    assert_eq!(places.len(), 4 * PIECES + 1);
    assert!(corners.iter().enumerate().all(|(at, corner)| places[at * PIECES] == *corner));
    assert_eq!(places[0], places[places.len() - 1]);
    let direction = |from: [f64; 2], to: [f64; 2]| libm::atan2(to[1] - from[1], to[0] - from[0]);
    let turn = direction(places[0], places[1]) - direction(places[places.len() - 2], places[0]);
    assert!(turn.abs() < 0.35, "{turn}");
    let length = *ways(&places).last().expect("ways");
    assert!((2400.0..2900.0).contains(&length), "{length}");
}

#[test]
fn odd_paths_are_drawn_or_explained() {
    let zigzag: Vec<Waypoint> =
        (0..10_000).map(|k| Waypoint::new([f64::from(k % 97) * 10.0, f64::from(k * 31 % 89) * 11.0])).collect();
    let (lines, mask, warnings) = path(world(64, 64, 16.0), &through("", zigzag));
    assert!(warnings.is_empty() && lines.lines[0].vertices.len() > 100_000);
    assert!(mask.samples().iter().all(|share| (0.0..=1.0).contains(share)));
    let outside = [[-5000.0, 0.0], [-4000.0, 1e6]].map(Waypoint::new).to_vec();
    let (_, mask, warnings) = path(world(10, 10, 100.0), &through("", outside));
    assert!(warnings.iter().any(|warning| warning.contains("in the world")), "{warnings:?}");
    assert_eq!(mask.range(0), Some((0.0, 0.0)));
}

#[test]
fn lines_of_a_file_replace_the_points() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("road.svg");
    std::fs::write(&file, "<svg><path d='M 100 100 L 900 900'/><polygon points='1,1 9,1 9,9'/></svg>")
        .expect("written");
    let mut params = with_params(&NODE, "curve=0");
    params.set("file", ParamValue::File(file.display().to_string()));
    let (lines, ..) = path(world(10, 10, 100.0), &params);
    assert_eq!(lines.lines.iter().map(|line| line.vertices.len()).collect::<Vec<_>>(), [2, 4]);
    assert_eq!(lines.lines[0].vertices[1].position_m, [900.0, 900.0]);
}

#[test]
fn heights_of_points_that_are_closer_than_rounding_are_numbers() {
    let at = |x: f64, height| Waypoint { at: [x, 5.0], height, width: None };
    let points = vec![at(0.0, Some(100.0)), at(1e-200, None), at(2e-200, Some(200.0)), at(500.0, Some(300.0))];
    let (lines, ..) = path(world(10, 10, 100.0), &through("", points));
    assert!(lines.lines[0].vertices.iter().all(|vertex| (100.0..=300.0).contains(&vertex.elevation_m)));
}
