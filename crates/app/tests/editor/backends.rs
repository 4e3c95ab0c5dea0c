//! Tests of the backends that nodes should run on: they stay with their nodes, and the inspector offers and explains them.

use egui_kittest::kittest::Queryable as _;
use orograph::editor::{Answer, Journals, Session};
use orograph_graph::{Edit, Prefer};

use crate::{device, scratch, settle, window};

const HILLS: &str = r#"(world: (size: 640, cells: 64), nodes: {
    "a": Perlin(wavelength: 500), "b": Terrace(height: "a") }, outputs: { "height": "b" })"#;

fn session(folder: &tempfile::TempDir) -> Session {
    crate::files::session(Some(&folder.path().join("graph.ron")))
}

fn remove(name: &str) -> Edit {
    Edit::RemoveNode { name: name.to_owned() }
}

/// A name that is free again can be given to a new node: one that is added, pasted or written by another program.
#[test]
fn a_new_node_has_no_backend() {
    let folder = scratch(HILLS);
    let mut session = session(&folder);
    session.prefer("a", Prefer::Device);
    assert!(session.apply(&remove("a")));
    assert!(session.undo() && session.preferred("a") == Prefer::Device, "it is the same node");
    let name = || "a".to_owned();
    for add in [
        Edit::AddNode { name: name(), kind: "Ridged".to_owned(), at: None },
        Edit::AddWritten { name: name(), text: "Ridged(octaves: 3)".to_owned(), at: None },
    ] {
        session.prefer("a", Prefer::Device);
        assert!(session.apply(&Edit::All(vec![remove("a"), add])));
        assert_eq!(session.preferred("a"), Prefer::Auto);
    }

    session.prefer("a", Prefer::Device);
    session.prefer("b", Prefer::Cpu);
    assert!(session.apply(&remove("a")) && session.save());
    std::fs::write(folder.path().join("graph.ron"), HILLS).expect("written");
    assert!(session.reload());
    assert_eq!((session.preferred("a"), session.preferred("b")), (Prefer::Auto, Prefer::Cpu));
}

#[test]
fn recovered_work_has_no_backends() {
    let folder = scratch(HILLS);
    let kept = || {
        let mut session = session(&folder);
        session.keep(Journals::with_state(folder.path()), || {});
        session
    };
    let mut before = kept();
    assert!(before.apply(&remove("b")));
    drop(before);
    let mut after = kept();
    after.prefer("a", Prefer::Device);
    after.answer(Answer::Recover);
    assert!(after.document().node("b").is_none());
    assert_eq!(after.preferred("a"), Prefer::Auto);
}

/// The choice is offered by a program that can use graphics cards. Where no device opens, the inspector says so.
#[test]
fn the_inspector_offers_a_backend_and_says_if_there_is_no_device() {
    crate::draws();
    let folder = scratch(HILLS);
    let mut window = window(Some(folder.path().join("graph.ron")));
    window.state_mut().session_mut().set_cells(64);
    window.state_mut().session_mut().select_only("a");
    settle(&mut window);
    window.run_steps(3);
    let offers = |value: &str| window.query_all_by_value(value).count() > 0;
    assert_eq!(offers("auto"), cfg!(feature = "gpu"));
    assert!(window.query_by_label_contains("no graphics device").is_none());

    window.state_mut().session_mut().prefer("a", Prefer::Device);
    settle(&mut window);
    window.run_steps(3);
    let lacks = device::missing().is_some() || !cfg!(feature = "gpu");
    assert_eq!(window.state().session().lacks_device("a"), lacks);
    assert_eq!(window.query_by_label_contains("no graphics device is available").is_some(), lacks);
}
