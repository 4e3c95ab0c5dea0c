//! The cost of a drag: number of parsed texts, expansions and orders.

use std::{path::Path, sync::Arc};

use orograph::editor::{NodeState, Session};
use orograph_graph::Edit;

use crate::{scratch, wait};

/// A chain of this many nodes, each reading the one before.
fn chain(count: usize) -> String {
    let node = |number: usize| match number.checked_sub(1) {
        None => "\"n0\": Perlin(octaves: 2)".to_owned(),
        Some(before) => format!("\"n{number}\": Clamp(value: \"n{before}\")"),
    };
    let nodes: Vec<String> = (0..count).map(node).collect();
    let places: Vec<String> = (0..count).map(|number| format!("\"n{number}\": ({}, 0)", number * 240)).collect();
    let (nodes, places) = (nodes.join(", "), places.join(", "));
    format!("(world: (cells: 16), nodes: {{ {nodes} }}, outputs: {{ \"o\": \"n0\" }}, layout: {{ {places} }})")
}

fn session(folder: &Path) -> Session {
    let file = Some(folder.join("graph.ron"));
    let mut session = Session::open(file, orograph_nodes::registry(), orograph::build::storage::in_memory(), || {})
        .expect("the file can be read");
    session.set_cells(16);
    session.poll();
    session
}

fn settle(session: &mut Session) {
    wait("all is built", || {
        session.poll();
        !session.is_busy()
    });
}

fn place(node: &str, x: u32) -> Edit {
    Edit::SetLayout { node: node.to_owned(), at: Some([f64::from(x), 0.0]) }
}

fn slider(node: &str, high: u32) -> Edit {
    Edit::SetText { node: node.to_owned(), name: "high".to_owned(), text: high.to_string() }
}

#[test]
fn moving_a_node_sends_nothing_to_the_worker() {
    let folder = scratch(&chain(6));
    let mut session = session(folder.path());
    settle(&mut session);
    let (revision, edits) = (session.revision(), session.edits());
    for event in 1..=5 {
        assert!(session.gesture(&place("n3", event)));
        session.poll();
        assert!(!session.is_busy(), "nothing was ordered");
    }
    assert_eq!((session.revision(), session.edits()), (revision, edits + 5));
    assert_eq!(session.node("n3").state, NodeState::Fresh);
    assert!(session.undo());
    session.poll();
    assert!(!session.is_busy());
    assert!(session.gesture(&slider("n3", 900)));
    session.poll();
    assert!(session.is_busy(), "what is built has changed");
    assert_eq!(session.revision(), revision + 1);
    settle(&mut session);
    assert_eq!(session.node("n5").state, NodeState::Fresh);
}

#[test]
fn an_event_parses_once_and_a_selection_expands_nothing() {
    let folder = scratch(&chain(6));
    let mut session = session(folder.path());
    assert!(session.gesture(&slider("n3", 900)));
    for event in 0..5 {
        let parsed = session.document().statistics().texts_parsed;
        assert!(session.gesture(&slider("n3", 901 + event)));
        session.poll();
        assert_eq!(session.document().statistics().texts_parsed, parsed + 1);
    }
    session.end_gesture();
    let parsed = session.document().statistics();
    let graph = session.document().expand().graph;
    session.select_only("n2");
    session.poll();
    assert!(session.is_busy(), "another output is shown");
    assert!(Arc::ptr_eq(&graph, &session.document().expand().graph));
    assert_eq!(session.document().statistics(), parsed);
}

#[test]
fn ten_thousand_nodes_are_opened_and_dragged() {
    let folder = scratch(&chain(10_000));
    let mut session = session(folder.path());
    assert_eq!(session.document().problems(), []);
    for edit in [slider("n9999", 900), slider("n9999", 901), place("n9999", 7)] {
        assert!(session.gesture(&edit), "{:?}", session.take_notes());
        session.poll();
    }
    assert_eq!(session.document().steps(), 1, "each took the place of the one before");
    assert!(session.undo() && !session.undo());
    session.select_only("n5000");
    session.poll();
    assert_eq!(session.shown().as_deref(), Some("n5000.value"));
}
