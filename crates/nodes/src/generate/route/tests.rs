//! Tests of ways over terrain.

use orograph_graph::{ParamValue, World};

use super::*;
use crate::testing::{at_sea, field, outputs, outputs_and_warnings, with_params, world};

fn params(changes: &str, path: &[[f64; 2]]) -> ParamValues {
    let mut params = with_params(&NODE, changes);
    params.set("path", ParamValue::Path(path.to_vec()));
    params
}

fn route(land: &Field, changes: &str, path: &[[f64; 2]], more: &[(&str, &Field)]) -> Vec<[f64; 2]> {
    let inputs: Vec<(&str, &Field)> = [("height", land)].into_iter().chain(more.iter().copied()).collect();
    let mut found = outputs(&NODE, &params(changes, path), &inputs).expect("a result");
    let lines = found.take("lines").expect("lines").as_lines().expect("lines").clone();
    assert!(lines.draped);
    lines.lines[0].vertices.iter().map(|vertex| vertex.position_m).collect()
}

fn length(way: &[[f64; 2]]) -> f64 {
    way.windows(2)
        .map(|pair| [0, 1].map(|axis| pair[1][axis] - pair[0][axis]))
        .map(|[x, y]| (x * x + y * y).sqrt())
        .sum()
}

fn tile() -> World {
    world(200, 200, 10.0)
}

#[test]
fn on_level_ground_the_way_is_nearly_straight() {
    let land = field(tile(), |_, _| 100.0);
    for end in [[1900.0, 100.0], [1900.0, 1700.0], [700.0, 1900.0]] {
        let way = route(&land, "spacing=10", &[[100.0, 100.0], end], &[]);
        let straight = length(&[[100.0, 100.0], end]);
        assert_eq!([way[0], way[way.len() - 1]], [[100.0, 100.0], end]);
        // directions are at most 7 degrees apart
        assert!(length(&way) < 1.005 * straight, "{} {straight}", length(&way));
    }
}

/// On a plane steeper than the grade, a metre of climb costs least at a slope of grade / 3^(1/4). Of 48 directions, those
/// with the next slopes are chosen, in stretches that are long beside the bends.
#[test]
fn on_a_steep_plane_the_way_zigzags_in_long_stretches() {
    let land = field(tile(), |_, y| 0.4 * y);
    for grade in [0.1, 0.2] {
        let way =
            route(&land, &format!("spacing=10,rounding=60,grade={grade}"), &[[1000.0, 205.0], [1000.0, 1805.0]], &[]);
        let mut slopes: Vec<f64> =
            way.windows(2).map(|pair| (0.4 * (pair[1][1] - pair[0][1]) / length(pair)).abs() / grade).collect();
        slopes.sort_unstable_by(f64::total_cmp);
        let middle = slopes[slopes.len() / 2];
        assert!((0.6..1.2).contains(&middle), "{grade}: {middle} times the grade");
        let turns = way.windows(3).filter(|at| (at[1][0] - at[0][0]) * (at[2][0] - at[1][0]) < 0.0).count();
        assert!((1..=12).contains(&turns), "{grade}: {turns} hairpins over {} m", length(&way));
    }
}

#[test]
fn the_way_crosses_a_ridge_at_its_pass() {
    let pass = |x: f64| if (x - 1500.0).abs() < 200.0 { 0.0 } else { 1.0 };
    let land = field(tile(), |x, y| 300.0 * pass(x) * (1.0 - (y - 1000.0).abs() / 200.0).max(0.0));
    let way = route(&land, "spacing=20", &[[300.0, 300.0], [300.0, 1700.0]], &[]);
    let crossing = way.iter().find(|at| at[1] >= 1000.0).expect("it goes there");
    assert!((1280.0..1720.0).contains(&crossing[0]), "{crossing:?}");
}

#[test]
fn the_way_goes_around_the_sea_and_what_is_to_be_avoided() {
    let lake = |x: f64, y: f64| ((x - 1000.0) * (x - 1000.0) + (y - 1000.0) * (y - 1000.0)).sqrt() < 500.0;
    let ends = [[1000.0, 200.0], [1000.0, 1800.0]];
    let level = field(tile(), |_, _| 10.0);
    let wet = field(tile(), |x, y| f64::from(u8::from(lake(x, y))));
    let sea = at_sea(&field(tile(), |x, y| if lake(x, y) { -10.0 } else { 10.0 }), 0.0);
    let ways = [
        route(&level, "spacing=20,rounding=0", &ends, &[("avoid", &wet)]),
        route(&sea, "spacing=20,rounding=0,grade=2", &ends, &[]),
    ];
    for way in ways {
        let inside = way.iter().filter(|at| lake(at[0], at[1])).count();
        assert!(inside * 20 < way.len(), "{inside} of {}", way.len());
        assert!(length(&way) > 1800.0);
    }
    let through = route(&level, "spacing=20,detour=1", &ends, &[("avoid", &wet)]);
    assert!(length(&through) < 1610.0);
}

#[test]
fn all_places_are_visited_on_cells_of_any_size() {
    let hills = |x: f64, y: f64| 60.0 * (libm::sin(x / 190.0) + libm::cos(y / 230.0));
    let places = [[150.0, 150.0], [1800.0, 400.0], [900.0, 1850.0]];
    let ways = [100, 200, 400].map(|cells| {
        let land = field(World { cells: [cells; 2], ..tile() }, hills);
        route(&land, "spacing=20", &places, &[])
    });
    for way in &ways {
        assert!(places.iter().all(|place| way.contains(place)));
        assert!((length(way) / length(&ways[1]) - 1.0).abs() < 0.01);
    }
}

#[test]
fn odd_paths_and_searches_are_told() {
    let land = field(world(32, 32, 10.0), |x, _| x);
    let run = |changes: &str, path: &[[f64; 2]]| {
        let window = *land.window();
        let until = orograph_graph::Cancel::default();
        outputs_and_warnings(&until, window, &NODE, &params(changes, path), &[("height", &land)])
    };
    let (found, warnings) = run("", &[[100.0, 100.0], [1e6, -5.0]]);
    let lines = found.expect("a result").take("lines").expect("lines").as_lines().expect("lines").clone();
    let last = lines.lines[0].vertices.last().expect("an end");
    assert_eq!(last.position_m, [320.0, 0.0]);
    assert!(warnings[0].contains("outside of the world"), "{warnings:?}");
    let (found, _) = run("", &[[100.0, 100.0], [100.0, 100.0]]);
    assert!(found.expect("a result").take("lines").expect("lines").as_lines().expect("lines").lines.is_empty());
    let wide = field(world(260, 260, 10.0), |x, _| x);
    let window = *wide.window();
    let path = [[100.0, 100.0], [200.0, 100.0]];
    let until = orograph_graph::Cancel::default();
    let (found, _) = outputs_and_warnings(&until, window, &NODE, &params("spacing=0.1", &path), &[("height", &wide)]);
    let refused = found.expect_err("too many cells are refused");
    assert!(matches!(&refused, NodeError::Failed { hint: Some(hint), .. } if hint.contains("`spacing` of at least")));
}
