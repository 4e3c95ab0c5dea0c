//! Tests of lakes: levels against the priority flood, rings against closed forms, directions against distances, edge
//! cases.

use orograph_graph::{Area, Boundary, Cancel, Edge, Lines, Value, Vertex, World};

use super::{super::flow, NODE};
use crate::{
    numerics::{math, routing::reference},
    prelude::*,
    testing,
};

const ALL: &str = "smallest=0,shallowest=0";

struct Found {
    level: Vec<f32>,
    depth: Vec<f32>,
    mask: Vec<f32>,
    shore: Vec<f32>,
    lake: Vec<f32>,
    flow: Vec<f32>,
    outlines: Lines,
    report: Report,
}

/// The areas of the outlines, as many as there must be.
fn areas<const N: usize>(found: &Found) -> [Area; N] {
    <[Area; N]>::try_from(&found.outlines.areas[..]).expect("as many lakes")
}

fn lakes(height: &Field, changes: &str) -> Found {
    let params = testing::with_params(&NODE, changes);
    let mut outputs = testing::outputs(&NODE, &params, &[("height", height)]).expect("a result");
    let value = |outputs: &mut Outputs, name: &str| outputs.take(name).expect("an output");
    let outlines = value(&mut outputs, "outlines").as_lines().expect("lines").clone();
    let report = value(&mut outputs, "report").as_report().expect("a report").clone();
    let mut take = |name| value(&mut outputs, name).as_field().expect("a field").clone().into_samples();
    Found {
        level: take("level"),
        depth: take("depth"),
        mask: take("mask"),
        shore: take("shore"),
        lake: take("lake"),
        flow: take("flow"),
        outlines,
        report,
    }
}

/// Land of 10 m, drawn: digits are heights in metres, `~` is 0 and everything else 9.
fn drawn(rows: &[&str]) -> Field {
    let window = Window::whole(testing::world(rows[0].len() as u32, rows.len() as u32, 10.0));
    let height = |c: char| if c == '~' { 0.0 } else { c.to_digit(10).map_or(9.0, |digit| digit as f32) };
    Field::new(window, rows.iter().flat_map(|row| row.chars().map(height)).collect())
}

/// Hills with closed hollows.
fn hills(world: World) -> Field {
    let wave = |at: f64, length_m: f64| 0.5 - ((at / length_m).fract() - 0.5).abs();
    testing::field(world, |x, y| {
        let grain = f64::from(orograph_graph::mix((x * 8.0) as u32 ^ orograph_graph::mix((y * 8.0) as u32))) * 2e-9;
        100.0 + 200.0 * wave(x, 710.0) * wave(y + 0.3 * x, 570.0) + grain
    })
}

/// Returns twice the area of a ring with north up, in square metres, after checking that it is closed, passes no point
/// twice and turns at every vertex.
fn checked_ring(vertices: &[Vertex]) -> f64 {
    let points: Vec<[f64; 2]> = vertices.iter().map(|vertex| vertex.position_m).collect();
    assert_eq!(points.first(), points.last(), "closed");
    let mut sorted: Vec<[u64; 2]> = points[1..].iter().map(|point| point.map(f64::to_bits)).collect();
    sorted.sort_unstable();
    sorted.dedup();
    assert_eq!(sorted.len(), points.len() - 1, "a point is passed twice");
    for (at, pair) in points.windows(2).enumerate() {
        let after = points[1..][(at + 1) % (points.len() - 1)];
        let along = |from: [f64; 2], to: [f64; 2]| usize::from(from[0] == to[0]);
        assert!(pair[0][0] == pair[1][0] || pair[0][1] == pair[1][1], "along an edge");
        assert_ne!(along(pair[0], pair[1]), along(pair[1], after), "a vertex on a straight line");
    }
    points.windows(2).map(|pair| pair[1][0] * pair[0][1] - pair[0][0] * pair[1][1]).sum()
}

/// Checks the rings of all lakes, and that they enclose each lake's area.
fn check_rings(found: &Found, cell_m: f64) {
    assert_eq!(found.outlines.areas.len() as f32, found.lake.iter().copied().fold(0.0, f32::max));
    let mut used = 0;
    for (number, (area, rings)) in found.outlines.rings().enumerate() {
        used += rings.len();
        let doubled: Vec<f64> = rings.iter().map(|ring| checked_ring(&ring.vertices)).collect();
        assert!(doubled[0] > 0.0, "the outer ring runs counter-clockwise");
        assert!((0.5 * doubled.iter().sum::<f64>() - area.area_m2).abs() < 1e-6 * area.area_m2);
        let cells = found.lake.iter().filter(|lake| **lake == number as f32 + 1.0).count();
        assert!((area.area_m2 - cells as f64 * cell_m * cell_m).abs() < 1e-6);
    }
    assert_eq!(used, found.outlines.lines.len());
}

#[test]
fn levels_are_those_of_the_priority_flood_and_numbers_those_of_flow() {
    let height = hills(testing::world(150, 110, 10.0));
    let found = lakes(&height, ALL);
    let (nx, land) = (150, height.samples());
    let flooded = reference::priority_flood(nx, land, |cell| reference::on_border(nx, land.len(), cell));
    assert!(found.level == flooded && found.report.get("lakes").is_some_and(|count| count > 3.0));
    let flow = testing::with_params(&flow::NODE, "depressions=fill");
    let of_flow = |output| testing::run(&flow::NODE, &flow, &[("height", &height)], output).into_samples();
    assert!(found.lake == of_flow("lake") && found.depth == of_flow("lake_depth"));
    assert!(found.mask.iter().zip(&found.depth).all(|(mask, depth)| (*mask == 1.0) == (*depth > 0.0)));
    check_rings(&found, 10.0);
    for area in &found.outlines.areas {
        let [x, y] = area.spill_m.map(|at| (at / 10.0) as usize);
        assert_eq!(land[y * nx + x], area.level_m as f32, "the sill is as high as the water");
        assert_eq!((found.depth[y * nx + x], found.shore[y * nx + x]), (0.0, 1.0));
    }
    let volume: f64 = found.depth.iter().map(|&depth| f64::from(depth) * 100.0).sum();
    assert!((found.report.get("volume").expect("a measure") / volume - 1.0).abs() < 1e-12);
}

#[test]
fn an_island_is_a_hole_that_runs_clockwise() {
    // the sill is the 5 to the south; the island has a pond of its own level
    let found = lakes(
        &drawn(&[
            "9999999999", //
            "9~~~~~~~~9",
            "9~~~~~~~~9",
            "9~~888~~~9",
            "9~~868~~~9",
            "9~~888~~~9",
            "9~~~~~~~~9",
            "9999599999",
            "9999399999",
        ]),
        ALL,
    );
    check_rings(&found, 10.0);
    let [lake, pond] = areas(&found);
    assert_eq!((lake.rings, lake.level_m, lake.depth_m, lake.area_m2), (2, 5.0, 5.0, 3900.0));
    assert_eq!((lake.volume_m3, lake.spill_m), (19_500.0, [45.0, 75.0]));
    assert_eq!((pond.rings, pond.level_m, pond.area_m2, pond.volume_m3), (1, 8.0, 100.0, 200.0));
    let hole: Vec<[f64; 2]> = found.outlines.lines[1].vertices.iter().map(|vertex| vertex.position_m).collect();
    assert_eq!(hole.len(), 5);
    assert!(checked_ring(&found.outlines.lines[1].vertices) < 0.0);
    assert!(hole.contains(&[30.0, 30.0]) && hole.contains(&[60.0, 60.0]));
    assert!(found.outlines.lines.iter().flat_map(|ring| &ring.vertices).all(|vertex| vertex.elevation_m >= 5.0));
}

#[test]
fn parts_that_touch_at_corners_are_polygons_of_one_lake() {
    // two squares that touch at a corner; an island that touches the shore at a corner; two islands that touch
    let found = lakes(
        &drawn(&[
            "99999999999", //
            "9~~99999999",
            "9~~99999999",
            "999~~~~~~~9",
            "999~8~~~~~9",
            "999~~8~~~~9",
            "999~~~~~8~9",
            "999~~~~~~89",
            "99999499999",
        ]),
        ALL,
    );
    check_rings(&found, 10.0);
    let [lake] = areas(&found);
    let signs: Vec<bool> = found.outlines.lines.iter().map(|ring| checked_ring(&ring.vertices) > 0.0).collect();
    assert_eq!((lake.rings, signs.iter().filter(|outer| **outer).count()), (5, 2));
    assert_eq!(signs, [true, true, false, false, false]);
}

#[test]
fn nested_hollows_are_one_lake_and_a_chain_has_its_own_levels() {
    // the two western hollows join over a 3; the eastern one is lower and gets their water over the 6
    let found = lakes(&drawn(&["9999999999", "9~~3~~6119", "9999999994", "9999999999"]), ALL);
    let levels: Vec<(f64, [f64; 2])> = found.outlines.areas.iter().map(|area| (area.level_m, area.spill_m)).collect();
    assert_eq!(levels, [(6.0, [65.0, 15.0]), (4.0, [95.0, 25.0])]);
    check_rings(&found, 10.0);
    assert_eq!(found.lake[10..20], [0.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0, 2.0, 2.0, 0.0]);
}

/// Around a headland the way is the shortest one: its length along the directions is that of the path by hand.
#[test]
fn water_moves_along_the_shortest_way_to_the_spill_point() {
    let world = testing::world(60, 60, 10.0);
    // a lake of 50 x 50 cells that spills in the middle of its west side
    let basin = testing::field(world, |x, y| {
        let inside = (50.0..550.0).contains(&x) && (50.0..550.0).contains(&y);
        if inside {
            0.0
        } else if x < 50.0 && (y - 305.0).abs() < 1.0 {
            10.0 - (50.0 - x) * 0.01
        } else {
            90.0
        }
    });
    let found = lakes(&basin, ALL);
    let area = found.outlines.areas[0];
    assert_eq!(area.spill_m, [45.0, 305.0]);
    let mut worst = [0.0_f64; 2];
    for (cell, mask) in found.mask.iter().enumerate().filter(|(_, mask)| **mask > 0.0) {
        let at = [cell % 60, cell / 60].map(|at| at as f64 * 10.0 + 5.0);
        let to = [area.spill_m[0] - at[0], area.spill_m[1] - at[1]];
        let length = math::hypot(to[0], to[1]);
        let [east, south] = [found.flow[cell], found.flow[3600 + cell]].map(f64::from);
        assert!((math::hypot(east, south) - 1.0).abs() < 1e-5 && *mask == 1.0);
        // beside the shore the way bends into the gap of the spill point
        if length > 30.0 && to[1].abs() <= to[0].abs() {
            let error = 1.0 - (east * to[0] + south * to[1]) / length;
            worst[usize::from(length > 150.0)] = worst[usize::from(length > 150.0)].max(error);
        }
    }
    // 9° and 7.5°: the scheme is of the first order, and the source a point
    assert!(worst[0] < 0.0125 && worst[1] < 0.0085, "{worst:?}");

    // a wall from the north side: cells behind it swim around its end
    let walled = testing::field(world, |x, y| {
        let wall = (300.0..320.0).contains(&x) && y < 450.0;
        let inside = (50.0..550.0).contains(&x) && (50.0..550.0).contains(&y) && !wall;
        if inside {
            0.0
        } else if x < 50.0 && (y - 105.0).abs() < 1.0 {
            10.0 - (50.0 - x) * 0.01
        } else {
            90.0
        }
    });
    let found = lakes(&walled, ALL);
    let start = 10 * 60 + 50;
    let (mut at, mut towards, mut length) = ([505.0, 105.0], [0.0; 2], 0.0);
    while math::hypot(at[0] - 45.0, at[1] - 105.0) > 5.0 && length < 3000.0 {
        let cell = (at[1] / 10.0) as usize * 60 + (at[0] / 10.0) as usize;
        // past a corner of the shore, straight on
        if found.mask[cell] > 0.0 {
            towards = [found.flow[cell], found.flow[3600 + cell]].map(f64::from);
        }
        at = [at[0] + towards[0], at[1] + towards[1]];
        length += 1.0;
    }
    assert!(found.flow[3600 + start] > 0.5, "southwards first");
    // straight to the end of the wall at its two corners, then straight to the spill point
    let around = math::hypot(505.0 - 320.0, 345.0) + 20.0 + math::hypot(300.0 - 45.0, 345.0);
    assert!((length / around - 1.0).abs() < 0.04, "{length} m of {around} m");
}

#[test]
fn directions_on_land_are_those_of_flow() {
    let height = hills(testing::world(90, 70, 10.0));
    let found = lakes(&height, ALL);
    let params = testing::with_params(&flow::NODE, "");
    let direction = testing::run(&flow::NODE, &params, &[("height", &height)], "direction");
    for (cell, &way) in direction.samples().iter().enumerate().filter(|(cell, _)| found.mask[*cell] == 0.0) {
        let [east, south] = [found.flow[cell], found.flow[90 * 70 + cell]];
        let (dx, dy) = if way < 0.0 { (0, 0) } else { crate::numerics::routing::code::STEPS[way as usize] };
        let sign = |v: f32| if v == 0.0 { 0 } else { v.signum() as i32 };
        assert_eq!((sign(east), sign(south)), (dx, dy));
    }
}

#[test]
fn small_and_shallow_hollows_are_land() {
    let land = drawn(&["999999999", "9~~97~999", "9~~999989", "999999999"]);
    let count = |changes: &str| lakes(&land, changes).report.get("lakes").expect("a measure");
    assert_eq!((count(ALL), count("smallest=300,shallowest=0"), count("smallest=500,shallowest=0")), (3.0, 1.0, 0.0));
    assert_eq!(count("smallest=0,shallowest=5"), 2.0);
    let none = lakes(&land, "smallest=500,shallowest=0");
    assert!(none.level == land.samples() && none.depth.iter().chain(&none.mask).chain(&none.shore).all(|v| *v == 0.0));
    assert_eq!((none.report.get("hollows_without_lake"), none.outlines.lines.len()), (Some(3.0), 0));
}

#[test]
fn flat_land_slopes_single_rows_and_seas_have_no_lakes() {
    let row =
        World { boundary: Boundary { west: Edge::Base, ..Boundary::all(Edge::Wall) }, ..testing::world(40, 1, 10.0) };
    let slope = testing::field(row, |x, _| x);
    let flat = testing::field(testing::world(30, 20, 10.0), |_, _| 7.0);
    let sea = testing::at_sea(&hills(testing::world(60, 40, 10.0)), 1000.0);
    let single = testing::field(testing::world(1, 1, 10.0), |_, _| 3.0);
    for height in [slope, flat, sea, single] {
        let found = lakes(&height, ALL);
        assert!(found.level == height.samples() && found.outlines == Lines::default());
        assert_eq!((found.report.get("lakes"), found.report.get("greatest_depth")), (Some(0.0), Some(0.0)));
    }
    // a lake in a single row
    let dip = testing::field(row, |x, _| if (100.0..200.0).contains(&x) { 0.0 } else { x });
    let found = lakes(&dip, ALL);
    check_rings(&found, 10.0);
    let [lake] = areas(&found);
    assert_eq!((lake.area_m2, lake.level_m, lake.spill_m), (1000.0, 95.0, [95.0, 5.0]));
    assert!(found.flow[10..20].iter().all(|east| *east == -1.0));
}

#[test]
fn voids_are_filled_and_worlds_without_outlet_refused() {
    let height = hills(testing::world(60, 40, 10.0));
    let mut samples = height.samples().to_vec();
    samples[20 * 60 + 30] = f32::NAN;
    samples[3] = f32::INFINITY;
    let found = lakes(&Field::new(*height.window(), samples), ALL);
    assert!(found.level.iter().chain(&found.depth).chain(&found.flow).all(|v| v.is_finite()));
    check_rings(&found, 10.0);
    let nothing = Field::constant(*height.window(), f32::NAN);
    assert_eq!(lakes(&nothing, ALL).outlines.lines.len(), 0);
    let closed = hills(World { boundary: Boundary::all(Edge::Wall), ..testing::world(30, 20, 10.0) });
    let error = testing::outputs(&NODE, &testing::with_params(&NODE, ""), &[("height", &closed)]);
    assert!(error.is_err_and(|error| error.to_string().contains("no side of the world lets water out")));
}

#[test]
fn lakes_across_periodic_sides_are_cut_there() {
    let sides = Boundary { west: Edge::Periodic, east: Edge::Periodic, north: Edge::Base, south: Edge::Base };
    let land = drawn(&["9999999999", "~~999999~~", "~~999999~~", "9999999999", "9999999999"]);
    let window = *land.window();
    let world = World { boundary: sides, ..window.world };
    let land = Field::new(Window { world, ..window }, land.into_samples());
    let found = lakes(&land, ALL);
    let [lake] = areas(&found);
    assert_eq!((lake.rings, lake.area_m2, lake.level_m), (2, 800.0, 9.0));
    check_rings(&found, 10.0);
}

#[test]
fn the_same_for_any_thread_count_and_simd_level() {
    let height = hills(testing::world(190, 170, 10.0));
    let params = testing::with_params(&NODE, ALL);
    let fields = [("height", &height)];
    assert_eq!(testing::run_in(1, &NODE, &params, &fields), testing::run_in(7, &NODE, &params, &fields));
    testing::at_every_level(|| testing::outputs(&NODE, &params, &fields));
    let cancel = Cancel::default();
    cancel.cancel();
    let stopped = testing::outputs_until(&cancel, *height.window(), &NODE, &params, &fields);
    assert!(matches!(stopped, Err(NodeError::Cancelled)));
    let wanted = orograph_graph::Wanted::NONE.with(6);
    let alone = testing::outputs_wanted(wanted, &Cancel::default(), *height.window(), &NODE, &params, &fields).0;
    let names: Vec<(&str, Value)> = alone.expect("a result").into_iter_named().collect();
    assert!(names.len() == 1 && names[0].0 == "outlines");
}
