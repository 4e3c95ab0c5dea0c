//! Tests of the history pane, of snapshots, and of editing several nodes at once.

use egui::accesskit::Role;
use egui_kittest::{Harness, kittest::Queryable as _};
use orograph::editor::{App, FileCommand};
use orograph_graph::{Edit, ParamValue};

use crate::{built, look, scratch, settle, until, window};

fn set(node: &str, param: &str, value: f64) -> Edit {
    Edit::SetParam { node: node.into(), param: param.into(), value: ParamValue::Float(value) }
}

fn source(window: &Harness<'_, App>) -> String {
    window.state().session().document().source().to_owned()
}

fn opened() -> Harness<'static, App> {
    let mut window = built("hello.ron", 64);
    window.get_by_label("History").click();
    window.run_steps(3);
    window
}

#[test]
fn steps_are_named_and_clicked() {
    crate::draws();
    let mut window = opened();
    let texts: Vec<String> = [1000.0, 2000.0, 3000.0]
        .into_iter()
        .map(|amplitude| {
            assert!(window.state_mut().session_mut().apply(&set("ground", "amplitude", amplitude)));
            window.run_steps(2);
            source(&window)
        })
        .collect();
    until(&mut window, "the steps are described", |window| {
        window.query_all_by_label_contains("ground.amplitude").count() == 3
    });
    look(&mut window, "history");
    let second = window.query_all_by_label_contains("ground.amplitude").nth(1).expect("a row").rect().center();
    crate::hand::click(&mut window, second);
    assert_eq!(source(&window), texts[1]);
    // an undone step is still there, until another edit
    let third = window.query_all_by_label_contains("ground.amplitude").nth(2).expect("a row").rect().center();
    crate::hand::click(&mut window, third);
    assert_eq!(source(&window), texts[2]);
    window.get_by_label("Start").click();
    window.run_steps(3);
    assert_eq!(window.state().session().document().steps(), 0);
    assert!(window.state_mut().session_mut().apply(&set("rise", "rate", 0.002)));
    until(&mut window, "the new step is described", |window| window.query_by_label_contains("rise.rate").is_some());
    assert_eq!(window.query_all_by_label_contains("ground.amplitude").count(), 0);
}

/// An edit that replaces an undone one has its own description, also if the pane was hidden meanwhile.
#[test]
fn a_step_in_place_of_an_undone_one_has_its_own_name() {
    crate::draws();
    let mut window = opened();
    for amplitude in [1000.0, 2000.0] {
        assert!(window.state_mut().session_mut().apply(&set("ground", "amplitude", amplitude)));
        window.run_steps(2);
    }
    until(&mut window, "the steps are described", |window| {
        window.query_all_by_label_contains("ground.amplitude").count() == 2
    });
    window.state_mut().session_mut().undo();
    window.run_steps(2);
    assert!(window.state_mut().session_mut().apply(&set("rise", "rate", 0.002)));
    until(&mut window, "the new step is described", |window| window.query_by_label_contains("rise.rate").is_some());
    window.get_by_label("Inspector").click();
    window.run_steps(2);
    let session = window.state_mut().session_mut();
    assert!(session.undo() && session.undo());
    assert!(session.apply(&set("ground", "wavelength", 4000.0)) && session.apply(&set("ground", "gain", 0.4)));
    window.run_steps(2);
    window.get_by_label("History").click();
    until(&mut window, "both are described", |window| {
        ["ground.wavelength", "ground.gain"].iter().all(|name| window.query_by_label_contains(name).is_some())
    });
    assert_eq!(window.query_all_by_label_contains("ground.amplitude").count(), 0);
}

#[test]
fn a_snapshot_is_compared_and_restored() {
    crate::draws();
    let mut window = opened();
    let before = source(&window);
    window.get_by_label("Take snapshot").click();
    window.run_steps(3);
    assert_eq!(window.state().session().snapshots().len(), 1);
    assert!(window.state_mut().session_mut().apply(&set("ground", "amplitude", 900.0)));
    settle(&mut window);
    window.state_mut().session_mut().compare(Some("snapshot 1".to_owned()));
    settle(&mut window);
    window.run_steps(4);
    look(&mut window, "snapshot");
    let session = window.state().session();
    let kept = session.snapshot("snapshot 1").expect("kept");
    assert_eq!((kept.port(), session.compared()), ("rivers.height", Some("snapshot 1")));
    window.get_by_label("Restore snapshot 1").click();
    window.run_steps(3);
    assert_eq!(source(&window), before);
    window.state_mut().session_mut().undo();
    assert!(source(&window).contains("900"), "one undo step");
    window.state_mut().session_mut().remove_snapshot("snapshot 1");
    window.run_steps(3);
    assert_eq!(window.state().session().compared(), None);
}

/// Restoring it would replace another graph.
#[test]
fn a_snapshot_goes_with_its_graph() {
    crate::draws();
    let mut window = opened();
    let session = window.state_mut().session_mut();
    session.take_snapshot();
    session.compare(Some("snapshot 1".to_owned()));
    session.request(FileCommand::New);
    assert_eq!((session.snapshots().len(), session.compared()), (0, None));
}

#[test]
fn several_nodes_are_edited_at_once() {
    crate::draws();
    let folder = scratch(
        r#"(world: (size: "4 km", cells: 64), nodes: {
            "a": Perlin(wavelength: 900), "b": Perlin(wavelength: 700, seed: 3), "c": Terrace(height: "a") },
            outputs: { "h": "c" })"#,
    );
    let mut window = window(Some(folder.path().join("graph.ron")));
    window.state_mut().session_mut().set_cells(64);
    window.state_mut().session_mut().select(["a".to_owned(), "b".to_owned()]);
    settle(&mut window);
    assert_eq!(window.query_all_by_label_contains("different values").count(), 2, "wavelength and seed");
    look(&mut window, "several");
    let steps = window.state().session().document().steps();
    window.get_by_role_and_label(Role::TextInput, "wavelength").focus();
    window.run_steps(2);
    window.get_by_role_and_label(Role::TextInput, "wavelength").type_text("2 km / 4");
    window.run_steps(2);
    window.key_press(egui::Key::Enter);
    window.run_steps(3);
    let session = window.state().session();
    let value = |node: &str| {
        let graph = session.document().graph();
        graph.instance(graph.find(node).expect("a node")).params.get("wavelength").cloned()
    };
    assert_eq!((value("a"), value("b")), (Some(ParamValue::Float(500.0)), Some(ParamValue::Float(500.0))));
    assert_eq!(session.document().steps(), steps + 1, "one undo step");
}
