//! Only requested outputs are computed, and only changed nodes.

use super::*;

fn graph() -> Graph {
    Build::default()
        .node("base", &WAVES, &[])
        .node("soft", &BLUR, &[("height", "base")])
        .node("sum", &ADD, &[("height", "soft"), ("other", "base")])
        .node("aside", &ANOMALY, &[("height", "base")])
        .0
}

#[test]
fn only_what_the_request_needs_runs_and_each_node_once() {
    let outcome = run(&evaluator(2), &graph(), &["sum"], Window::whole(world(32))).expect("runs");
    assert_eq!(outcome.computed(), ["base", "soft", "sum"]);
}

#[test]
fn a_second_evaluation_takes_the_result_and_looks_no_further() {
    let (evaluator, graph) = (evaluator(2), graph());
    let first = run(&evaluator, &graph, &["sum"], Window::whole(world(32))).expect("runs");
    let second = run(&evaluator, &graph, &["sum"], Window::whole(world(32))).expect("runs");
    assert_eq!(second.from(Origin::Memory), ["sum"]);
    assert!(second.computed().is_empty());
    assert_eq!(first.values, second.values);
}

#[test]
fn each_output_is_found_under_its_own_key() {
    let (evaluator, graph) = (evaluator(2), graph());
    let window = Window::whole(world(32));
    let first = run(&evaluator, &graph, &["aside.height", "aside.report"], window).expect("runs");
    for (end, value) in ["aside.height", "aside.report"].iter().zip(&first.values) {
        let again = run(&evaluator, &graph, &[end], window).expect("runs");
        assert_eq!(again.from(Origin::Memory), ["aside"]);
        assert_eq!(again.values[0].as_field(), value.as_field());
        assert_eq!(again.values[0].as_report().is_some(), value.as_report().is_some());
    }
}

#[test]
fn a_change_runs_what_is_downstream_of_it() {
    let (evaluator, mut graph) = (evaluator(2), graph());
    let window = Window::whole(world(32));
    run(&evaluator, &graph, &["sum", "aside"], window).expect("runs");
    set(&mut graph, "soft", "radius", ParamValue::Float(5.0));
    let outcome = run(&evaluator, &graph, &["sum", "aside"], window).expect("runs");
    assert_eq!(outcome.computed(), ["soft", "sum"]);
    assert_eq!(outcome.from(Origin::Memory), ["aside", "base"]);
}

#[test]
fn a_change_in_a_part_of_the_world_runs_what_is_downstream_of_it() {
    let (evaluator, mut graph) = (evaluator(2), graph());
    let window = Window { origin: [8, 8], cells: [4, 4], ..Window::whole(world(32)) };
    run(&evaluator, &graph, &["sum"], window).expect("runs");
    let sum = graph.find("sum").expect("exists");
    graph.disconnect(sum, 1);
    // `base` was computed with the halo of `soft`, which is needed again
    let outcome = run(&evaluator, &graph, &["sum"], window).expect("runs");
    assert_eq!(outcome.computed(), ["sum"]);
}

#[test]
fn no_request_is_no_work() {
    assert_eq!(run_requests(&evaluator(1), &graph(), &[]).expect("runs").values, []);
}

#[test]
fn results_are_the_same_for_any_number_of_threads() {
    let graph = wide(20);
    let window = Window::whole(world(48));
    let one = run(&evaluator(1), &graph, &["top.height", "top.report"], window).expect("runs");
    let four = run(&evaluator(4), &graph, &["top.height", "top.report"], window).expect("runs");
    assert_eq!(one.values[0], four.values[0]);
    let mean = |outcome: &Outcome| outcome.values[1].as_report().and_then(|r| r.get("mean")).map(f64::to_bits);
    assert_eq!(mean(&one), mean(&four));
}

#[test]
fn one_thread_is_enough_for_a_wide_graph() {
    let outcome = run(&evaluator(1), &wide(300), &["top"], Window::whole(world(8))).expect("runs");
    assert_eq!(outcome.computed().len(), 300 + 300 + 2);
}

#[test]
fn a_long_chain_needs_no_recursion() {
    let mut build = Build::default().node("n0", &WAVES, &[]);
    for i in 1..5000 {
        build = build.node(&format!("n{i}"), &ADD, &[("height", &format!("n{}", i - 1))]);
    }
    let outcome = run(&evaluator(2), &build.0, &["n4999"], Window::whole(world(1))).expect("runs");
    assert_eq!(outcome.computed().len(), 5000);
}

/// `count` sources, each added to the next, and the anomaly of all.
fn wide(count: usize) -> Graph {
    let mut build = Build::default().node("sum", &WAVES, &[]);
    let mut last = "sum".to_owned();
    for i in 0..count {
        let (source, sum) = (format!("source{i}"), format!("sum{i}"));
        build = build.node(&source, &WAVES, &[]).set(&source, "level", ParamValue::Float((i + 1) as f64)).node(
            &sum,
            &ADD,
            &[("height", &last), ("other", &source)],
        );
        last = sum;
    }
    build.node("top", &ANOMALY, &[("height", &last)]).0
}
