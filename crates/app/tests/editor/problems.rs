//! Tests of the Problems pane: a broken file opens as far as possible, and each problem links to its node.

use egui_kittest::{Harness, kittest::Queryable as _};
use orograph::editor::{App, Journals};
use orograph_graph::Edit;

use crate::{scratch, until, window};

#[test]
fn a_broken_file_opens_and_its_problems_link_to_their_nodes() {
    let file = scratch(
        "(\n  world: (cells: 64),\n  nodes: {\n    \"land\": Ridged(wavelength: 900, octaves: 99),\n    \"odd\": Perlni(),\n  },\n  \
         outputs: { \"h\": \"land\" },\n)\n",
    );
    let mut window = window(Some(file.path().join("graph.ron")));
    window.run_steps(3);
    window.get_by_label("Problems (2)").click();
    window.run_steps(3);
    assert!(window.query_by_label("unknown node `Perlni`").is_some());
    assert!(window.query_by_label("did you mean `Perlin`?").is_some());
    window.get_by_label("line 4, go to land").click();
    window.run_steps(3);
    assert_eq!(window.state().session().selected(), Some("land"));
    window.get_by_label("odd: Perlni").click();
    window.run_steps(3);
    assert_eq!(window.state().session().selected(), Some("odd"));
    // the inspector shows the information that is known about it, and can remove it
    window.get_by_label("Inspector").click();
    window.run_steps(3);
    assert!(window.query_by_label("Perlni cannot be used").is_some());
    window.get_by_label("Remove it").click();
    window.run_steps(3);
    assert!(!window.state().session().document().source().contains("Perlni"));
}

#[test]
fn an_empty_graph_has_no_problems() {
    let mut window = window(None);
    window.run_steps(3);
    window.get_by_label("Problems").click();
    window.run_steps(3);
    assert!(window.query_by_label("No problems.").is_some());
    let edit = Edit::AddNode { name: "a".into(), kind: "Constant".into(), at: None };
    assert!(window.state_mut().session_mut().apply(&edit));
    window.run_steps(3);
    assert!(window.query_by_label("Problems (1)").is_some(), "now an output is missing");
    assert!(window.query_by_label("tick “output” on a node in the inspector").is_some());
    assert!(window.query_by_label_contains("line 1").is_none(), "advice for the window, not for the file");
}

#[test]
fn a_preview_on_larger_cells_than_expected_misses_nothing() {
    let file = scratch(
        "(\n  world: (size: 3200, cells: 64),\n  nodes: { \"hills\": Ridged(amplitude: 300) },\n  \
         outputs: { \"height\": \"hills\" },\n  expect: { \"cell\": 10, \"relief\": (\"1 km\", inf) },\n)\n",
    );
    let mut window = window(Some(file.path().join("graph.ron")));
    until(&mut window, "the terrain is measured", |window| window.state().session().checked().is_some());
    assert!(titled(&window, 0));
    window.run_steps(3);
    assert!(window.query_by_label("–").is_some() && window.query_by_label("⚠").is_none(), "nor in the inspector");
    window.get_by_label("Problems").click();
    window.run_steps(3);
    assert!(window.query_by_label_contains("but those of the world are 50 m: misses do not count").is_some());
    assert!(window.query_by_label_contains("out of bounds at this cell size").is_some());
}

/// The title of the Problems pane with this number.
fn titled(window: &Harness<'_, App>, count: usize) -> bool {
    let title = if count == 0 { "Problems".to_owned() } else { format!("Problems ({count})") };
    window.query_by_label(&title).is_some()
}

#[test]
fn a_missed_expectation_is_listed_with_its_figure_and_links_to_its_node() {
    let file = scratch(
        "(\n  world: (size: 3200, cells: 64),\n  nodes: {\n    \"hills\": Ridged(amplitude: 300),\n    \"other\": Constant,\n  },\n  \
         outputs: { \"height\": \"hills\" },\n  expect: { \"relief\": (\"1 km\", inf), \"elevation.max\": (-inf, \"90 km\") },\n)\n",
    );
    let path = file.path().join("graph.ron");
    let mut window = window(Some(path.clone()));
    // watches the file
    window.state_mut().session_mut().keep(Journals::with_state(file.path()), || {});
    until(&mut window, "the terrain is measured", |window| window.state().session().checked().is_some());
    until(&mut window, "the miss is counted", |window| titled(window, 1));
    window.get_by_label("Problems (1)").click();
    window.run_steps(3);
    let relief = {
        let measured = window.state().session().checked().expect("figures");
        let checked = measured.checked.as_ref().expect("it was measured");
        assert_eq!(checked.missed().count(), 1);
        checked.figures[0].text()
    };
    assert!(relief.starts_with("`relief` is ") && relief.ends_with("not at least 1 km"), "{relief}");
    assert!(window.query_by_label(&relief).is_some());
    window.get_by_label("expectation, go to hills").click();
    window.run_steps(3);
    assert_eq!(window.state().session().selected(), Some("hills"));

    // an edit that meets it
    let revision = window.state().session().revision();
    let edit = Edit::SetText { node: "hills".into(), name: "amplitude".into(), text: "10 km".into() };
    assert!(window.state_mut().session_mut().apply(&edit));
    assert!(window.state().session().revision() > revision);
    until(&mut window, "the miss is gone", |window| titled(window, 0));
    assert!(window.state_mut().session_mut().undo());
    until(&mut window, "the miss is back", |window| titled(window, 1));

    // other bounds in the file are measured without a build
    let text = std::fs::read_to_string(&path).expect("the file").replace("1 km\", inf", "1 m\", inf");
    std::fs::write(&path, text).expect("written");
    until(&mut window, "the new bounds are met", |window| titled(window, 0));
}
