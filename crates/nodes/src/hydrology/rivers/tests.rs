//! Tests of rivers: drawn networks, closed forms, simple references, real terrain.

use orograph_graph::{Boundary, Edge, Lines, World};

use super::{super::flow, NODE};
use crate::numerics::{drained::Drained, routing::code::STEPS};
use crate::{prelude::*, testing};

/// Builds a flow from drawn directions: the digits of a numeric keypad as arrows, `.` for an end. Cells are 10 m, areas
/// are counted, discharge is 1 m³/s per cell, and every step falls by 1 m.
fn drawn(rows: &[&str]) -> Field {
    let (nx, ny) = (rows[0].len(), rows.len());
    let window = Window::whole(testing::world(nx as u32, ny as u32, 10.0));
    let way = |c: char| "69874123".find(c).map_or(-1.0, |at| at as f32);
    let direction: Vec<f32> = rows.iter().flat_map(|row| row.chars().map(way)).collect();
    let next = |cell: usize| {
        let (dx, dy) = *STEPS.get(usize::try_from(direction[cell] as i32).ok()?)?;
        Some((cell as i32 + dy * nx as i32 + dx) as usize)
    };
    let mut cells = vec![0.0_f32; nx * ny];
    let mut level = vec![0.0; nx * ny];
    for (start, level) in level.iter_mut().enumerate() {
        let mut at = Some(start);
        while let Some(cell) = at {
            cells[cell] += 1.0;
            at = next(cell);
            *level += 1.0;
        }
    }
    let area: Vec<f32> = cells.iter().map(|cells| cells * 100.0).collect();
    Drained { direction: &direction, area_m2: &area, discharge_m3_per_s: &cells, level_m: &level }.field(window)
}

struct Found {
    mask: Vec<f32>,
    order: Vec<f32>,
    width: Vec<f32>,
    depth: Vec<f32>,
    cover: Vec<f32>,
    lines: Lines,
}

fn rivers(flow: &Field, changes: &str) -> Found {
    let params = testing::with_params(&NODE, changes);
    let mut outputs = testing::outputs(&NODE, &params, &[("flow", flow)]).expect("a result");
    let lines = outputs.take("lines").expect("an output").as_lines().expect("lines").clone();
    let mut take = |name| outputs.take(name).expect("an output").as_field().expect("a field").clone().into_samples();
    Found {
        mask: take("mask"),
        order: take("order"),
        width: take("width"),
        depth: take("depth"),
        cover: take("cover"),
        lines,
    }
}

fn flow_of(height: &Field, changes: &str) -> Field {
    testing::run(&flow::NODE, &testing::with_params(&flow::NODE, changes), &[("height", height)], "flow")
}

/// Hills with closed depressions, as a function of position.
fn hills(world: World) -> Field {
    let wave = |at: f64, length_m: f64| 0.5 - ((at / length_m).fract() - 0.5).abs();
    testing::field(world, |x, y| {
        let grain = f64::from(orograph_graph::mix((x * 8.0) as u32 ^ orograph_graph::mix((y * 8.0) as u32))) * 2e-9;
        100.0 + 200.0 * wave(x, 710.0) * wave(y + 0.3 * x, 570.0) + grain
    })
}

/// Real terrain without depressions.
fn tujunga() -> Field {
    let path = format!("{}/../../tests/data/bigtujunga_drained_256.f32", env!("CARGO_MANIFEST_DIR"));
    let bytes = std::fs::read(&path).expect(&path);
    let heights = bytes.chunks_exact(4).map(|bytes| f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]));
    Field::new(Window::whole(testing::world(256, 256, 30.0)), heights.collect())
}

#[test]
fn orders_of_a_tree_drawn_by_hand() {
    // two rivers of order 1 form one of order 2; a third does not change it; two of order 2 form one of order 3
    let flow = drawn(&[
        "3.1.3.1", //
        ".3...1.", //
        ".63.1..", //
        "...2...", //
        ".......",
    ]);
    let all = rivers(&flow, "channel_area=0,simplify=0,smooth=0");
    assert!(all.mask.iter().all(|mask| *mask == 1.0));
    let order = |x: usize, y: usize| all.order[y * 7 + x];
    assert_eq!([order(0, 0), order(2, 0), order(4, 0), order(6, 0), order(1, 2)], [1.0; 5]);
    assert_eq!([order(1, 1), order(2, 2), order(5, 1), order(4, 2)], [2.0; 4]);
    assert_eq!([order(3, 3), order(3, 4)], [3.0; 2]);
    // Nine links: five heads and four junctions, in the order of their first cells.
    let orders: Vec<u32> = all.lines.lines.iter().map(|line| line.order).collect();
    let next: Vec<Option<u32>> = all.lines.lines.iter().map(|line| line.downstream).collect();
    assert_eq!(orders, [1, 1, 1, 1, 2, 2, 1, 2, 3]);
    assert_eq!(next, [4, 4, 5, 5, 7, 8, 7, 8, 9].map(|next| Some(next).filter(|&next| next < 9)));
}

/// Reference for the Strahler order, from the highest cell downstream.
fn strahler(flow: &Drained<'_>, mask: &[f32], nx: usize) -> Vec<f32> {
    let mut cells: Vec<usize> = (0..mask.len()).filter(|&cell| mask[cell] > 0.0).collect();
    // area grows downstream, so that all inflow is known before
    cells.sort_by(|a, b| flow.area_m2[*a].total_cmp(&flow.area_m2[*b]));
    let mut incoming: Vec<Vec<u8>> = vec![Vec::new(); mask.len()];
    let mut orders = vec![0.0; mask.len()];
    for cell in cells {
        let highest = incoming[cell].iter().max().copied().unwrap_or(0);
        let several = incoming[cell].iter().filter(|&&order| order == highest).count() > 1;
        let order = if highest == 0 { 1 } else { highest + u8::from(several) };
        orders[cell] = f32::from(order);
        if let Some(way) = flow.way(cell) {
            let (dx, dy) = STEPS[way];
            incoming[(cell as i32 + dy * nx as i32 + dx) as usize].push(order);
        }
    }
    orders
}

#[test]
fn orders_are_those_of_the_definition() {
    for (height, nx) in [(tujunga(), 256), (hills(testing::world(150, 110, 10.0)), 150)] {
        let flow = flow_of(&height, "");
        for changes in ["channel_area=0", "channel_area=3000", "heads=slope_area,channel_constant=300"] {
            let found = rivers(&flow, changes);
            assert!(found.order == strahler(&Drained::read(&flow), &found.mask, nx), "{changes}");
        }
    }
}

/// On real terrain each order has three to five times as many rivers as the next (Horton 1945).
#[test]
fn real_rivers_branch_as_hortons_law_says() {
    let found = rivers(&flow_of(&tujunga(), ""), "channel_area=20000");
    let begins = |order: u32| {
        let of = |line: &&orograph_graph::Line| line.order == order;
        let lines = found.lines.lines.iter().enumerate().filter(|(_, line)| of(line));
        // a river of an order is a chain of lines: counts those without inflow of the same order
        let into: Vec<usize> =
            found.lines.lines.iter().filter(of).filter_map(|line| line.downstream.map(|next| next as usize)).collect();
        lines.filter(|(at, _)| !into.contains(at)).count() as f64
    };
    for order in 1..4 {
        let ratio = begins(order) / begins(order + 1);
        assert!((2.5..6.5).contains(&ratio), "{ratio} rivers of order {order} for one of the next");
    }
}

#[test]
fn a_channel_goes_on_and_begins_where_the_threshold_is_passed() {
    let world =
        World { boundary: Boundary { west: Edge::Base, ..Boundary::all(Edge::Wall) }, ..testing::world(40, 1, 10.0) };
    // a slope of 0.2 to the west: A S² is 4 m² per cell
    let ramp = testing::field(world, |x, _| 0.2 * x);
    let flow = flow_of(&ramp, "");
    let begins = |changes: &str| rivers(&flow, changes).mask.iter().rposition(|mask| *mask > 0.0);
    assert_eq!(begins("channel_area=950"), Some(30), "ten cells above");
    // 49: more than twelve cells, so that rounding of heights does not matter
    assert_eq!(begins("heads=slope_area,channel_constant=49"), Some(27));
    // below the head the slope may decrease
    let step = testing::field(world, |x, _| if x > 200.0 { 0.2 * x } else { 40.0 + 1e-3 * x });
    let mask = rivers(&flow_of(&step, ""), "heads=slope_area,channel_constant=39").mask;
    assert!(mask[..30].iter().all(|mask| *mask == 1.0) && mask[31..].iter().all(|mask| *mask == 0.0));
}

#[test]
fn widths_and_depths_follow_discharge() {
    let flow = drawn(&["66666666666666666666.", "....................."]);
    let found = rivers(&flow, "channel_area=150,width=6,depth=0.4");
    assert_eq!((found.width[0], found.depth[0]), (0.0, 0.0), "no channel there");
    for (cell, discharge) in (1..20).map(|cell| (cell, cell as f32 + 1.0)) {
        // 1e-6: a power in single precision
        assert!((found.width[cell] / (6.0 * discharge.sqrt()) - 1.0).abs() < 1e-6);
    }
    // 32^0.4 is 4.
    let long = drawn(&["6666666666666666666666666666666666."]);
    assert!((rivers(&long, "channel_area=0").depth[31] - 2.0).abs() < 1e-5);
}

#[test]
fn lines_meet_and_fall_and_have_every_channel_once() {
    let land = [tujunga(), hills(testing::world(150, 110, 10.0)), hills(testing::world(1, 40, 10.0))];
    for height in land {
        let flow = flow_of(&height, "");
        let (window, drained) = (*height.window(), Drained::read(&flow));
        let raw = rivers(&flow, "channel_area=3000,simplify=0,smooth=0");
        let links = (0..raw.mask.len()).filter(|&cell| raw.mask[cell] > 0.0 && drained.way(cell).is_some()).count();
        let pieces = |lines: &Lines| lines.lines.iter().map(|line| line.vertices.len() - 1).sum::<usize>();
        assert_eq!(pieces(&raw.lines), links);
        for changes in ["simplify=0,smooth=0", "simplify=20,smooth=5", "simplify=100,smooth=0"] {
            let lines = rivers(&flow, &format!("channel_area=3000,{changes}")).lines.lines;
            assert_eq!(lines.len(), raw.lines.lines.len());
            for (line, plain) in lines.iter().zip(&raw.lines.lines) {
                let ends = |line: &orograph_graph::Line| (line.vertices[0], *line.vertices.last().expect("two"));
                assert_eq!((ends(line), line.downstream), (ends(plain), plain.downstream), "ends stay");
                for pair in line.vertices.windows(2) {
                    assert!(pair[1].elevation_m <= pair[0].elevation_m && pair[1].area_m2 >= pair[0].area_m2);
                }
                let (first, last) = ends(line);
                if let Some(next) = line.downstream.map(|next| &lines[next as usize]) {
                    assert_eq!(
                        (next.vertices[0].position_m, next.vertices[0].elevation_m),
                        (last.position_m, last.elevation_m)
                    );
                    assert!(next.order >= line.order && next.vertices[0].area_m2 > last.area_m2);
                }
                let cell = |at: [f64; 2]| {
                    (at[1] / window.cell_m()) as usize * window.nx() + (at[0] / window.cell_m()) as usize
                };
                assert_eq!(raw.order[cell(first.position_m)], line.order as f32);
            }
        }
    }
}

#[test]
fn rivers_cover_their_width() {
    let flow = drawn(&[
        "....................",
        "....................",
        "6666666666666666666.",
        "....................",
        "....................",
    ]);
    for (width, simplify) in [(1.0, 0.0), (7.0, 50.0)] {
        // width grows with the square root of discharge from 1 to 20; simplification makes it linear
        let found = rivers(&flow, &format!("channel_area=150,width={width},simplify={simplify},smooth=0"));
        for x in 3..18 {
            let column: f64 = (0..5).map(|y| f64::from(found.cover[y * 20 + x])).sum::<f64>() * 10.0;
            let expected = if simplify == 0.0 {
                f64::from(found.width[2 * 20 + x])
            } else {
                let (from, to) = (width * 2.0_f64.sqrt(), width * 20.0_f64.sqrt());
                from + (to - from) * (x as f64 - 1.0) / 18.0
            };
            // 1e-5: fractions in single precision
            assert!((column / expected - 1.0).abs() < 1e-5, "column {x}: {column} m of {expected} m");
        }
    }
}

#[test]
fn lines_go_on_over_periodic_sides() {
    let sides = Boundary { west: Edge::Periodic, east: Edge::Periodic, north: Edge::Wall, south: Edge::Base };
    let world = World { boundary: sides, ..testing::world(30, 20, 10.0) };
    // downhill to the south-east, across the periodic side
    let slope = testing::field(world, |x, y| 500.0 - 1.9 * y - (x - 3.0 * y).rem_euclid(300.0) * 0.01);
    let found = rivers(&flow_of(&slope, ""), "channel_area=0,simplify=0,smooth=0");
    let longest = found.lines.lines.iter().flat_map(|line| line.vertices.windows(2)).map(|pair| {
        (pair[1].position_m[0] - pair[0].position_m[0]).abs().max((pair[1].position_m[1] - pair[0].position_m[1]).abs())
    });
    assert!(longest.fold(0.0, f64::max) <= 10.0, "no piece leaps across the world");
}

#[test]
fn worlds_without_rivers_have_none() {
    let sea = testing::field(testing::world(30, 20, 10.0), |_, _| -50.0);
    let found = rivers(&flow_of(&sea, ""), "");
    assert!(found.lines.lines.is_empty() && found.mask.iter().chain(&found.cover).all(|mask| *mask == 0.0));
    let dry = flow_of(&hills(testing::world(60, 40, 10.0)), "depressions=keep");
    let params = testing::with_params(&flow::NODE, "depressions=fill");
    let none = Field::constant(*dry.window(), 0.0);
    let height = hills(testing::world(60, 40, 10.0));
    let dry = testing::run(&flow::NODE, &params, &[("height", &height), ("runoff", &none)], "flow");
    let found = rivers(&dry, "channel_area=1000");
    assert!(found.width.iter().chain(&found.depth).chain(&found.cover).all(|width| *width == 0.0));
    assert!(found.mask.contains(&1.0), "dry valleys");
    for changes in ["depressions=keep", "depressions=jump", "depressions=breach", "routing=mfd"] {
        let lines = rivers(&flow_of(&height, changes), "channel_area=1000").lines.lines;
        assert!(lines.iter().all(|line| line.vertices.len() >= 2), "{changes}");
    }
}

#[test]
fn the_same_for_any_thread_count_and_simd_level() {
    let flow = flow_of(&hills(testing::world(190, 170, 10.0)), "");
    let params = testing::with_params(&NODE, "channel_area=2000");
    let fields = [("flow", &flow)];
    assert_eq!(testing::run_in(1, &NODE, &params, &fields), testing::run_in(7, &NODE, &params, &fields));
    testing::at_every_level(|| testing::outputs(&NODE, &params, &fields));
}
