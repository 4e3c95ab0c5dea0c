//! Tests of routes of wires, and of notes on nodes.

use egui::{Key, Modifiers, PointerButton, Pos2, vec2};
use egui_kittest::{Harness, kittest::Queryable as _};
use orograph::editor::App;

use crate::{
    canvas::{ROW, document, window_on},
    hand::{at, button, click, drag, key, title, type_text, wheel},
    look,
};

const WIRE: &str = "point 1 of the wire into steps.height";

fn double_click(window: &mut Harness<'_, App>, pos: Pos2) {
    window.hover_at(pos);
    window.step();
    for pressed in [true, false, true, false] {
        button(window, pos, PointerButton::Primary, pressed, Modifiers::NONE);
    }
    window.run_steps(30);
}

fn places(window: &Harness<'_, App>) -> Vec<[f64; 2]> {
    document(window).reroutes().iter().flat_map(|way| way.places.clone()).collect()
}

fn middle(window: &Harness<'_, App>) -> Pos2 {
    at(window, "output ground.height").lerp(at(window, "input steps.height"), 0.5)
}

#[test]
fn a_wire_is_routed_by_hand() {
    crate::draws();
    let (mut window, folder) = window_on(ROW);
    let on_wire = middle(&window);
    double_click(&mut window, on_wire);
    assert_eq!(places(&window).len(), 1, "{}", document(&window).source());
    let before = at(&window, WIRE);
    assert!(before.distance(on_wire) < 12.0, "{before:?} {on_wire:?}");
    drag(&mut window, before, before + vec2(0.0, 60.0));
    let moved = places(&window);
    assert!(at(&window, WIRE).distance(before + vec2(0.0, 60.0)) < 12.0);
    let half = at(&window, WIRE).lerp(at(&window, "input steps.height"), 0.5);
    let menu = |window: &mut Harness<'_, App>, pos: Pos2| {
        window.hover_at(pos);
        window.step();
        button(window, pos, PointerButton::Secondary, true, Modifiers::NONE);
        button(window, pos, PointerButton::Secondary, false, Modifiers::NONE);
        window.run_steps(3);
    };
    menu(&mut window, half);
    window.get_by_label("Add a point").click();
    window.run_steps(30);
    assert_eq!(places(&window).len(), 2);
    assert_eq!(places(&window)[0], moved[0], "in the order of the wire");
    look(&mut window, "ways");

    window.state_mut().session_mut().save();
    let saved = std::fs::read_to_string(folder.path().join("graph.ron")).expect("saved");
    assert!(saved.contains("reroutes: {") && saved.contains("\"steps.height\": [("), "{saved}");
    let first = at(&window, WIRE);
    click(&mut window, first);
    key(&mut window, Modifiers::NONE, Key::Delete);
    assert_eq!(places(&window).len(), 1);
    let last = at(&window, WIRE);
    double_click(&mut window, last);
    assert_eq!(places(&window), [[0.0; 2]; 0]);
    window.state_mut().session_mut().undo();
    window.state_mut().session_mut().undo();
    assert_eq!(places(&window).len(), 2);
    menu(&mut window, first);
    window.get_by_label("Remove all points of the wire").click();
    window.run_steps(3);
    assert_eq!(places(&window), [[0.0; 2]; 0]);
    assert!(
        document(&window).graph().find("steps").is_ok_and(|steps| document(&window).graph().source(steps, 0).is_some())
    );
}

#[test]
fn a_route_moves_with_both_nodes_and_is_copied() {
    let (mut window, _folder) = window_on(ROW);
    let on_wire = middle(&window);
    double_click(&mut window, on_wire);
    let before = places(&window);
    let node = title(&window, "place");
    click(&mut window, node);
    key(&mut window, Modifiers::COMMAND, Key::A);
    let from = title(&window, "ground");
    drag(&mut window, from, from + vec2(48.0, 24.0));
    let after = places(&window);
    let by = [0, 1].map(|axis| after[0][axis] - before[0][axis]);
    assert!(by[0] > 20.0 && by[1] > 10.0, "{by:?}");
    key(&mut window, Modifiers::COMMAND, Key::D);
    assert_eq!(document(&window).reroutes().len(), 2);
    assert_eq!(document(&window).reroutes()[1].node, "steps2");
}

#[test]
fn a_note_is_shown_below_its_node() {
    crate::draws();
    let (mut window, folder) = window_on(ROW);
    let node = title(&window, "ground");
    click(&mut window, node);
    key(&mut window, Modifiers::NONE, Key::F2);
    window.key_press(Key::Tab);
    window.run_steps(3);
    type_text(&mut window, "Crests run east and west; the wavelength is a guess.");
    key(&mut window, Modifiers::NONE, Key::Enter);
    let note = |window: &Harness<'_, App>| document(window).nodes()[0].note.clone();
    assert_eq!(note(&window), "Crests run east and west; the wavelength is a guess.");
    assert_eq!(document(&window).nodes()[0].name, "ground");
    let node = title(&window, "ground");
    window.hover_at(node);
    window.step();
    wheel(&mut window, 5.0);
    look(&mut window, "note");
    window.state_mut().session_mut().save();
    let saved = std::fs::read_to_string(folder.path().join("graph.ron")).expect("saved");
    assert!(saved.contains("notes: {") && saved.contains("\"ground\": \"Crests"), "{saved}");
    window.state_mut().session_mut().undo();
    assert_eq!(note(&window), "");
}
