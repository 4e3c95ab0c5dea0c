//! Tests of the live run, and of painting during it.

use std::time::{Duration, Instant};

use egui::{pos2, vec2};
use egui_kittest::{Harness, kittest::Queryable as _};
use orograph::editor::{App, Session};
use orograph_graph::{Document, Edit, Evaluator, EvaluatorOptions, ParamValue, Prefer, Stroke, Tool, Value, Window};

use crate::{hand::drag, look, scratch, settle, until, window};

const STORM: &str = r#"(
    world: (size: 960, cells: 96, seed: 3),
    nodes: {
        "base":   Perlin(wavelength: 700, amplitude: 90),
        "storm":  HydraulicPipe(height: "base", duration: 5000, rain: 60),
        "ground": Slope(height: "storm"),
    },
    outputs: { "height": "storm" },
)"#;

fn storm() -> (Harness<'static, App>, tempfile::TempDir) {
    storm_of(STORM)
}

fn storm_of(text: &str) -> (Harness<'static, App>, tempfile::TempDir) {
    let folder = scratch(text);
    let mut window = window(Some(folder.path().join("graph.ron")));
    window.state_mut().session_mut().set_cells(96);
    window.state_mut().session_mut().select_only("storm");
    settle(&mut window);
    window.get_by_label("Map").click();
    window.run_steps(2);
    window.get_by_label("Live").click();
    window.run_steps(2);
    until(&mut window, "it runs", |window| moment(window).is_some());
    (window, folder)
}

fn moment(window: &Harness<'_, App>) -> Option<f64> {
    Some(window.state().session().simulation()?.moment()?.now)
}

fn is_over(window: &Harness<'_, App>) -> bool {
    window.state().session().simulation().is_some_and(orograph::editor::Simulation::is_over)
}

fn seen(window: &Harness<'_, App>, port: &str) -> Value {
    window.state().session().built(port).expect("it is built").value.clone()
}

/// The result of a build of the document, without a window.
fn built(document: &Document, port: &str) -> Value {
    let evaluator = Evaluator::new(EvaluatorOptions::default()).expect("threads");
    let graph = document.graph();
    let (port, window) = (graph.port(port).expect("exists"), Window::whole(document.world()));
    evaluator.values(graph, std::path::Path::new(""), &[port], window).expect("it runs").remove(0)
}

fn strokes(window: &Harness<'_, App>) -> Vec<Stroke> {
    let graph = window.state().session().document().graph();
    match graph.instance(graph.find("storm").expect("it is there")).params.get("strokes") {
        Some(ParamValue::Strokes(strokes)) => strokes.clone(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_live_run_to_the_end_equals_a_build() {
    crate::draws();
    let (mut window, _folder) = storm();
    assert_eq!(moment(&window), Some(0.0));
    window.get_by_label("Step").click();
    until(&mut window, "it goes on", |window| moment(window).is_some_and(|now| now > 0.0));
    // It reports its progress every 100 ms, and pauses after the requested steps.
    let mut last = (moment(&window), Instant::now());
    until(&mut window, "it pauses", |window| {
        if moment(window) != last.0 {
            last = (moment(window), Instant::now());
        }
        last.1.elapsed() > Duration::from_secs(1)
    });
    assert!(!is_over(&window) && last.0.is_some_and(|now| now < 1000.0), "ten steps: {last:?}");
    look(&mut window, "live");
    window.get_by_label("Run").click();
    until(&mut window, "it is over", is_over);
    settle(&mut window);
    let document = window.state().session().document().clone();
    for port in ["storm.height", "storm.water", "storm.report"] {
        assert!(seen(&window, port) == built(&document, port), "{port}");
    }
    assert!(window.state().session().small("ground.slope").is_some(), "what comes after it is built then");
    window.get_by_label("Restart").click();
    until(&mut window, "it restarts", |window| moment(window) == Some(0.0));
    window.get_by_label("Live").click();
    window.run_steps(2);
    assert!(window.state().session().simulation().is_none());
    settle(&mut window);
    assert!(seen(&window, "storm.height") == built(&document, "storm.height"));
}

#[test]
fn strokes_of_a_live_run_are_saved_and_give_the_same_terrain() {
    crate::draws();
    let (mut window, _folder) = storm();
    window.get_by_label("Brush").click();
    window.run_steps(2);
    window.get_by_label("Run").click();
    until(&mut window, "it is on its way", |window| moment(window).is_some_and(|now| now > 60.0));
    drag(&mut window, pos2(440.0, 260.0), pos2(520.0, 280.0));
    until(&mut window, "a stroke is kept", |window| strokes(window).len() == 1);
    let painted = strokes(&window).remove(0);
    assert!(painted.time > 0.0 && painted.tool == Tool::Raise && painted.points.len() > 1, "{painted:?}");
    let here = moment(&window).expect("it runs");
    until(&mut window, "it goes on", |window| moment(window).is_some_and(|now| now > here));
    window.get_by_label("Pause").click();
    window.run_steps(2);
    window.get_by_label("Rain").click();
    window.run_steps(2);
    drag(&mut window, pos2(400.0, 200.0), pos2(400.0, 200.0) + vec2(0.0, 30.0));
    until(&mut window, "another stroke is kept", |window| strokes(window).len() == 2);
    assert!(strokes(&window)[1].tool == Tool::Rain && strokes(&window)[1].time > painted.time);
    look(&mut window, "live_painted");
    assert!(moment(&window).is_some_and(|now| now > painted.time), "it has not restarted");
    window.get_by_label("Run").click();
    until(&mut window, "it is over", is_over);
    settle(&mut window);
    let document = window.state().session().document().clone();
    assert!(document.source().contains("tool: rain") && document.source().contains("time: "));
    assert!(seen(&window, "storm.height") == built(&document, "storm.height"));

    window.state_mut().session_mut().undo();
    window.state_mut().session_mut().undo();
    assert_eq!(strokes(&window), []);
    until(&mut window, "it restarts", |window| moment(window) == Some(0.0));
}

/// A node can be sent to a graphics device, here a driver in software, and back, also while it runs: the choice is kept
/// with the session, follows a new name, and neither the file nor undo knows it.
#[cfg(feature = "gpu")]
#[test]
fn a_node_runs_on_the_backend_that_is_chosen_for_it() {
    crate::draws();
    if crate::device::skips("a chosen backend") {
        return;
    }
    let folder = scratch(&STORM.replace("5000", "60"));
    let mut session = crate::files::session(Some(&folder.path().join("graph.ron")));
    let text = session.document().source().to_owned();
    session.set_cells(96);
    session.select_only("storm");
    let wait = |session: &mut Session, what: &str, until: &dyn Fn(&Session) -> bool| {
        crate::wait(what, || {
            session.poll();
            until(session)
        });
    };
    let samples = |session: &Session| match &session.built("storm.height").expect("it is built").value {
        Value::Field(field) => field.clone(),
        other => panic!("not a field: {other:?}"),
    };
    wait(&mut session, "the build", &|session| !session.is_busy());
    let cpu = samples(&session);
    assert!(session.can_prefer("storm") && session.can_prefer("base") && !session.node("storm").on_device);

    session.prefer("storm", Prefer::Device);
    wait(&mut session, "the build on the device", &|session| !session.is_busy());
    assert!(session.node("storm").on_device && !session.node("base").on_device);
    let device = samples(&session);
    assert!(!session.is_dirty() && session.document().source() == text, "the file does not know it");
    assert!(!session.undo(), "nor does undo");

    let rename = Edit::RenameNode { from: "storm".into(), to: "rain".into() };
    assert!(session.apply(&rename) && session.preferred("rain") == Prefer::Device);
    assert!(session.undo() && session.preferred("storm") == Prefer::Device);

    session.simulate("storm");
    let now = |session: &Session| session.simulation().and_then(|run| run.moment()).map(|moment| moment.now);
    wait(&mut session, "the start", &|session| now(session) == Some(0.0));
    assert!(session.node("storm").on_device, "live as well");
    session.run_simulation(true);
    wait(&mut session, "the end", &|session| session.simulation().is_some_and(|run| run.is_over()));
    wait(&mut session, "what comes after it", &|session| !session.is_busy());
    assert!(samples(&session) == device, "as it was built");
    session.prefer("storm", Prefer::Cpu);
    wait(&mut session, "the restart", &|session| now(session) == Some(0.0) && !session.node("storm").on_device);
    session.run_simulation(true);
    wait(&mut session, "the end", &|session| session.simulation().is_some_and(|run| run.is_over()));
    assert!(samples(&session) == cpu);
}

/// The kernels and the window draw on one adapter, each with a device of its own: a run on the device goes on while it
/// is drawn, painted on and paused, and what is drawn is what a build gives.
#[cfg(feature = "gpu")]
#[test]
fn a_live_run_on_the_device_is_drawn_on_the_same_adapter() {
    crate::draws();
    if crate::device::skips("a live run on the device") {
        return;
    }
    let (mut window, _folder) = storm_of(&STORM.replace("5000", "100"));
    window.state_mut().session_mut().prefer("storm", Prefer::Device);
    // slowly enough that it is still on its way after the stroke on a busy machine
    window.state_mut().session_mut().pace_simulation(100.0);
    let on_device = |window: &Harness<'_, App>| window.state().session().node("storm").on_device;
    until(&mut window, "it restarts on the device", |window| on_device(window) && moment(window) == Some(0.0));
    window.get_by_label("Brush").click();
    window.run_steps(2);
    window.get_by_label("Run").click();
    until(&mut window, "it is on its way", |window| moment(window).is_some_and(|now| now > 5.0));
    drag(&mut window, pos2(440.0, 260.0), pos2(520.0, 280.0));
    until(&mut window, "a stroke is kept", |window| strokes(window).len() == 1);
    let painted = strokes(&window).remove(0);
    assert!(painted.time > 0.0 && moment(&window).is_some_and(|now| now >= painted.time), "{painted:?}");
    window.get_by_label("Pause").click();
    window.run_steps(2);
    look(&mut window, "live_device");
    assert!(on_device(&window) && !is_over(&window), "it has not restarted on the CPU");
    window.state_mut().session_mut().pace_simulation(0.0);
    window.get_by_label("Run").click();
    until(&mut window, "it is over", is_over);
    settle(&mut window);
    assert!(window.state().session().node("storm").warnings.iter().all(|said| !said.contains("CPU")));
    let live = seen(&window, "storm.height");
    window.get_by_label("Live").click();
    window.run_steps(2);
    settle(&mut window);
    assert!(on_device(&window), "it stays on the device");
    assert!(seen(&window, "storm.height") == live, "as it is built");
}
