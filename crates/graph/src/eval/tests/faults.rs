//! Nodes that fail, and graphs that cannot be built.

use super::*;
use crate::memory::{OutOfMemory, zeroed};

/// A node whose kernel does something invalid.
const fn faulty(id: &'static str, cpu: crate::Kernel) -> Node {
    Node { id, outputs: HEIGHT, params: || Vec::<ParamSpec>::new(), cpu, ..Node::DEFAULT }
}

static PANICS: Node = faulty("Panics", |_| panic!("out of luck"));
static GIVES_NOTHING: Node = faulty("GivesNothing", |_| Ok(Outputs::default()));
static GIVES_NAN: Node = faulty("GivesNan", |job| height(job, |i, j| if (i, j) == (3, 5) { f32::NAN } else { 0.0 }));
static GIVES_REPORT: Node = faulty("GivesReport", |_| Ok(Outputs::one("height", Report::default())));
static GIVES_LINES: Node = Node {
    outputs: &[Output::gives("height", PortType::Lines, "L.")],
    ..faulty("GivesLines", |_| {
        let line = Line { order: 1, downstream: Some(1), vertices: vec![Vertex::default(); 2] };
        Ok(Outputs::one("height", Lines::open(vec![line])))
    })
};
static GIVES_PLANES: Node = faulty("GivesPlanes", |job| {
    Ok(Outputs::one("height", Field::with_planes(job.window(), 2, vec![0.0; 2 * job.window().len()])))
});
static GIVES_WHOLE: Node =
    faulty("GivesWhole", |job| Ok(Outputs::one("height", Field::constant(Window::whole(*job.world()), 0.0))));
static REFUSES: Node = faulty("Refuses", |_| Err(NodeError::failed_with_hint("the well is dry", "dig deeper")));
static TOO_MUCH: Node = faulty("TooMuch", |job| {
    let samples = zeroed(1 << 60)?;
    Ok(Outputs::one("height", Field::new(job.window(), samples)))
});
static STOPS: Node = faulty("Stops", |_| Err(NodeError::Cancelled));

/// A height or a slope, depending on a parameter.
static EITHER: Node = Node {
    id: "Either",
    outputs: &[Output::chosen("height", slope_from_level, "H.")],
    params: Params::specs,
    ..Node::DEFAULT
};

fn slope_from_level(params: &ParamValues) -> PortType {
    if params.read::<f64>("level") > 0.0 { PortType::Scalar(Unit::Degrees) } else { PortType::Height }
}

fn error_of(node: &'static Node) -> EvalError {
    let graph = Build::default().node("bad", node, &[]).node("after", &ADD, &[("height", "bad")]).0;
    let window = Window { origin: [10, 20], cells: [8, 8], ..Window::whole(world(32)) };
    run(&evaluator(2), &graph, &["after"], window).err().expect("it fails")
}

#[test]
fn results_are_verified_against_the_declaration() {
    let said = |node| error_of(node).to_string();
    assert_eq!(said(&GIVES_NOTHING), "`bad.height` (GivesNothing) was not returned");
    assert_eq!(said(&GIVES_NAN), "`bad.height` (GivesNan) returned NaN at cell (13, 25)");
    assert_eq!(said(&GIVES_REPORT), "`bad.height` (GivesReport) returned a report instead of a height (m)");
    let graph = Build::default().node("bad", &GIVES_LINES, &[]).0;
    let error = run(&evaluator(1), &graph, &["bad"], Window::whole(world(4))).err().expect("it fails");
    assert!(error.to_string().ends_with("returned line 0, which flows into a line that does not exist"), "{error}");
    assert_eq!(said(&GIVES_PLANES), "`bad.height` (GivesPlanes) returned 2 planes; a height (m) has 1");
    assert!(
        said(&GIVES_WHOLE).contains("32 x 32 cells from (0, 0) instead of the requested 8 x 8 cells from (10, 20)")
    );
}

#[test]
fn errors_of_a_kernel_name_its_node() {
    let error = error_of(&REFUSES);
    assert_eq!(
        (error.to_string().as_str(), error.hint().as_deref()),
        ("`bad` (Refuses): the well is dry", Some("dig deeper"))
    );
    assert!(matches!(error_of(&STOPS), EvalError::Node { .. }), "nobody cancelled it");
}

#[test]
fn a_panic_is_an_error_and_leaves_the_rest_usable() {
    let evaluator = evaluator(2);
    let graph = Build::default()
        .node("good", &WAVES, &[])
        .node("bad", &PANICS, &[])
        .node("both", &ADD, &[("height", "good"), ("other", "bad")])
        .0;
    let window = Window::whole(world(16));
    let error = run(&evaluator, &graph, &["both"], window).err().expect("it fails");
    assert_eq!(error, EvalError::Panicked { node: "bad".into(), id: "Panics", message: "out of luck".into() });
    assert_eq!(run(&evaluator, &graph, &["good"], window).expect("runs").values.len(), 1);
}

#[test]
fn a_required_input_must_be_wired_where_it_is_needed() {
    let graph = Build::default().node("base", &WAVES, &[]).node("soft", &BLUR, &[]).0;
    let window = Window::whole(world(16));
    assert!(run(&evaluator(1), &graph, &["base"], window).is_ok());
    let error = run(&evaluator(1), &graph, &["soft"], window).err().expect("refused");
    assert_eq!(error, EvalError::Unwired { node: "soft".into(), id: "Blur", input: "height" });
}

#[test]
fn a_parameter_that_changes_a_type_under_a_wire_is_found() {
    let graph = Build::default().node("base", &EITHER, &[]).node("soft", &BLUR, &[("height", "base")]);
    let graph = graph.set("base", "level", ParamValue::Float(1.0)).0;
    let error = run(&evaluator(1), &graph, &["soft"], Window::whole(world(16))).err().expect("refused");
    assert_eq!(error.to_string(), "`base.height` gives a scalar (°), but `soft.height` takes a height (m)");
}

#[test]
fn what_does_not_fit_into_memory_is_refused_with_what_it_would_take() {
    let graph = Build::default().node("base", &WAVES, &[]).node("soft", &BLUR, &[("height", "base")]).0;
    let evaluator = with(EvaluatorOptions { memory_limit: Some(1 << 20), ..EvaluatorOptions::default() });
    let error = run(&evaluator, &graph, &["soft"], Window::whole(world(1024))).err().expect("refused");
    assert_eq!(error.to_string(), "building `soft` needs 8.0 MiB of memory; 1.0 MiB is available");
    assert!(run(&evaluator, &graph, &["soft"], Window::whole(world(256))).is_ok());
}

#[test]
fn memory_that_a_kernel_is_refused_is_an_error_of_its_node() {
    let error = error_of(&TOO_MUCH);
    let refused = OutOfMemory { bytes: 1 << 62 };
    assert_eq!(error, EvalError::OutOfMemory { node: "bad".to_owned(), id: "TooMuch", refused });
    assert_eq!(error.to_string(), "`bad` (TooMuch): there is not enough memory for another 4.0 EiB");
    assert!(error.hint().is_some_and(|hint| hint.contains("fewer cells")));
}

#[test]
fn values_without_readers_are_not_counted() {
    let mut build = Build::default().node("n0", &WAVES, &[]);
    for i in 1..50 {
        build = build.node(&format!("n{i}"), &ADD, &[("height", &format!("n{}", i - 1))]);
    }
    let layer = 64 * 64 * 4;
    let limited = |bytes| with(EvaluatorOptions { memory_limit: Some(bytes), ..EvaluatorOptions::default() });
    let build = |bytes| run(&limited(bytes), &build.0, &["n49"], Window::whole(world(64)));
    assert!(build(2 * layer).is_ok(), "one that is read and one that is made");
    assert!(matches!(build(2 * layer - 1), Err(EvalError::TooLarge { needs, .. }) if needs == 2 * layer));
}

#[test]
fn an_impossible_world_is_refused() {
    let graph = Build::default().node("base", &WAVES, &[]).0;
    for cells in [[0, 0], [1_000_000_000, 1]] {
        let window = Window::whole(World { cells, ..world(1) });
        assert!(matches!(run(&evaluator(1), &graph, &["base"], window), Err(EvalError::World(_))));
    }
}
