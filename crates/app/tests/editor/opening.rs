//! Opening files.

use orograph::editor::NodeState;

use crate::{graph, settle, window};

#[test]
fn a_file_opens_and_its_nodes_are_built() {
    let mut window = window(Some(graph("hello.ron")));
    window.state_mut().session_mut().set_cells(64);
    settle(&mut window);
    let session = window.state().session();
    assert_eq!(session.shown().as_deref(), Some("rivers.height"));
    for node in ["ground", "rise", "rivers"] {
        assert_eq!(session.node(node).state, NodeState::Fresh, "{node}");
    }
    assert_eq!(session.built("rivers.height").map(|built| built.cells), Some(64));
}
