//! Parts of the world: halos, unions, crops.

use super::*;
use crate::{Boundary, Edge};

/// The average with the next three cells to the east, across the boundary where it is periodic.
static EASTWARD: Node = Node {
    id: "Eastward",
    inputs: ONE,
    outputs: HEIGHT,
    reach: Reach::Metres(|_, cell_m| 3.0 * cell_m),
    cpu: |job| {
        let (field, window) = (crate::InputReader::new(job).required::<Field>("height")?, job.window());
        let wraps = job.world().boundary.east == Edge::Periodic && window.nx() == job.world().cells[0] as usize;
        height(job, |i, j| {
            let at = |i: usize| if wraps { i % window.nx() } else { i.min(window.nx() - 1) };
            (0..4).map(|k| field.samples()[j * window.nx() + at(i + k)]).sum::<f32>() / 4.0
        })
    },
    ..Node::DEFAULT
};

fn chain() -> Graph {
    Build::default()
        .node("base", &WAVES, &[])
        .node("one", &BLUR, &[("height", "base")])
        .node("two", &BLUR, &[("height", "one")])
        .set("two", "radius", ParamValue::Float(6.5))
        .node("sum", &ADD, &[("height", "two"), ("other", "base")])
        .0
}

#[test]
fn a_part_equals_the_same_part_of_the_whole() {
    let whole = Window::whole(world(64));
    let graph = chain();
    let all = run(&evaluator(2), &graph, &["sum"], whole).expect("runs").values.remove(0);
    let all = all.as_field().expect("a field");
    // in the middle, at two edges, a single cell, everything but the border
    for (origin, cells) in [([20, 24], [16, 8]), ([0, 50], [10, 14]), ([63, 0], [1, 1]), ([1, 1], [62, 62])] {
        let part = Window { origin, cells, ..whole };
        let got = run(&evaluator(2), &graph, &["sum"], part).expect("runs").values.remove(0);
        assert_eq!(got.as_field().expect("a field"), &all.crop(&part), "{origin:?}");
    }
}

#[test]
fn a_node_is_computed_on_the_smallest_window_around_all_requests() {
    let graph = chain();
    let whole = Window::whole(world(64));
    let part = Window { origin: [30, 30], cells: [4, 4], ..whole };
    let requests = [Request { port: graph.port("sum").expect("exists"), window: part }];
    let plan = Plan::new(&graph, &requests, &[]);
    let window = |name: &str| {
        let step = plan.steps.iter().find(|step| &*step.name == name).expect("needed");
        (step.wanted.origin, step.wanted.cells, step.window.origin, step.window.cells)
    };
    // cells of 1 m: a reach of 6.5 m is 7 cells, one of 3 m is 3
    assert_eq!(window("sum"), ([30, 30], [4, 4], [30, 30], [4, 4]));
    assert_eq!(window("two"), ([30, 30], [4, 4], [23, 23], [18, 18]));
    assert_eq!(window("one"), ([23, 23], [18, 18], [20, 20], [24, 24]));
    assert_eq!(window("base"), ([20, 20], [24, 24], [20, 20], [24, 24]));
}

#[test]
fn one_node_at_two_windows_runs_once() {
    let graph = chain();
    let whole = Window::whole(world(64));
    let parts = [[2, 3], [40, 50]].map(|origin| Window { origin, cells: [5, 5], ..whole });
    let port = graph.port("two").expect("exists");
    let outcome = run_requests(&evaluator(2), &graph, &[(port, parts[0]), (port, parts[1])]).expect("runs");
    let all = run(&evaluator(2), &graph, &["two"], whole).expect("runs").values.remove(0);
    for (value, part) in outcome.values.iter().zip(&parts) {
        assert_eq!(value.as_field().expect("a field"), &all.as_field().expect("a field").crop(part));
    }
}

#[test]
fn nodes_that_need_the_world_are_computed_for_it_and_kept() {
    let graph = Build::default().node("base", &WAVES, &[]).node("stats", &ANOMALY, &[("height", "base")]).0;
    let evaluator = evaluator(2);
    let whole = Window::whole(world(32));
    let parts = [[0, 0], [16, 16]].map(|origin| Window { origin, cells: [16, 16], ..whole });
    let first = run(&evaluator, &graph, &["stats"], parts[0]).expect("runs");
    let second = run(&evaluator, &graph, &["stats"], parts[1]).expect("runs");
    assert!(second.computed().is_empty());
    let all = run(&evaluator, &graph, &["stats"], whole).expect("runs").values.remove(0);
    for (outcome, part) in [first, second].iter().zip(&parts) {
        assert_eq!(outcome.values[0].as_field(), Some(&all.as_field().expect("a field").crop(part)));
    }
}

#[test]
fn a_part_is_taken_from_a_kept_whole() {
    let (graph, evaluator) = (chain(), evaluator(2));
    let whole = Window::whole(world(32));
    run(&evaluator, &graph, &["sum"], whole).expect("runs");
    let part = Window { origin: [3, 4], cells: [5, 6], ..whole };
    assert_eq!(run(&evaluator, &graph, &["sum"], part).expect("runs").from(Origin::Memory), ["sum"]);
}

#[test]
fn a_window_outside_the_world_is_refused() {
    let graph = chain();
    let whole = Window::whole(world(32));
    for (origin, cells) in [([30, 0], [3, 3]), ([0, 0], [0, 3]), ([u32::MAX, 0], [2, 2])] {
        let error = run(&evaluator(1), &graph, &["sum"], Window { origin, cells, ..whole }).err().expect("refused");
        assert!(matches!(&error, EvalError::Request(message) if message.contains("32 x 32")), "{error}");
    }
}

#[test]
fn a_halo_wraps_around_a_periodic_world() {
    let graph = Build::default().node("base", &WAVES, &[]).node("east", &EASTWARD, &[("height", "base")]).0;
    let sides = Boundary { west: Edge::Periodic, east: Edge::Periodic, ..Boundary::default() };
    let whole = Window::whole(World { boundary: sides, ..world(32) });
    let all = run(&evaluator(1), &graph, &["east"], whole).expect("runs").values.remove(0);
    for origin in [[0, 0], [24, 8], [12, 12], [27, 0]] {
        let part = Window { origin, cells: [5, 4], ..whole };
        let got = run(&evaluator(1), &graph, &["east"], part).expect("runs").values.remove(0);
        assert_eq!(got.as_field(), Some(&all.as_field().expect("a field").crop(&part)), "{origin:?}");
    }
}
