//! Tests of the canvas: selecting, moving, wiring, adding, copying and deleting nodes by mouse and keyboard.

use std::{fs, path::PathBuf};

use egui::{Event, Key, Modifiers, PointerButton, Pos2, Vec2, vec2};
use egui_kittest::{
    Harness,
    kittest::{NodeT as _, Queryable as _},
};
use orograph::editor::{App, NodeState};
use orograph_graph::Document;
use tempfile::TempDir;

use crate::{
    built, graph,
    hand::{at, button, click, click_with, drag, drag_with, key, pull, title, type_text, wheel},
    look, picture, settle, window,
};

/// Three nodes in a row, with positions; one has no wire.
pub const ROW: &str = "(
    format: 1,
    world: (size: \"8 km\", cells: 64, seed: 3),
    nodes: {
        \"ground\": Ridged(wavelength: \"5 km\"),
        \"steps\":  Terrace(height: \"ground\"),
        \"lonely\": Terrace(),
        \"place\":  Slope(height: \"ground\"),
    },
    outputs: { \"height\": \"steps\" },
    layout: { \"ground\": (0, 0), \"steps\": (300, 0), \"lonely\": (300, 340), \"place\": (0, 340) },
)
";

/// A window on a file with this text.
pub fn window_on(text: &str) -> (Harness<'static, App>, TempDir) {
    let folder = tempfile::tempdir().expect("there is a folder for temporary files");
    let path: PathBuf = folder.path().join("graph.ron");
    fs::write(&path, text).expect("the folder can be written to");
    let mut window = window(Some(path));
    window.state_mut().session_mut().set_cells(64);
    window.run_steps(4);
    (window, folder)
}

pub fn document<'a>(window: &'a Harness<'_, App>) -> &'a Document {
    window.state().session().document()
}

/// An empty point of the canvas.
pub fn ground(window: &Harness<'_, App>) -> Pos2 {
    window.get_by_label("graph").rect().center_bottom() - vec2(0.0, 12.0)
}

pub fn selection(window: &Harness<'_, App>) -> Vec<String> {
    window.state().session().selection().map(str::to_owned).collect()
}

pub fn source_of(window: &Harness<'_, App>, node: &str, input: usize) -> Option<String> {
    let graph = document(window).graph();
    let node = graph.find(node).expect("the node exists");
    graph.source(node, input).map(|port| graph.port_name(port))
}

pub fn place_of(window: &Harness<'_, App>, node: &str) -> Option<[f64; 2]> {
    document(window).nodes().iter().find(|entry| entry.name == node).and_then(|entry| entry.layout)
}

#[test]
fn all_nodes_are_shown_with_pins_and_thumbnails() {
    let window = built("hello.ron", 64);
    let pane = window.get_by_label("graph").rect();
    for node in ["ground", "rise", "rivers"] {
        let rect = window.get_by_label_contains(&format!("node {node}:")).rect();
        assert!(pane.contains_rect(rect), "{node} at {rect} in {pane}");
    }
    // Wires run from left to right where the file has no positions.
    assert!(at(&window, "output ground.height").x < at(&window, "input rivers.height").x);
    assert!(window.query_by_label("input rivers.uplift").is_some());
    assert!(document(&window).source() == fs::read_to_string(graph("hello.ron")).expect("it can be read"));
}

#[test]
fn clicks_select_and_ctrl_adds() {
    let (mut window, _folder) = window_on(ROW);
    let [ground_node, steps] = ["ground", "steps"].map(|node| title(&window, node));
    click(&mut window, ground_node);
    assert_eq!(selection(&window), ["ground"]);
    click_with(&mut window, steps, Modifiers::COMMAND);
    assert_eq!(selection(&window), ["ground", "steps"]);
    click_with(&mut window, ground_node, Modifiers::COMMAND);
    assert_eq!(selection(&window), ["steps"]);
    let empty = ground(&window);
    click(&mut window, empty);
    assert!(selection(&window).is_empty());
    window.state_mut().session_mut().select_only("place");
    window.run_steps(2);
    assert!(
        window.get_by_label_contains("node place:").accesskit_node().toggled() == Some(egui::accesskit::Toggled::True)
    );
}

#[test]
fn a_rectangle_selects_what_it_touches() {
    let (mut window, _folder) = window_on(ROW);
    let rect = window.get_by_label_contains("node ground:").rect();
    let other = window.get_by_label_contains("node steps:").rect();
    drag(&mut window, rect.left_top() - Vec2::splat(12.0), other.left_top() + Vec2::splat(20.0));
    assert_eq!(selection(&window), ["ground", "steps"]);
    let place = window.get_by_label_contains("node place:").rect();
    drag_with(&mut window, place.left_top() + vec2(-14.0, 4.0), place.left_top() + vec2(20.0, 12.0), Modifiers::SHIFT);
    assert_eq!(selection(&window), ["ground", "place", "steps"]);
}

#[test]
fn a_drag_moves_the_selection_in_one_step() {
    let (mut window, _folder) = window_on(ROW);
    let start = title(&window, "lonely");
    drag(&mut window, start, start + vec2(60.0, -40.0));
    let moved = place_of(&window, "lonely").expect("it has a place");
    assert!(moved[0] > 300.0 && moved[1] < 340.0, "{moved:?}");
    assert_eq!(place_of(&window, "ground"), Some([0.0, 0.0]));
    assert_eq!(document(&window).steps(), 1);
    assert!(window.state_mut().session_mut().undo());
    assert_eq!(document(&window).source(), ROW);
    window.run_steps(2);
    assert!((title(&window, "lonely") - start).length() < 1.0);
}

#[test]
fn a_drag_with_alt_duplicates() {
    let (mut window, _folder) = window_on(ROW);
    let start = title(&window, "steps");
    crate::hand::drag_with(&mut window, start, start + vec2(60.0, 140.0), Modifiers::ALT);
    assert_eq!(place_of(&window, "steps"), Some([300.0, 0.0]), "the node stays");
    let copy = place_of(&window, "steps2").expect("a copy");
    assert!(copy[0] > 300.0 && copy[1] > 60.0, "{copy:?}");
    assert_eq!((document(&window).steps(), selection(&window)), (1, vec!["steps2".to_owned()]));
    let graph = document(&window).graph();
    let source = graph.source(graph.find("steps2").expect("a node"), 0).expect("the copy is wired");
    assert_eq!(graph.port_name(source), "ground.height");
    assert!(window.state_mut().session_mut().undo());
    assert_eq!(document(&window).source(), ROW);
    // Without a movement there is no copy.
    window.run_steps(2);
    let start = title(&window, "steps");
    crate::hand::drag_with(&mut window, start, start, Modifiers::ALT);
    assert_eq!(document(&window).source(), ROW);
}

#[test]
fn a_cancelled_drag_changes_nothing() {
    let (mut window, _folder) = window_on(ROW);
    let start = title(&window, "lonely");
    window.hover_at(start);
    window.step();
    button(&mut window, start, PointerButton::Primary, true, Modifiers::NONE);
    window.hover_at(start + vec2(50.0, -40.0));
    window.run_steps(2);
    key(&mut window, Modifiers::NONE, Key::Escape);
    button(&mut window, start + vec2(50.0, -40.0), PointerButton::Primary, false, Modifiers::NONE);
    assert_eq!(document(&window).source(), ROW);
    assert!((title(&window, "lonely") - start).length() < 1.0);
}

#[test]
fn a_wire_is_drawn_from_pin_to_pin() {
    let (mut window, _folder) = window_on(ROW);
    let [from, to] = ["output ground.height", "input lonely.height"].map(|pin| at(&window, pin));
    drag(&mut window, from, to);
    assert_eq!(source_of(&window, "lonely", 0).as_deref(), Some("ground.height"));
    assert_eq!(document(&window).steps(), 1);
    // A wire can also be drawn from an input to an output; it replaces the old one.
    let [from, to] = ["input lonely.height", "output steps.height"].map(|pin| at(&window, pin));
    window.state_mut().session_mut().undo();
    window.run_steps(2);
    drag(&mut window, from, to);
    assert_eq!(source_of(&window, "lonely", 0).as_deref(), Some("steps.height"));
}

#[test]
fn a_wire_dropped_on_a_node_connects_to_a_matching_pin() {
    let (mut window, _folder) = window_on(ROW);
    let (from, to) = (at(&window, "output ground.height"), title(&window, "lonely"));
    drag(&mut window, from, to);
    assert_eq!(source_of(&window, "lonely", 0).as_deref(), Some("ground.height"));
}

#[test]
fn a_wire_that_does_not_fit_is_refused_with_the_reason() {
    let (mut window, _folder) = window_on(ROW);
    let [from, to] = ["output place.mask", "input lonely.height"].map(|pin| at(&window, pin));
    pull(&mut window, [from, to], 4, |_| {});
    window.run_steps(2);
    assert!(
        window.query_all_by_label_contains("takes a height").next().is_some(),
        "the reason is shown during the drag"
    );
    button(&mut window, to, PointerButton::Primary, false, Modifiers::NONE);
    assert_eq!(document(&window).source(), ROW);
    window.run_steps(2);
    assert!(window.query_all_by_label_contains("takes a height").next().is_some(), "and after it was let go");
}

#[test]
fn cycles_are_refused() {
    let (mut window, _folder) = window_on(&ROW.replace("Terrace()", "Terrace(height: \"steps\")"));
    let [from, to] = ["output lonely.height", "input steps.height"].map(|pin| at(&window, pin));
    let before = document(&window).source().to_owned();
    drag(&mut window, from, to);
    assert_eq!(document(&window).source(), before);
    assert!(window.query_all_by_label_contains("cycle").next().is_some());
}

#[test]
fn a_detached_wire_is_removed_or_reconnected() {
    let (mut window, _folder) = window_on(ROW);
    let [from, to] = ["input steps.height", "input lonely.height"].map(|pin| at(&window, pin));
    drag(&mut window, from, to);
    assert_eq!(source_of(&window, "steps", 0), None);
    assert_eq!(source_of(&window, "lonely", 0).as_deref(), Some("ground.height"));
    assert_eq!(document(&window).steps(), 1);
    let (from, empty) = (at(&window, "input lonely.height"), ground(&window));
    drag(&mut window, from, empty);
    assert_eq!(source_of(&window, "lonely", 0), None);
}

#[test]
fn a_wire_dropped_on_empty_space_offers_matching_nodes() {
    let (mut window, _folder) = window_on(ROW);
    let (from, empty) = (at(&window, "output place.mask"), ground(&window) - vec2(0.0, 10.0));
    drag(&mut window, from, empty);
    window.run_steps(3);
    type_text(&mut window, "import");
    assert!(window.query_by_label("Import").is_none(), "it takes nothing");
    for _ in 0..6 {
        key(&mut window, Modifiers::NONE, Key::Backspace);
    }
    type_text(&mut window, "blend");
    let before = document(&window).nodes().len();
    key(&mut window, Modifiers::NONE, Key::Enter);
    assert_eq!(document(&window).nodes().len(), before + 1);
    let graph = document(&window).graph();
    let place = graph.find("place").expect("it exists");
    let new = graph.find("blend").expect("it was added");
    let inputs = 0..graph.instance(new).node.inputs.len();
    assert!(inputs.filter_map(|input| graph.source(new, input)).any(|port| port.node == place));
    assert_eq!(document(&window).steps(), 1);
    assert_eq!(selection(&window), ["blend"]);
}

#[test]
fn the_palette_adds_a_node_at_the_pointer() {
    let (mut window, _folder) = window_on(ROW);
    for (opener, name) in [(Key::Tab, "ridged"), (Key::Space, "ridged2")] {
        let empty = ground(&window) - vec2(0.0, 20.0);
        window.hover_at(empty);
        window.run_steps(2);
        key(&mut window, Modifiers::NONE, opener);
        type_text(&mut window, "ridg");
        key(&mut window, Modifiers::NONE, Key::Enter);
        assert!(document(&window).graph().find(name).is_ok(), "{}", document(&window).source());
        assert!((title(&window, name) - empty).length() < 40.0);
        assert_eq!(selection(&window), [name]);
    }
    key(&mut window, Modifiers::NONE, Key::Tab);
    let before = document(&window).source().to_owned();
    key(&mut window, Modifiers::NONE, Key::Escape);
    key(&mut window, Modifiers::NONE, Key::Enter);
    assert_eq!(document(&window).source(), before);
}

#[test]
fn a_new_node_is_wired_to_the_selected_one() {
    let (mut window, _folder) = window_on(ROW);
    let place = title(&window, "place");
    click(&mut window, place);
    let add = |window: &mut Harness<'_, App>, kind: &str| {
        window.hover_at(ground(window) - vec2(0.0, 20.0));
        window.run_steps(2);
        key(window, Modifiers::NONE, Key::Tab);
        type_text(window, kind);
        key(window, Modifiers::NONE, Key::Enter);
    };
    // The first output of `place` is no height, and neither are the others.
    add(&mut window, "thermal");
    assert_eq!(source_of(&window, "thermal", 0), None);
    let steps = title(&window, "steps");
    click(&mut window, steps);
    add(&mut window, "slope");
    assert_eq!(source_of(&window, "slope", 0).as_deref(), Some("steps.height"));
    assert_eq!(document(&window).steps(), 2, "one undo removes the node and its wire");
    // A generator needs no wire.
    let steps = title(&window, "steps");
    click(&mut window, steps);
    add(&mut window, "ridged");
    assert!(
        (0..document(&window)
            .graph()
            .instance(document(&window).graph().find("ridged").expect("added"))
            .node
            .inputs
            .len())
            .all(|input| source_of(&window, "ridged", input).is_none())
    );
}

#[test]
fn no_key_is_lost_between_slow_frames() {
    let (mut window, _folder) = window_on(ROW);
    let empty = ground(&window) - vec2(0.0, 20.0);
    window.hover_at(empty);
    window.run_steps(2);
    let press = |window: &mut Harness<'_, App>, modifiers: Modifiers, key: Key| {
        window.event(Event::Key { key, physical_key: None, pressed: true, repeat: false, modifiers });
    };
    press(&mut window, Modifiers::NONE, Key::Tab);
    for letter in [Key::S, Key::L, Key::O] {
        press(&mut window, Modifiers::NONE, letter);
        window.event(Event::Text(letter.name().to_lowercase()));
    }
    window.step();
    for letter in [Key::P, Key::E] {
        window.event(Event::Text(letter.name().to_lowercase()));
    }
    press(&mut window, Modifiers::NONE, Key::Enter);
    window.run_steps(2);
    assert_eq!(selection(&window), ["slope"]);
    // Each paste adds a copy beside the previous one.
    for _ in 0..2 {
        press(&mut window, Modifiers::COMMAND, Key::D);
    }
    window.run_steps(2);
    assert_eq!((selection(&window), document(&window).steps()), (vec!["slope3".to_owned()], 3));
    let first = title(&window, "slope2");
    assert!((title(&window, "slope3") - first).length() > 8.0);
}

#[test]
fn an_empty_graph_shows_a_hint() {
    let mut window = window(None);
    window.run_steps(3);
    window.hover_at(window.get_by_label("graph").rect().center());
    window.run_steps(2);
    key(&mut window, Modifiers::NONE, Key::Tab);
    type_text(&mut window, "ridged");
    key(&mut window, Modifiers::NONE, Key::Enter);
    assert_eq!(document(&window).nodes().len(), 1);
    settle(&mut window);
    assert_eq!(window.state().session().node("ridged").state, NodeState::Fresh);
}

#[test]
fn wires_of_deleted_nodes_are_reconnected() {
    let (mut window, _folder) = window_on(&ROW.replace("Terrace()", "Terrace(height: \"steps\")"));
    let steps = title(&window, "steps");
    click(&mut window, steps);
    key(&mut window, Modifiers::NONE, Key::Delete);
    assert_eq!(document(&window).nodes().len(), 3);
    assert_eq!(source_of(&window, "lonely", 0).as_deref(), Some("ground.height"));
    assert_eq!(document(&window).outputs().len(), 1, "the output of the file reads what is left");
    assert_eq!(document(&window).steps(), 1);
}

#[test]
fn a_wire_is_selected_and_deleted() {
    let (mut window, _folder) = window_on(ROW);
    let [from, to] = ["output ground.height", "input steps.height"].map(|pin| at(&window, pin));
    click(&mut window, from.lerp(to, 0.5));
    key(&mut window, Modifiers::NONE, Key::Backspace);
    assert_eq!(source_of(&window, "steps", 0), None);
    assert_eq!(document(&window).nodes().len(), 4);
}

#[test]
fn a_node_dropped_on_a_wire_is_inserted() {
    let (mut window, _folder) = window_on(ROW);
    let [from, to] = ["output ground.height", "input steps.height"].map(|pin| at(&window, pin));
    let start = title(&window, "lonely");
    drag(&mut window, start, from.lerp(to, 0.5) - vec2(0.0, 6.0));
    assert_eq!(source_of(&window, "lonely", 0).as_deref(), Some("ground.height"));
    assert_eq!(source_of(&window, "steps", 0).as_deref(), Some("lonely.height"));
    assert_eq!(document(&window).steps(), 1);
}

#[test]
fn a_node_laid_with_its_pins_on_a_wire_is_inserted_and_the_next_ones_make_room() {
    let (mut window, _folder) = window_on(ROW);
    let [from, to] = ["output ground.height", "input steps.height"].map(|pin| at(&window, pin));
    let [start, pin] = [title(&window, "lonely"), at(&window, "input lonely.height")];
    // The input lies on the wire, close to the node that reads it.
    drag(&mut window, start, start + (from.lerp(to, 0.9) - pin));
    assert_eq!(source_of(&window, "lonely", 0).as_deref(), Some("ground.height"));
    assert_eq!(source_of(&window, "steps", 0).as_deref(), Some("lonely.height"));
    let [new, after] = ["lonely", "steps"].map(|node| place_of(&window, node).expect("it has a place")[0]);
    assert!(after >= new + 180.0, "{new} {after}");
    assert_eq!(document(&window).steps(), 1);
}

#[test]
fn menus_act_on_their_subject() {
    let (mut window, _folder) = window_on(ROW);
    let [from, to] = ["output ground.height", "input steps.height"].map(|pin| at(&window, pin));
    let middle = from.lerp(to, 0.5);
    window.hover_at(middle);
    window.step();
    button(&mut window, middle, PointerButton::Secondary, true, Modifiers::NONE);
    button(&mut window, middle, PointerButton::Secondary, false, Modifiers::NONE);
    window.run_steps(4);
    window.get_by_label_contains("Insert a node").click();
    window.run_steps(4);
    type_text(&mut window, "terrace");
    key(&mut window, Modifiers::NONE, Key::Enter);
    assert_eq!(source_of(&window, "terrace", 0).as_deref(), Some("ground.height"));
    assert_eq!(source_of(&window, "steps", 0).as_deref(), Some("terrace.height"));
    // the nodes after the wire make room
    let [before, new, after] =
        ["ground", "terrace", "steps"].map(|node| place_of(&window, node).expect("it has a place")[0]);
    assert!(new >= before + 180.0 && after >= new + 180.0, "{before} {new} {after}");
    assert_eq!(document(&window).steps(), 1);
}

#[test]
fn nodes_are_aligned_and_arranged() {
    let (mut window, _folder) = window_on(ROW);
    let empty = ground(&window);
    window.hover_at(empty);
    window.run_steps(2);
    key(&mut window, Modifiers::NONE, Key::L);
    let [a, b] = ["ground", "steps"].map(|node| place_of(&window, node).expect("it has a place"));
    assert!(a[0] < b[0], "wires run from left to right");
    assert_eq!(document(&window).steps(), 1);
}

#[test]
fn a_node_is_found_and_renamed() {
    let (mut window, _folder) = window_on(ROW);
    let empty = ground(&window);
    window.hover_at(empty);
    window.run_steps(2);
    key(&mut window, Modifiers::COMMAND, Key::F);
    type_text(&mut window, "slo");
    assert_eq!(selection(&window), ["place"]);
    key(&mut window, Modifiers::NONE, Key::Escape);
    key(&mut window, Modifiers::NONE, Key::F2);
    type_text(&mut window, "steep");
    key(&mut window, Modifiers::NONE, Key::Enter);
    assert!(document(&window).graph().find("steep").is_ok(), "{}", document(&window).source());
    assert_eq!(selection(&window), ["steep"]);
}

#[test]
fn the_wheel_zooms_and_home_shows_all() {
    let (mut window, _folder) = window_on(ROW);
    let node = title(&window, "ground");
    window.hover_at(node);
    window.run_steps(2);
    let before = window.get_by_label_contains("node ground:").rect();
    wheel(&mut window, 2.0);
    let after = window.get_by_label_contains("node ground:").rect();
    assert!((after.width() / before.width() - 2.0_f32.sqrt()).abs() < 0.02, "{before} {after}");
    assert!((title(&window, "ground") - node).length() < 20.0, "what is under the pointer stays there");
    key(&mut window, Modifiers::NONE, Key::Home);
    let home = window.get_by_label_contains("node ground:").rect();
    assert!((home.width() - before.width()).abs() < 1.0);
}

#[test]
fn unknown_node_types_are_shown_and_kept() {
    let (mut window, _folder) = window_on(&ROW.replace("Terrace()", "Terraze()"));
    let node = title(&window, "lonely");
    click(&mut window, node);
    assert_eq!(selection(&window), ["lonely"]);
    drag(&mut window, node, node + vec2(40.0, -30.0));
    assert!(document(&window).source().contains("Terraze()"));
}

#[test]
fn the_canvas_is_drawn_in_both_themes_at_any_size() {
    crate::draws();
    for (name, size, scale, theme) in [
        ("canvas_dark", [1280.0, 800.0], 1.0, egui::Theme::Dark),
        ("canvas_light", [1280.0, 800.0], 1.0, egui::Theme::Light),
        ("canvas_small", [400.0, 300.0], 1.0, egui::Theme::Dark),
        ("canvas_scaled", [900.0, 600.0], 1.5, egui::Theme::Dark),
    ] {
        let mut window = window(Some(graph("hello.ron")));
        window.set_size(size.into());
        window.set_pixels_per_point(scale);
        window.ctx.set_theme(theme);
        window.state_mut().session_mut().set_cells(64);
        settle(&mut window);
        if name == "canvas_small" {
            window.get_by_label("Graph").click();
            window.run_steps(4);
        }
        let pane = window.get_by_label("graph").rect();
        let Some(picture) = picture(&mut window, name) else { return };
        let pixel = |at: Pos2| picture.get_pixel((at.x * scale) as u32, (at.y * scale) as u32).0;
        let corner = pixel(pane.right_top() + vec2(-7.0, 7.0));
        assert_eq!(corner[0] < 128, theme == egui::Theme::Dark, "{name}: {corner:?}");
        if scale == 1.0 {
            let node = title(&window, "rivers");
            click(&mut window, node);
            wheel(&mut window, 7.0);
            look(&mut window, &format!("{name}_near"));
        }
    }
}

#[test]
fn undo_and_redo_have_keys_and_notes_are_shown() {
    let (mut window, _folder) = window_on(ROW);
    let steps = title(&window, "steps");
    click(&mut window, steps);
    key(&mut window, Modifiers::NONE, Key::Delete);
    let deleted = document(&window).source().to_owned();
    key(&mut window, Modifiers::COMMAND, Key::Z);
    assert_eq!(document(&window).source(), ROW);
    key(&mut window, Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    assert_eq!(document(&window).source(), deleted);
    key(&mut window, Modifiers::COMMAND, Key::Z);
    key(&mut window, Modifiers::COMMAND, Key::Y);
    assert_eq!(document(&window).source(), deleted);
    window.state_mut().session_mut().note("the river is dry", true);
    window.run_steps(3);
    assert!(window.query_by_label("the river is dry").is_some());
    window.input_mut().time = Some(1000.0);
    window.run_steps(2);
    assert!(window.query_by_label("the river is dry").is_none(), "it goes after a while");
}

#[test]
fn a_node_without_its_wire_waits_and_has_not_failed() {
    crate::draws();
    let (mut window, _folder) = window_on(ROW);
    settle(&mut window);
    let state = window.state().session().node("lonely").state;
    assert_eq!(state, NodeState::Unwired { input: "height", at: None });
    assert_eq!(state.lacks().as_deref(), Some("Needs an input: height"));
    assert!(window.query_by_label_contains("failed").is_none());
    let lonely = title(&window, "lonely");
    click(&mut window, lonely);
    assert!(window.query_by_label("Needs an input: height").is_some());
    wheel(&mut window, 4.0);
    look(&mut window, "waiting");
}

#[test]
fn nodes_are_muted_and_unmuted() {
    let (mut window, _folder) = window_on(ROW);
    let muted = |window: &Harness<'_, App>| {
        let nodes = document(window).nodes().iter().filter(|node| node.muted);
        nodes.map(|node| node.name.clone()).collect::<Vec<_>>()
    };
    let steps = title(&window, "steps");
    click(&mut window, steps);
    key(&mut window, Modifiers::NONE, Key::M);
    assert_eq!(muted(&window), ["steps"]);
    assert_eq!(source_of(&window, "steps", 0).as_deref(), Some("ground.height"));
    key(&mut window, Modifiers::COMMAND, Key::D);
    assert_eq!(muted(&window), ["steps", "steps2"]);
    key(&mut window, Modifiers::NONE, Key::M);
    assert_eq!(muted(&window), ["steps"]);
}

#[test]
fn a_large_graph_is_opened_where_it_can_be_read() {
    crate::draws();
    let mut nodes = vec!["\"n0\": Ridged()".to_owned()];
    nodes.extend((1..40).map(|number| format!("\"n{number}\": Terrace(height: \"n{}\")", number - 1)));
    let text = format!("(world: (cells: 16), nodes: {{ {} }}, outputs: {{ \"h\": \"n39\" }})", nodes.join(", "));
    let (mut window, _folder) = window_on(&text);
    settle(&mut window);
    let pane = window.get_by_label("graph").rect();
    let last = window.get_by_label_contains("node n39:").rect();
    assert!(last.width() > 80.0 && pane.contains_rect(last), "{last} in {pane}");
    let overview = window.get_by_label("overview").rect();
    assert!(!overview.intersects(last), "{overview} lies over {last}");
    look(&mut window, "large");
    // A click does not move the view.
    let node = title(&window, "n39");
    click(&mut window, node);
    assert_eq!(window.get_by_label_contains("node n39:").rect(), last);
    key(&mut window, Modifiers::NONE, Key::Home);
    let [first, last] = ["node n0:", "node n39:"].map(|label| window.get_by_label_contains(label).rect());
    assert!(pane.contains_rect(first) && pane.contains_rect(last), "all of it: {first} {last}");
    assert!(last.width() < 40.0);
}
