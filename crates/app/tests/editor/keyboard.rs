//! Tests of the keyboard: its focus follows the pointer to the graph, and a refused name is not lost.

use egui::{Event, Key, Modifiers, Pos2, vec2};
use egui_kittest::{Harness, kittest::Queryable as _};
use orograph::editor::App;

use crate::{
    canvas::{ROW, document, ground, place_of, source_of, window_on},
    hand::{click, key, title, type_text},
    look,
};

fn names(window: &Harness<'_, App>) -> Vec<String> {
    document(window).nodes().iter().map(|node| node.name.clone()).collect()
}

fn point(window: &mut Harness<'_, App>, at: Pos2) {
    window.hover_at(at);
    window.run_steps(3);
}

#[test]
fn the_graph_has_the_keys_again_after_tab_elsewhere() {
    let (mut window, _folder) = window_on(ROW);
    let lonely = title(&window, "lonely");
    click(&mut window, lonely);
    // Over the viewport, Tab moves the focus through the buttons, as everywhere.
    point(&mut window, egui::pos2(500.0, 250.0));
    for _ in 0..3 {
        key(&mut window, Modifiers::NONE, Key::Tab);
    }
    assert!(window.ctx.memory(|memory| memory.focused().is_some()), "a button has the focus");
    let empty = ground(&window) - vec2(0.0, 20.0);
    point(&mut window, empty);
    key(&mut window, Modifiers::NONE, Key::M);
    assert!(document(&window).nodes().iter().any(|node| node.name == "lonely" && node.muted));
    key(&mut window, Modifiers::NONE, Key::Delete);
    assert_eq!(names(&window), ["ground", "steps", "place"]);
    key(&mut window, Modifiers::NONE, Key::Tab);
    type_text(&mut window, "ridg");
    key(&mut window, Modifiers::NONE, Key::Enter);
    assert!(names(&window).contains(&"ridged".to_owned()), "{:?}", names(&window));
}

#[test]
fn a_text_field_keeps_the_keys_while_the_pointer_is_over_the_graph() {
    let (mut window, _folder) = window_on(ROW);
    let lonely = title(&window, "lonely");
    click(&mut window, lonely);
    let field = window.query_all_by_role(egui::accesskit::Role::TextInput).next().expect("a value");
    let field = field.rect().center();
    click(&mut window, field);
    let empty = ground(&window) - vec2(0.0, 20.0);
    point(&mut window, empty);
    key(&mut window, Modifiers::NONE, Key::M);
    key(&mut window, Modifiers::NONE, Key::Delete);
    assert_eq!(document(&window).source(), ROW, "the keys go to the field");
}

/// Ctrl+S and Ctrl+Q count what is still in its field.
#[test]
fn what_is_typed_counts_before_the_file_is_saved_or_closed() {
    let (mut window, _folder) = window_on(ROW);
    let saved = |window: &Harness<'_, App>| {
        let path = window.state().session().path().expect("a file").to_owned();
        std::fs::read_to_string(path).expect("readable")
    };
    let lonely = title(&window, "lonely");
    click(&mut window, lonely);
    window.get_by_label("note").focus();
    window.run_steps(2);
    type_text(&mut window, "an early draft");
    key(&mut window, Modifiers::COMMAND, Key::S);
    assert!(saved(&window).contains("an early draft"), "{}", saved(&window));
    let lonely = title(&window, "lonely");
    click(&mut window, lonely);
    key(&mut window, Modifiers::NONE, Key::F2);
    type_text(&mut window, "renamed");
    key(&mut window, Modifiers::COMMAND, Key::S);
    assert!(saved(&window).contains("\"renamed\""), "{}", saved(&window));
    window.get_by_label("note").focus();
    window.run_steps(2);
    type_text(&mut window, ", and more");
    key(&mut window, Modifiers::COMMAND, Key::Q);
    assert!(document(&window).source().contains("an early draft, and more"), "{}", document(&window).source());
    let session = window.state().session();
    assert!(session.question().is_some() && !session.is_over(), "it asks whether to save");
}

#[test]
fn a_refused_name_stays_in_its_field_with_its_note() {
    let (mut window, _folder) = window_on(ROW);
    let lonely = title(&window, "lonely");
    click(&mut window, lonely);
    key(&mut window, Modifiers::NONE, Key::F2);
    type_text(&mut window, "high steps");
    key(&mut window, Modifiers::NONE, Key::Tab);
    type_text(&mut window, "for later");
    key(&mut window, Modifiers::NONE, Key::Enter);
    assert!(names(&window).contains(&"lonely".to_owned()));
    assert!(window.query_all_by_label_contains("`high steps`").next().is_some(), "the reason is shown");
    let fields = |window: &Harness<'_, App>| -> Vec<String> {
        window.query_all_by_role(egui::accesskit::Role::TextInput).filter_map(|field| field.value()).collect()
    };
    let typed = fields(&window);
    assert!(["high steps", "for later"].iter().all(|text| typed.contains(&(*text).to_owned())), "{typed:?}");
    // The name field has the focus again, with all of its text selected.
    window.run_steps(3);
    type_text(&mut window, "high_steps");
    key(&mut window, Modifiers::NONE, Key::Enter);
    assert!(names(&window).contains(&"high_steps".to_owned()), "{:?}", names(&window));
    assert!(document(&window).source().contains("for later"));
    // A click elsewhere loses nothing either; Escape discards both.
    key(&mut window, Modifiers::NONE, Key::F2);
    type_text(&mut window, "two words");
    let empty = ground(&window);
    click(&mut window, empty);
    assert!(fields(&window).contains(&"two words".to_owned()), "{:?}", fields(&window));
    window.event(Event::Key {
        key: Key::Escape,
        physical_key: None,
        pressed: true,
        repeat: false,
        modifiers: Modifiers::NONE,
    });
    window.run_steps(3);
    assert!(!fields(&window).contains(&"two words".to_owned()));
    assert!(names(&window).contains(&"high_steps".to_owned()));
}

#[test]
fn a_click_on_the_help_button_opens_the_legend() {
    let (mut window, _folder) = window_on(ROW);
    let help = crate::hand::at(&window, "colours and keys");
    point(&mut window, egui::pos2(500.0, 250.0));
    assert!(window.query_by_label("Wires").is_none());
    click(&mut window, help);
    // It stays while the pointer is elsewhere.
    point(&mut window, egui::pos2(500.0, 250.0));
    window.run_steps(60);
    assert!(window.query_by_label("Wires").is_some() && window.query_by_label("Zoom, pan").is_some());
    click(&mut window, egui::pos2(500.0, 250.0));
    assert!(window.query_by_label("Wires").is_none(), "a click elsewhere closes it");
}

#[test]
fn nodes_are_moved_and_wired_by_keys() {
    let (mut window, _folder) = window_on(ROW);
    let lonely = title(&window, "lonely");
    click(&mut window, lonely);
    for (way, by) in [
        (Key::ArrowRight, [1.0, 0.0]),
        (Key::ArrowDown, [0.0, 1.0]),
        (Key::ArrowLeft, [-1.0, 0.0]),
        (Key::ArrowUp, [0.0, -1.0]),
    ] {
        let before = place_of(&window, "lonely").expect("it is in the layout");
        key(&mut window, Modifiers::NONE, way);
        let after = place_of(&window, "lonely").expect("it is in the layout");
        let moved = [0, 1].map(|axis| (after[axis] - before[axis]).signum() * f64::from(after[axis] != before[axis]));
        assert_eq!(moved, by, "{before:?} {after:?}");
    }
    // steps of separate presses are undone one by one
    let place = place_of(&window, "lonely");
    key(&mut window, Modifiers::NONE, Key::ArrowLeft);
    key(&mut window, Modifiers::NONE, Key::ArrowLeft);
    window.state_mut().session_mut().undo();
    window.state_mut().session_mut().undo();
    window.run_steps(2);
    assert_eq!(place_of(&window, "lonely"), place);
    // connected by a list, with words to narrow it
    assert_eq!(source_of(&window, "lonely", 0), None);
    key(&mut window, Modifiers::NONE, Key::W);
    type_text(&mut window, "ground lonely.height");
    key(&mut window, Modifiers::NONE, Key::Enter);
    assert_eq!(source_of(&window, "lonely", 0).as_deref(), Some("ground.height"));
    // the graph has the keys again
    key(&mut window, Modifiers::NONE, Key::W);
    type_text(&mut window, "disconnect height");
    key(&mut window, Modifiers::NONE, Key::Enter);
    assert_eq!(source_of(&window, "lonely", 0), None);
    // nothing that would close a cycle is offered
    key(&mut window, Modifiers::NONE, Key::W);
    type_text(&mut window, "lonely.height steps.height");
    key(&mut window, Modifiers::NONE, Key::Enter);
    assert_eq!(source_of(&window, "steps", 0).as_deref(), Some("lonely.height"));
    key(&mut window, Modifiers::NONE, Key::W);
    type_text(&mut window, "steps");
    window.run_steps(2);
    assert!(window.query_by_label("disconnect lonely.height from steps.height").is_some());
    assert!(window.query_by_label_contains("steps.height to lonely.height").is_none());
    key(&mut window, Modifiers::NONE, Key::Escape);
    window.state_mut().session_mut().undo();
    window.run_steps(2);
    let ground_node = title(&window, "ground");
    click(&mut window, ground_node);
    key(&mut window, Modifiers::NONE, Key::W);
    window.run_steps(2);
    look(&mut window, "connect");
    assert!(window.query_by_label("ground.height to lonely.height").is_some());
    assert!(window.query_by_label("disconnect ground.height from steps.height").is_some());
    key(&mut window, Modifiers::NONE, Key::Escape);
    assert!(window.query_by_label("ground.height to lonely.height").is_none());
    // without a selection the arrows move the view
    let empty = ground(&window);
    click(&mut window, empty);
    let before = title(&window, "place");
    key(&mut window, Modifiers::NONE, Key::ArrowLeft);
    assert!(title(&window, "place").x > before.x + 20.0);
}

#[test]
fn f_frames_the_selection_and_v_pins_it() {
    let (mut window, _folder) = window_on(ROW);
    let pane = window.get_by_label("graph").rect();
    let lonely = title(&window, "lonely");
    click(&mut window, lonely);
    let before = window.get_by_label_contains("node lonely:").rect();
    key(&mut window, Modifiers::NONE, Key::F);
    let after = window.get_by_label_contains("node lonely:").rect();
    assert!(after.width() >= before.width() && after.center().distance(pane.center()) < 2.0, "{before} {after} {pane}");
    key(&mut window, Modifiers::NONE, Key::V);
    assert_eq!(window.state().session().pinned(), Some("lonely.height"));
    key(&mut window, Modifiers::NONE, Key::V);
    assert_eq!(window.state().session().pinned(), None);
}
