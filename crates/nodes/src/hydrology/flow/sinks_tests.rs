//! Tests of the treatments of depressions, against simple reference implementations and invariants.

use std::{cmp::Reverse, collections::BinaryHeap};

use orograph_graph::{Boundary, Edge, World};

use super::tests::{Drained, area_that_leaves, flow, hills, noise, receivers, with_boundary};
use crate::{
    numerics::routing::{code::is_diagonal, reference},
    prelude::*,
    testing,
};

/// Returns terrains full of depressions, and flats in whole metres, with open and closed sides.
fn lands() -> impl Iterator<Item = Field> {
    let sizes = [(1, 1), (1, 9), (9, 1), (2, 2), (3, 3), (17, 70), (120, 90)];
    sizes.into_iter().flat_map(|(nx, ny)| {
        [Edge::Base, Edge::Open].into_iter().flat_map(move |edge| {
            let world = with_boundary(testing::world(nx, ny, 10.0), Boundary::all(edge));
            let hills = hills(world);
            let terraces = hills.samples().iter().map(|height| (height / 25.0).floor() * 25.0).collect();
            [noise(world), Field::new(*hills.window(), terraces), hills, Field::constant(Window::whole(world), 7.0)]
        })
    })
}

/// A row of cells of 10 m with base level at both ends and walls along it.
fn row(heights: &[f32]) -> Field {
    let sides = Boundary { west: Edge::Base, east: Edge::Base, north: Edge::Wall, south: Edge::Wall };
    let world = World { boundary: sides, ..testing::world(heights.len() as u32, 1, 10.0) };
    Field::new(Window::whole(world), heights.to_vec())
}

fn nowhere_rises(surface: &[f32], receivers: &[Option<usize>]) -> bool {
    receivers.iter().enumerate().all(|(cell, to)| to.is_none_or(|to| surface[to] <= surface[cell]))
}

#[test]
fn every_way_out_drains_all_land_down_its_surface() {
    for land in lands() {
        let window = *land.window();
        let carved = flow(&land, "");
        for changes in
            ["", "depressions=fill", "depressions=breach", "depressions=breach,breach_depth=1e5,breach_length=1e6"]
        {
            let found = flow(&land, changes);
            let receivers = receivers(&land, &found.direction);
            let cells = reference::accumulate(&receivers).expect("no circles");
            let expected: Vec<f32> = cells.iter().map(|&cells| cells as f32 * 100.0).collect();
            assert!(found.area == expected, "{changes}");
            assert_eq!(area_that_leaves(&found), window.len() as f32 * 100.0, "{changes}");
            for cell in (0..window.len()).filter(|&cell| receivers[cell].is_none()) {
                assert!(reference::on_border(window.nx(), window.len(), cell), "{changes}: water stays at {cell}");
            }
            assert!(nowhere_rises(&found.filled, &receivers), "{changes}: water runs uphill");
            assert!(found.filled.iter().zip(&carved.filled).all(|(one, filled)| one <= filled), "{changes}");
            // conditioning a conditioned surface changes nothing
            let again = flow(&Field::new(window, found.filled.clone()), changes);
            assert!(again.filled == found.filled && again.depth.iter().all(|depth| *depth == 0.0), "{changes}");
        }
        assert!(flow(&land, "depressions=fill").filled == carved.filled);
        assert!(flow(&land, "depressions=breach,breach_depth=0").filled == carved.filled);
    }
}

/// Returns the shortest path over level water in units of a fifth of a cell, from where `ends` is true (Dijkstra
/// 1959).
fn shortest(nx: usize, level: &[f32], under: impl Fn(usize) -> bool, ends: impl Fn(usize) -> bool) -> Vec<u32> {
    let mut distance = vec![u32::MAX; level.len()];
    let mut queue: BinaryHeap<_> = (0..level.len()).filter(|&cell| ends(cell)).map(|cell| Reverse((0, cell))).collect();
    while let Some(Reverse((reached, cell))) = queue.pop() {
        if distance[cell] <= reached {
            continue;
        }
        distance[cell] = reached;
        for (way, next) in reference::neighbours(nx, level.len(), cell) {
            if under(next) && level[next] == level[cell] {
                queue.push(Reverse((reached + if is_diagonal(way) { 7 } else { 5 }, next)));
            }
        }
    }
    distance
}

#[test]
fn water_crosses_lakes_by_the_shortest_way() {
    for land in lands() {
        let (nx, filled) = (land.window().nx(), flow(&land, "depressions=fill"));
        let kept = flow(&land, "depressions=keep");
        let receivers_kept = receivers(&land, &kept.direction);
        // cells that drain to a pit and are not above its basin's spill level, which a lake may cover
        let pit = |mut cell: usize| {
            while let Some(next) = receivers_kept[cell] {
                cell = next;
            }
            cell
        };
        let len = land.samples().len();
        let drains = |cell| reference::on_border(nx, len, cell) && kept.direction[cell] == -1.0;
        let level: Vec<f32> = (0..len).map(|cell| filled.filled[pit(cell)]).collect();
        let under = |cell: usize| {
            let bottom = pit(cell);
            !(drains(bottom) && filled.direction[bottom] == -1.0) && land.samples()[cell] <= level[cell]
        };
        let receivers = receivers(&land, &filled.direction);
        let goes_on =
            |cell: usize| under(cell) && receivers[cell].is_none_or(|to| !under(to) || level[to] != level[cell]);
        let expected = shortest(nx, &level, under, goes_on);
        for start in (0..len).filter(|&cell| under(cell)) {
            let (mut cell, mut length) = (start, 0);
            while !goes_on(cell) {
                length += if is_diagonal(filled.direction[cell] as usize) { 7 } else { 5 };
                cell = receivers[cell].expect("goes on inside");
            }
            assert_eq!(length, expected[start], "from {start}");
        }
    }
}

#[test]
fn jumping_water_appears_beyond_the_pass() {
    // the pit in the third cell spills to the west, and the pit in the sixth cell into that basin
    let found = flow(&row(&[0.0, 5.0, 1.0, 4.0, 7.0, 2.0, 9.0, 0.0]), "depressions=jump");
    assert_eq!(found.direction, [-1.0, 4.0, -2.0, 4.0, 0.0, -2.0, 0.0, -1.0]);
    assert_eq!(found.area, [600.0, 500.0, 400.0, 300.0, 100.0, 200.0, 100.0, 200.0]);
}

#[test]
fn jumping_and_carved_rivers_are_equal_where_no_lake_is_below() {
    for land in lands() {
        let (jump, carve, keep) = (flow(&land, "depressions=jump"), flow(&land, ""), flow(&land, "depressions=keep"));
        assert_eq!(area_that_leaves(&jump), land.samples().len() as f32 * 100.0);
        assert!(jump.direction.iter().zip(&keep.direction).all(|(jump, keep)| jump == keep || *jump == -2.0));
        let receivers = receivers(&land, &keep.direction);
        for start in 0..jump.area.len() {
            let mut cell = start;
            while let Some(next) = receivers[cell] {
                cell = next;
            }
            // on an open side, a depression may spill out of the world at any of its cells
            let outside = jump.direction[cell] == -1.0 && carve.direction[cell] == -1.0;
            assert!(!outside || jump.depth[cell] > 0.0 || jump.area[start] == carve.area[start], "at {start}");
        }
    }
}

#[test]
fn cuts_are_straight_and_within_their_limits() {
    let land = row(&[0.0, 4.0, 3.0, 1.0, 6.0, 9.0, 9.0]);
    // from 1 m down to 0 m in three steps, through terrain at 3 m and 4 m
    let cut = |changes: &str| flow(&land, &format!("depressions=breach,{changes}")).filled;
    let third = |n: f64| (n / 3.0) as f32;
    assert_eq!(cut("breach_depth=3.7,breach_length=30"), [0.0, third(1.0), third(2.0), 1.0, 6.0, 9.0, 9.0]);
    let filled = [0.0, 4.0, 4.0, 4.0, 6.0, 9.0, 9.0];
    assert_eq!(cut("breach_depth=3.6,breach_length=30"), filled);
    assert_eq!(cut("breach_depth=3.7,breach_length=29"), filled);
    // ground below base level is filled, whatever the limits
    let hollow = row(&[5.0, 7.0, 2.0, 7.0, 5.0]);
    assert_eq!(flow(&hollow, "depressions=breach,breach_depth=100").filled, [5.0, 7.0, 7.0, 7.0, 5.0]);
}

/// Reference for breaching: recursion instead of an order, and copies of the terrain instead of levels.
fn breached(land: &Field, depth_m: f64, length_m: f64) -> Vec<f32> {
    let (carve, keep) = (flow(land, ""), flow(land, "depressions=keep"));
    let (down, kept) = (receivers(land, &carve.direction), receivers(land, &keep.direction));
    let len = down.len();
    let label = |mut cell: usize| {
        while let Some(next) = kept[cell] {
            cell = next;
        }
        cell
    };
    let labels: Vec<usize> = (0..len).map(label).collect();
    let is_pit = |cell: usize| labels[cell] == cell && down[cell].is_some();
    let mut surface = land.samples().to_vec();
    let mut bed = surface.clone();
    let mut done = vec![false; len];
    let mut sills = vec![false; len];
    for first in (0..len).filter(|&cell| is_pit(cell)) {
        let mut pits = vec![first];
        let beyond = |pit: usize| {
            let mut way = vec![pit];
            while labels[way[way.len() - 1]] == pit {
                way.push(down[way[way.len() - 1]].expect("out of the basin"));
            }
            (way[way.len() - 2], way[way.len() - 1])
        };
        while let Some(&last) = pits.last().filter(|pit| is_pit(**pit) && !done[**pit]) {
            pits.push(labels[beyond(last).1]);
        }
        pits.pop();
        for pit in pits.into_iter().rev() {
            done[pit] = true;
            let (mut way, mut length) = (vec![(pit, 0.0)], 0.0);
            while let Some(next) =
                down[way[way.len() - 1].0].filter(|_| way.len() == 1 || surface[way[way.len() - 1].0] > bed[pit])
            {
                let diagonal = is_diagonal(carve.direction[way[way.len() - 1].0] as usize);
                length += if diagonal { 10.0 * std::f64::consts::SQRT_2 } else { 10.0 };
                way.push((next, length));
            }
            let (from, (end, _)) = (f64::from(bed[pit]), way[way.len() - 1]);
            let line = |at: f64| (from + (f64::from(surface[end]) - from) * (at / length)) as f32;
            let between = &way[1..way.len() - 1];
            let allowed = surface[end] <= bed[pit]
                && length <= length_m
                && between.iter().all(|&(cell, at)| {
                    surface[cell] == bed[cell]
                        && !sills[cell]
                        && f64::from(land.samples()[cell]) - f64::from(line(at)) <= depth_m
                });
            if allowed {
                let lowered: Vec<(usize, f32)> = between.iter().map(|&(cell, at)| (cell, line(at))).collect();
                for (cell, height) in lowered {
                    (surface[cell], bed[cell]) = (height, height);
                }
            } else {
                let (near, far) = beyond(pit);
                let level = surface[near].max(surface[far]);
                sills[if surface[far] > surface[near] { far } else { near }] = true;
                (0..len).filter(|&cell| labels[cell] == pit).for_each(|cell| surface[cell] = surface[cell].max(level));
            }
        }
    }
    surface
}

#[test]
fn breaching_is_the_plain_recursion() {
    for land in lands().filter(|land| land.window().world.boundary.west == Edge::Base) {
        for (depth_m, length_m) in [(10.0, 500.0), (200.0, 40.0), (1e4, 90.0), (1e5, 1e6)] {
            let found = flow(&land, &format!("depressions=breach,breach_depth={depth_m},breach_length={length_m}"));
            assert!(found.filled == breached(&land, depth_m, length_m), "{depth_m}, {length_m}");
        }
    }
}

/// Reference for lakes: a flood fill from the first cell of each.
fn lakes(nx: usize, depth: &[f32]) -> Vec<f32> {
    let mut lakes = vec![0.0; depth.len()];
    let mut count = 0.0;
    for first in 0..depth.len() {
        if depth[first] == 0.0 || lakes[first] > 0.0 {
            continue;
        }
        count += 1.0;
        let mut flood = vec![first];
        while let Some(cell) = flood.pop() {
            lakes[cell] = count;
            let next = reference::neighbours(nx, depth.len(), cell).map(|(_, next)| next);
            flood.extend(next.filter(|&next| depth[next] > 0.0 && lakes[next] == 0.0));
        }
    }
    lakes
}

#[test]
fn lakes_are_numbered_by_their_first_cells_and_level() {
    for land in lands() {
        let Drained { filled, depth, lake, .. } = flow(&land, "");
        assert!(lake == lakes(land.window().nx(), &depth));
        for number in 1..=lake.iter().fold(0.0, |most: f32, &lake| most.max(lake)) as usize {
            let mut levels =
                filled.iter().zip(&lake).filter(|(_, lake)| **lake == number as f32).map(|(level, _)| level);
            let level = levels.next().expect("numbers have no gaps");
            assert!(levels.all(|other| other == level), "a lake is level");
        }
    }
}

#[test]
fn a_lake_across_a_periodic_side_is_one() {
    let sides = Boundary { west: Edge::Periodic, east: Edge::Periodic, north: Edge::Base, south: Edge::Base };
    let world = with_boundary(testing::world(12, 9, 5.0), sides);
    // a hollow across the periodic sides, deepest halfway between the base levels
    let hollow = testing::field(world, |x, y| 10.0 + x.min(60.0 - x) - (22.5 - (y - 22.5).abs()) / 3.0);
    let found = flow(&hollow, "depressions=fill");
    assert_eq!((found.lake[4 * 12], found.lake[4 * 12 + 11]), (1.0, 1.0));
    assert!(found.lake.iter().all(|lake| *lake <= 1.0));
    assert_eq!(area_that_leaves(&found), 12.0 * 9.0 * 25.0);
}

#[test]
fn spreading_water_crosses_what_was_cut_and_filled() {
    for land in lands() {
        let all = land.samples().len() as f32 * 100.0;
        for routing in ["d_infinity", "mfd"] {
            for sinks in ["fill", "breach"] {
                let left = area_that_leaves(&flow(&land, &format!("routing={routing},depressions={sinks}")));
                // 1e-5: sums of areas in single precision
                assert!((left / all - 1.0).abs() < 1e-5, "{routing}, {sinks}: {left} of {all}");
            }
        }
    }
}

#[test]
fn jumping_and_spreading_are_refused_together() {
    let params = testing::with_params(&super::NODE, "routing=mfd,depressions=jump");
    let land = noise(testing::world(8, 8, 1.0));
    let error = testing::outputs(&super::NODE, &params, &[("height", &land)]).expect_err("makes no sense");
    assert!(matches!(&error, NodeError::Failed { hint: Some(hint), .. } if hint.contains("d8")), "{error}");
}

#[test]
fn the_same_for_any_thread_count() {
    let world = testing::world(150, 200, 10.0);
    let (height, runoff) = (hills(world), noise(world));
    let fields = [("height", &height), ("runoff", &runoff)];
    for sinks in ["fill", "breach", "jump"] {
        let params = testing::with_params(&super::NODE, &format!("depressions={sinks}"));
        assert_eq!(
            testing::run_in(1, &super::NODE, &params, &fields),
            testing::run_in(7, &super::NODE, &params, &fields)
        );
    }
}
