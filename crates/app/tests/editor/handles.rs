//! Tests of handles without a mouse: they are reached, moved, added, removed and typed by keys.

use egui::{Event, Key, Modifiers, accesskit::Role};
use egui_kittest::{
    Harness,
    kittest::{NodeT as _, Queryable as _},
};
use orograph::editor::App;
use orograph_graph::{Edit, ParamValue};

use crate::{
    device,
    hand::{key, type_text},
    inspector::param,
    look, scratch, settle, window,
};

const LAND: &str = r#"(
    format: 1,
    world: (size: "1 km", cells: 128, seed: 3),
    nodes: {
        "hole": Crater(version: 2, pattern: one, centre: (250, 250), diameter: 150),
        "way":  Path(points: [(200, 200), (at: (500, 400), width: 40), (800, 300)]),
        "hill": Gradient(centre: (500, 500), azimuth: 90, length: 400, to: 20),
    },
    outputs: { "height": "hole" },
)"#;

/// A window on the map view, with a node selected. The pointer is nowhere.
fn opened(node: &str) -> (tempfile::TempDir, Harness<'static, App>) {
    opened_on(LAND, node)
}

fn opened_on(text: &str, node: &str) -> (tempfile::TempDir, Harness<'static, App>) {
    let folder = scratch(text);
    let mut window = window(Some(folder.path().join("graph.ron")));
    window.state_mut().session_mut().set_cells(64);
    window.state_mut().session_mut().select_only(node);
    settle(&mut window);
    window.event(Event::PointerGone);
    // The map has the same keys without a mouse: from the View menu.
    window.get_by_label("View").click();
    window.run_steps(3);
    window.get_by_label("Map 2").click();
    window.run_steps(3);
    (folder, window)
}

/// The name of what has the keyboard.
fn focused(window: &Harness<'_, App>) -> String {
    let mut all = window.query_all_by(|node| node.is_focused());
    all.next().and_then(|node| node.accesskit_node().label()).unwrap_or_default()
}

fn way(window: &Harness<'_, App>) -> Vec<([f64; 2], Option<f64>)> {
    points(window, "way")
}

fn points(window: &Harness<'_, App>, node: &str) -> Vec<([f64; 2], Option<f64>)> {
    match param(window, node, "points") {
        ParamValue::Waypoints(points) => points.iter().map(|point| (point.at, point.width)).collect(),
        other => panic!("not the points of a path: {other:?}"),
    }
}

fn steps(window: &Harness<'_, App>) -> usize {
    window.state().session().document().steps()
}

/// A key goes down, is repeated, or goes up, in a frame of its own.
fn hold(window: &mut Harness<'_, App>, key: Key, pressed: bool, repeat: bool) {
    window.event(Event::Key { key, physical_key: None, pressed, repeat, modifiers: Modifiers::NONE });
    window.step();
}

fn next(window: &mut Harness<'_, App>) {
    key(window, Modifiers::COMMAND, Key::J);
}

#[test]
fn points_are_reached_and_moved_by_keys() {
    crate::draws();
    let (_folder, mut window) = opened("way");
    next(&mut window);
    assert_eq!(focused(&window), "point 1 of points: x 200 m, y 200 m");
    key(&mut window, Modifiers::NONE, Key::Tab);
    assert_eq!(focused(&window), "point 2 of points: x 500 m, y 400 m");
    look(&mut window, "handle_with_keyboard");
    key(&mut window, Modifiers::NONE, Key::ArrowRight);
    let step = way(&window)[1].0[0] - 500.0;
    assert!(step > 0.0 && step <= 50.0, "{step}");
    assert_eq!(way(&window)[1], ([500.0 + step, 400.0], Some(40.0)));
    key(&mut window, Modifiers::NONE, Key::ArrowUp);
    key(&mut window, Modifiers::SHIFT, Key::ArrowLeft);
    assert_eq!(way(&window)[1].0, [500.0 - 9.0 * step, 400.0 - step]);
    assert_eq!(steps(&window), 3, "each press is an undo step");
    assert_eq!(focused(&window).split(':').next(), Some("point 2 of points"), "the keyboard stays");
    let before = way(&window)[1].0;
    key(&mut window, Modifiers::COMMAND, Key::ArrowDown);
    assert_eq!(way(&window)[1].0, [before[0], before[1] + 1000.0 / 128.0], "a cell of the world");
    key(&mut window, Modifiers::COMMAND | Modifiers::SHIFT, Key::J);
    assert_eq!(focused(&window), "point 1 of points: x 200 m, y 200 m");
    key(&mut window, Modifiers::NONE, Key::Escape);
    assert_eq!(focused(&window), "");
}

#[test]
fn a_held_key_is_one_undo_step() {
    let (_folder, mut window) = opened("way");
    next(&mut window);
    hold(&mut window, Key::ArrowDown, true, false);
    for _ in 0..5 {
        hold(&mut window, Key::ArrowDown, true, true);
    }
    hold(&mut window, Key::ArrowDown, false, false);
    window.step();
    assert!(way(&window)[0].0[1] > 220.0, "{:?}", way(&window));
    assert_eq!(steps(&window), 1);
    key(&mut window, Modifiers::NONE, Key::ArrowDown);
    assert_eq!(steps(&window), 2);
    window.state_mut().session_mut().undo();
    window.state_mut().session_mut().undo();
    assert_eq!(way(&window)[0].0, [200.0, 200.0]);
}

/// An arrow key stays down while the keyboard goes to the next handle, while another arrow key is pressed, while
/// another node is selected, and when the handles are left.
#[test]
fn a_held_key_moves_each_handle_in_an_undo_step_of_its_own() {
    crate::draws();
    let (_folder, mut window) = opened("way");
    next(&mut window);
    hold(&mut window, Key::ArrowDown, true, false);
    hold(&mut window, Key::ArrowDown, true, true);
    let first = way(&window)[0].0;
    key(&mut window, Modifiers::NONE, Key::Tab);
    hold(&mut window, Key::ArrowDown, true, true);
    hold(&mut window, Key::ArrowDown, true, true);
    let moved = way(&window);
    assert!(first[1] > 200.0 && moved[0].0 == first && moved[1].0[1] > 400.0, "{moved:?}");
    assert_eq!(steps(&window), 2);
    hold(&mut window, Key::ArrowRight, true, false);
    assert_eq!(steps(&window), 3, "another key");
    window.state_mut().session_mut().undo();
    window.state_mut().session_mut().undo();
    assert_eq!((way(&window)[0].0, way(&window)[1].0), (first, [500.0, 400.0]));

    // Another tool ends the step: an edit that goes on for a while is not a part of it.
    window.run_steps(2);
    hold(&mut window, Key::ArrowRight, true, true);
    let before = steps(&window);
    window.get_by_label("Measure").click();
    window.run_steps(2);
    let text = "800".to_owned();
    let edit = Edit::SetText { node: "hole".to_owned(), name: "diameter".to_owned(), text };
    assert!(window.state_mut().session_mut().gesture(&edit));
    assert_eq!(steps(&window), before + 1);
}

/// The keyboard is on the last of three points, and the line has two before the next frame is drawn.
#[test]
fn a_key_for_a_point_that_is_gone_does_nothing() {
    for key in [Key::ArrowRight, Key::Space, Key::Insert, Key::Delete, Key::Enter] {
        let (_folder, mut window) = opened("way");
        for _ in 0..3 {
            next(&mut window);
        }
        assert_eq!(focused(&window), "point 3 of points: x 800 m, y 300 m");
        let text = "[(200, 200), (500, 400)]".to_owned();
        let edit = Edit::SetText { node: "way".to_owned(), name: "points".to_owned(), text };
        assert!(window.state_mut().session_mut().apply(&edit));
        crate::hand::key(&mut window, Modifiers::NONE, key);
        assert_eq!((way(&window).len(), steps(&window)), (2, 1), "{key:?}");
    }
}

/// Without terrain there are no handles: a request for the next one is not kept until there is terrain.
#[test]
fn the_keyboard_does_not_go_to_a_handle_later() {
    let text = r#"(world: (size: "1 km", cells: 64), nodes: {
        "land": Constant(value: 10), "road": Carve(version: 2, path: [(200, 200), (800, 800)]) },
        outputs: { "height": "road" })"#;
    let (_folder, mut window) = opened_on(text, "road");
    next(&mut window);
    let wire = Edit::Connect { from: "land".to_owned(), to: "road".to_owned(), input: "height".to_owned() };
    assert!(window.state_mut().session_mut().apply(&wire));
    settle(&mut window);
    window.run_steps(3);
    assert!(window.query_by_label("point 1 of path: x 200 m, y 200 m").is_some());
    assert_eq!(focused(&window), "");
}

#[test]
fn points_are_added_removed_and_centred_by_keys() {
    let (_folder, mut window) = opened("way");
    key(&mut window, Modifiers::COMMAND | Modifiers::SHIFT, Key::J);
    assert_eq!(focused(&window), "middle of points, before point 3: x 650 m, y 350 m", "the last handle");
    key(&mut window, Modifiers::NONE, Key::Insert);
    assert_eq!(focused(&window), "point 3 of points: x 650 m, y 350 m");
    assert_eq!(way(&window).len(), 4);
    key(&mut window, Modifiers::NONE, Key::Space);
    let middle = way(&window)[2].0;
    assert!(middle.iter().all(|metres| (metres - 500.0).abs() < 10.0), "the centre of the view: {middle:?}");
    key(&mut window, Modifiers::NONE, Key::Delete);
    assert_eq!(way(&window).len(), 3);
    assert_eq!(focused(&window), "point 2 of points: x 500 m, y 400 m");
    // Beyond the end of the line.
    key(&mut window, Modifiers::NONE, Key::Tab);
    key(&mut window, Modifiers::NONE, Key::Insert);
    assert_eq!(way(&window)[3].0, [1100.0, 200.0]);
    assert_eq!(focused(&window), "point 4 of points: x 1.1 km, y 200 m", "outside of the view as well");
    assert_eq!(steps(&window), 4);
    for _ in 0..3 {
        key(&mut window, Modifiers::NONE, Key::Delete);
    }
    assert_eq!(way(&window).len(), 2, "a line keeps two points");
}

#[test]
fn numbers_of_handles_are_typed() {
    crate::draws();
    let (_folder, mut window) = opened("way");
    next(&mut window);
    key(&mut window, Modifiers::NONE, Key::Enter);
    let field = |window: &Harness<'_, App>, name: &str| {
        let mut fields = window.query_all_by_role(Role::TextInput);
        fields.find(|field| field.accesskit_node().label().as_deref() == Some(name)).and_then(|field| field.value())
    };
    assert_eq!((field(&window, "x"), field(&window, "y")), (Some("200 m".to_owned()), Some("200 m".to_owned())));
    key(&mut window, Modifiers::COMMAND, Key::A);
    type_text(&mut window, "nowhere");
    key(&mut window, Modifiers::NONE, Key::Enter);
    assert_eq!(field(&window, "x").as_deref(), Some("nowhere"), "a refused text stays");
    assert_eq!(steps(&window), 0);
    key(&mut window, Modifiers::COMMAND, Key::A);
    type_text(&mut window, "1 km / 4");
    key(&mut window, Modifiers::NONE, Key::Tab);
    key(&mut window, Modifiers::COMMAND, Key::A);
    type_text(&mut window, "320 m");
    look(&mut window, "numbers_of_a_handle");
    key(&mut window, Modifiers::NONE, Key::Enter);
    assert_eq!(way(&window)[0].0, [250.0, 320.0]);
    assert_eq!(focused(&window), "point 1 of points: x 250 m, y 320 m");
    key(&mut window, Modifiers::NONE, Key::Enter);
    type_text(&mut window, "9");
    key(&mut window, Modifiers::NONE, Key::Escape);
    assert_eq!((way(&window)[0].0, field(&window, "x")), ([250.0, 320.0], None), "Escape cancels");
}

/// A number is typed for a point of one line, and then another line is selected, which has such a point as well.
#[test]
fn a_typed_number_stays_with_its_node() {
    let text = r#"(world: (size: "1 km", cells: 64), nodes: {
        "land": Constant(value: 10),
        "one": Path(points: [(200, 200), (500, 400)]),
        "two": Path(points: [(300, 300), (600, 700)]) }, outputs: { "height": "land" })"#;
    let (_folder, mut window) = opened_on(text, "one");
    next(&mut window);
    key(&mut window, Modifiers::NONE, Key::Enter);
    key(&mut window, Modifiers::COMMAND, Key::A);
    type_text(&mut window, "450 m");
    window.state_mut().session_mut().select_only("two");
    window.run_steps(3);
    assert_eq!(points(&window, "one")[0].0, [450.0, 200.0]);
    assert_eq!(points(&window, "two")[0].0, [300.0, 300.0]);
    key(&mut window, Modifiers::NONE, Key::Enter);
    assert_eq!((points(&window, "two")[0].0, steps(&window)), ([300.0, 300.0], 1), "the fields are closed");
}

#[test]
fn arms_are_lengthened_turned_and_typed() {
    let (_folder, mut window) = opened("hill");
    next(&mut window);
    assert_eq!(focused(&window), "length and azimuth: 400 m, 90°");
    key(&mut window, Modifiers::NONE, Key::ArrowRight);
    key(&mut window, Modifiers::SHIFT, Key::ArrowRight);
    assert_eq!(focused(&window), "length and azimuth: 400 m, 106°");
    key(&mut window, Modifiers::NONE, Key::ArrowDown);
    assert_ne!(param(&window, "hill", "length"), ParamValue::Float(400.0));
    key(&mut window, Modifiers::NONE, Key::Enter);
    key(&mut window, Modifiers::COMMAND, Key::A);
    type_text(&mut window, "0.5 km");
    key(&mut window, Modifiers::NONE, Key::Enter);
    assert_eq!(focused(&window), "length and azimuth: 500 m, 106°");
    assert_eq!(steps(&window), 4);
}

#[test]
fn arrow_keys_follow_the_screen_in_3d() {
    crate::draws();
    if device::skips("handles in 3D") {
        return;
    }
    let (_folder, mut window) = opened("hole");
    window.get_by_label("3D").click();
    settle(&mut window);
    crate::until(&mut window, "3D is drawn", |window| window.state().seen().is_some());
    next(&mut window);
    next(&mut window);
    assert_eq!(focused(&window), "point 1 of centre: x 250 m, y 250 m");
    let place = |window: &Harness<'_, App>| window.get_by_label_contains("point 1 of centre: ").rect().center();
    for (arrow, x, y) in [(Key::ArrowRight, 1.0, 0.0), (Key::ArrowUp, 0.0, -1.0)] {
        let before = place(&window);
        key(&mut window, Modifiers::SHIFT, arrow);
        settle(&mut window);
        let by = place(&window) - before;
        assert!(by.x * x + by.y * y > 2.0, "{arrow:?}: {by:?}");
    }
    look(&mut window, "handle_in_3d");
}

/// The graph takes the keyboard again when the pointer moves over it, not before.
#[test]
fn a_handle_keeps_the_keyboard_while_the_pointer_rests_over_the_graph() {
    let (_folder, mut window) = opened("way");
    let over = egui::pos2(400.0, 600.0);
    window.hover_at(over);
    window.run_steps(3);
    next(&mut window);
    key(&mut window, Modifiers::NONE, Key::Delete);
    assert_eq!(way(&window).len(), 2, "the point, not the node");
    window.hover_at(over + egui::vec2(3.0, 0.0));
    window.run_steps(3);
    key(&mut window, Modifiers::NONE, Key::Delete);
    assert_eq!(window.state().session().document().nodes().len(), 2, "the node");
    window.state_mut().session_mut().select_only("hole");
    window.state_mut().session_mut().set_cells(64);
    settle(&mut window);
}

/// A direction that applies everywhere has an arm in the middle of the world.
#[test]
fn a_wind_is_turned() {
    crate::draws();
    let folder = scratch(
        r#"(world: (size: "4 km", cells: 64), nodes: { "sand": Dunes(azimuth: 90) }, outputs: { "height": "sand" })"#,
    );
    let mut window = window(Some(folder.path().join("graph.ron")));
    window.state_mut().session_mut().set_cells(64);
    window.state_mut().session_mut().select_only("sand");
    settle(&mut window);
    window.get_by_label("Map").click();
    window.run_steps(3);
    next(&mut window);
    assert_eq!(focused(&window), "azimuth: 90°");
    key(&mut window, Modifiers::SHIFT, Key::ArrowRight);
    assert_eq!(param(&window, "sand", "azimuth"), ParamValue::Float(105.0));
    settle(&mut window);
    look(&mut window, "arm_of_a_wind");
}
