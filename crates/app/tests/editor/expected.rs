//! Tests of the form for what a file expects: added, changed and removed in the inspector, and undone.

use egui::{Key, accesskit::Role};
use egui_kittest::{Harness, kittest::Queryable as _};
use orograph::editor::App;

use crate::{look, scratch, settle, until, window};

const HILLS: &str = "(
    world: (size: 3200, cells: 64),
    nodes: { \"hills\": Ridged(amplitude: 300) }, // not high
    outputs: { \"height\": \"hills\" },
)
";

/// A window on a file, whose settings the inspector shows.
fn settings(text: &str) -> (tempfile::TempDir, Harness<'static, App>) {
    let file = scratch(text);
    let mut window = window(Some(file.path().join("graph.ron")));
    settle(&mut window);
    window.run_steps(3);
    (file, window)
}

fn source(window: &Harness<'_, App>) -> String {
    window.state().session().document().source().to_owned()
}

/// Types into a field and presses Enter.
fn fill(window: &mut Harness<'_, App>, field: &str, text: &str) {
    window.get_by_role_and_label(Role::TextInput, field).focus();
    window.run_steps(2);
    window.get_by_role_and_label(Role::TextInput, field).type_text(text);
    window.run_steps(2);
    window.key_press(Key::Enter);
    window.run_steps(3);
}

#[test]
fn an_expectation_is_added_by_search_changed_and_removed() {
    let (_file, mut window) = settings(HILLS);
    window.get_by_label("➕ expectation").click();
    window.run_steps(4);
    // the search has the focus; the name is found by its words
    let search = window.query_all_by_role(Role::TextInput).find(|node| node.is_focused());
    search.expect("the search").type_text("slope p95");
    window.run_steps(3);
    assert!(window.query_by_role_and_label(Role::Button, "relief").is_none());
    window.get_by_role_and_label(Role::Button, "slope.p95").click();
    window.run_steps(4);
    assert!(source(&window).contains("expect: { \"slope.p95\": (-inf, inf) }"), "{}", source(&window));
    fill(&mut window, "highest slope.p95", "60");
    fill(&mut window, "lowest slope.p95", "2 °");
    let text = source(&window);
    assert!(text.contains("expect: { \"slope.p95\": (\"2 °\", 60) }") && text.contains("// not high"), "{text}");
    // contradictory bounds are refused beside the row
    fill(&mut window, "highest slope.p95", "1");
    assert!(window.query_by_label_contains("the lowest figure of `slope.p95` is above the highest").is_some());
    assert_eq!(source(&window), text);
    // one step each
    for _ in 0..3 {
        assert!(window.state_mut().session_mut().undo());
    }
    assert_eq!(source(&window), HILLS);
    for _ in 0..3 {
        assert!(window.state_mut().session_mut().redo());
    }
    window.run_steps(3);
    window.get_by_label("remove slope.p95").click();
    window.run_steps(3);
    assert_eq!(source(&window), HILLS);
}

#[test]
fn the_measured_part_and_its_cells_are_edited_in_place() {
    crate::draws();
    let with = HILLS.replace(" },\n)", " },\n    expect: { \"relief\": (\"1 km\", inf), \"peaks.count\": (0, 9) },\n)");
    let (_file, mut window) = settings(&with);
    let measured = |window: &Harness<'_, App>| {
        let expected = window.state().session().document().expectations().cloned().expect("expectations");
        (expected.part_m, expected.cell_m)
    };
    fill(&mut window, "part width", "1.6 km");
    assert_eq!(measured(&window).0, Some([0.0, 0.0, 1600.0, 3200.0]));
    fill(&mut window, "part x", "800");
    fill(&mut window, "measured cells", "90 m");
    assert_eq!(measured(&window), (Some([800.0, 0.0, 1600.0, 3200.0]), Some(90.0)));
    let text = source(&window);
    assert!(text.contains("\"relief\": (\"1 km\", inf), \"peaks.count\": (0, 9)"), "{text}");
    fill(&mut window, "part y", "2 km");
    assert!(window.query_by_label_contains("is not within the world").is_some());
    assert_eq!(source(&window), text);
    // the miss is marked in its row, as in the list of problems
    until(&mut window, "both rows are marked", |window| {
        let is_marked = |(mark, name): (&str, &str)| {
            let y = window.get_by_role_and_label(Role::Label, name).rect().center().y;
            window.query_all_by_label(mark).any(|node| (node.rect().center().y - y).abs() < 8.0)
        };
        [("⚠", "relief"), ("✔", "peaks.count")].into_iter().all(is_marked)
    });
    look(&mut window, "expectations");
}
