//! Tests of drawing paths and positions on the map and in 3D.

use egui::{Key, Modifiers, Pos2, pos2, vec2};
use egui_kittest::{Harness, kittest::Queryable as _};
use orograph::editor::App;
use orograph_graph::ParamValue;

use crate::{
    built, device,
    hand::{click, drag, drag_with, key},
    look, scratch, settle, window,
};

/// A crater and a node that carves a path, whose default lies outside the world.
const LAND: &str = r#"(
    format: 1,
    world: (size: "1 km", cells: 256, seed: 3),
    nodes: {
        "hole": Crater(version: 2, pattern: one, centre: (250, 250), diameter: 150),
        "road": Carve(version: 2, height: "hole", width: 30, depth: 10, bank: 20),
    },
    outputs: { "height": "road" },
)"#;

/// A window on a file in the map view, with a node selected.
fn opened(text: &str, node: &str) -> (tempfile::TempDir, Harness<'static, App>) {
    let folder = scratch(text);
    let mut window = window(Some(folder.path().join("graph.ron")));
    window.state_mut().session_mut().set_cells(128);
    window.state_mut().session_mut().select_only(node);
    settle(&mut window);
    window.get_by_label("Map").click();
    window.run_steps(3);
    (folder, window)
}

fn path(window: &Harness<'_, App>, node: &str) -> Vec<[f64; 2]> {
    let graph = window.state().session().document().graph();
    match graph.instance(graph.find(node).expect("a node")).params.get("path") {
        Some(ParamValue::Path(points)) => points.clone(),
        other => panic!("{other:?}"),
    }
}

fn point(window: &Harness<'_, App>, node: &str) -> [f64; 2] {
    let graph = window.state().session().document().graph();
    match graph.instance(graph.find(node).expect("a node")).params.get("centre") {
        Some(ParamValue::Point(at)) => *at,
        other => panic!("{other:?}"),
    }
}

fn steps(window: &Harness<'_, App>) -> usize {
    window.state().session().document().steps()
}

/// Draws three points with the tool, on the map or in 3D, and drags them; each is one undo step.
fn line_is_drawn_and_dragged(window: &mut Harness<'_, App>) {
    let places = [pos2(400.0, 205.0), pos2(500.0, 225.0), pos2(560.0, 200.0)];
    window.get_by_label("Draw").click();
    window.run_steps(3);
    let before = steps(window);
    for at in places {
        click(window, at);
    }
    let drawn = path(window, "road");
    assert_eq!(drawn.len(), 3, "a line that nobody has drawn is replaced");
    assert!(drawn.iter().flatten().all(|metres| (0.0..=1000.0).contains(metres)), "{drawn:?}");
    // the first two points make the line, the third is added to it
    assert_eq!(steps(window), before + 2);

    drag(window, places[1], places[1] + vec2(0.0, 20.0));
    let bent = path(window, "road");
    assert!(bent[0] == drawn[0] && bent[2] == drawn[2] && bent[1][1] > drawn[1][1] + 20.0, "{drawn:?} {bent:?}");
    assert_eq!(steps(window), before + 3, "a drag is one step");
    settle(window);

    // the middle of the first segment becomes a point
    let middle = (places[0] + (places[1] + vec2(0.0, 20.0)).to_vec2()).to_vec2() * 0.5;
    drag(window, middle.to_pos2(), middle.to_pos2() - vec2(60.0, 0.0));
    assert_eq!(path(window, "road").len(), 4);
    assert_eq!(steps(window), before + 4);
    key(window, Modifiers::NONE, Key::Delete);
    assert_eq!(path(window, "road"), bent, "Delete removes the point that was dragged last");
    window.state_mut().session_mut().undo();
    assert_eq!(path(window, "road").len(), 4);
    for _ in 0..4 {
        window.state_mut().session_mut().undo();
    }
    window.run_steps(2);
    assert_eq!(steps(window), before);
    assert!(window.query_by_label("Redraw").is_some());
    key(window, Modifiers::NONE, Key::Escape);
    assert!(window.query_by_label("Redraw").is_none(), "Escape ends the drawing");
    key(window, Modifiers::NONE, Key::P);
    window.run_steps(2);
    assert!(window.query_by_label("Redraw").is_some());
    key(window, Modifiers::NONE, Key::Enter);
    assert!(window.query_by_label("Redraw").is_none(), "Enter ends it too");
}

/// The point that was drawn last is taken back, and then Delete is pressed.
#[test]
fn a_point_that_is_gone_is_not_deleted() {
    crate::draws();
    let (_folder, mut window) = opened(LAND, "road");
    window.get_by_label("Draw").click();
    window.run_steps(3);
    for at in [pos2(400.0, 205.0), pos2(500.0, 225.0), pos2(560.0, 200.0), pos2(600.0, 240.0)] {
        click(&mut window, at);
    }
    assert_eq!(path(&window, "road").len(), 4);
    window.state_mut().session_mut().undo();
    key(&mut window, Modifiers::NONE, Key::Delete);
    assert_eq!(path(&window, "road").len(), 3);
}

#[test]
fn a_line_is_drawn_and_dragged_on_the_map() {
    crate::draws();
    let (_folder, mut window) = opened(LAND, "road");
    line_is_drawn_and_dragged(&mut window);
    window.state_mut().session_mut().redo();
    window.state_mut().session_mut().redo();
    settle(&mut window);
    look(&mut window, "drawn");
}

#[test]
fn a_line_is_drawn_and_dragged_in_3d() {
    crate::draws();
    if device::skips("drawing in 3D") {
        return;
    }
    let (_folder, mut window) = opened(LAND, "road");
    window.get_by_label("3D").click();
    window.run_steps(10);
    settle(&mut window);
    crate::until(&mut window, "3D is drawn", |window| window.state().seen().is_some());
    line_is_drawn_and_dragged(&mut window);
    look(&mut window, "drawn_3d");
}

#[test]
fn a_position_is_placed_dragged_and_snapped() {
    crate::draws();
    let (_folder, mut window) = opened(LAND, "hole");
    window.get_by_label("Draw").click();
    window.run_steps(3);
    let at = pos2(520.0, 300.0);
    let before = steps(&window);
    click(&mut window, at);
    let placed = point(&window, "hole");
    assert!(placed != [250.0, 250.0] && steps(&window) == before + 1, "{placed:?}");
    let to = at + vec2(33.0, -41.0);
    drag_with(&mut window, at, to, Modifiers::COMMAND);
    let snapped = point(&window, "hole");
    assert!(snapped != placed && snapped.iter().all(|metres| metres % 50.0 == 0.0), "{snapped:?}");
    window.state_mut().session_mut().undo();
    assert_eq!(point(&window, "hole"), placed);
    window.run_steps(3);
    drag_with(&mut window, at, to, Modifiers::COMMAND | Modifiers::SHIFT);
    let cell = point(&window, "hole").map(|metres| metres / (1000.0 / 256.0) - 0.5);
    assert!(cell.iter().all(|cells| (cells - cells.round()).abs() < 1e-9), "the centre of a cell: {cell:?}");
    // a drag beside the handles moves the map
    let now = point(&window, "hole");
    key(&mut window, Modifiers::NONE, Key::Escape);
    drag(&mut window, pos2(400.0, 200.0), pos2(430.0, 220.0));
    assert_eq!(point(&window, "hole"), now);
}

#[test]
fn a_new_line_carves_the_shown_terrain() {
    crate::draws();
    let mut window = built("hello.ron", 128);
    window.get_by_label("Map").click();
    window.get_by_label("Draw").click();
    window.run_steps(3);
    window.get_by_label("New ⏷").click();
    window.run_steps(3);
    window.get_by_label("Carve").click();
    window.run_steps(3);
    assert_eq!(window.state().session().selected(), Some("carve"));
    settle(&mut window);
    for at in [pos2(400.0, 250.0), pos2(520.0, 290.0)] {
        click(&mut window, at);
    }
    assert_eq!(path(&window, "carve").len(), 2);
    let graph = window.state().session().document().graph();
    let source = graph.source(graph.find("carve").expect("a node"), 0).expect("wired");
    assert_eq!(graph.port_name(source), "rivers.height");
}

/// A path goes to the selected node that can carve along it, and the parameters that it replaces are greyed out.
#[test]
fn a_new_path_is_wired_to_the_selected_node_that_takes_lines() {
    let mut window = built("hello.ron", 64);
    for name in ["Draw", "New ⏷", "Road"] {
        window.get_by_label(name).click();
        window.run_steps(3);
    }
    let idle = |window: &Harness<'_, App>| window.query_by_label("only if lines is not wired").is_some();
    assert!(!idle(&window));
    for name in ["New ⏷", "Path"] {
        window.get_by_label(name).click();
        window.run_steps(3);
    }
    let session = window.state().session();
    assert_eq!(session.selected(), Some("path"));
    let graph = session.document().graph();
    let road = graph.find("road").expect("a node");
    assert!(graph.is_wired(road, "lines") && !session.document().has_errors());
    window.state_mut().session_mut().select_only("road");
    window.run_steps(4);
    assert!(idle(&window), "the points of `Road` have no effect");
    assert!(window.query_by_label_contains("point 1 of path").is_none(), "and no handles");
}

#[test]
fn a_road_is_a_carve_with_the_parameters_of_a_road() {
    let mut window = built("hello.ron", 64);
    let before = steps(&window);
    for name in ["Draw", "New ⏷", "Road"] {
        window.get_by_label(name).click();
        window.run_steps(3);
    }
    assert_eq!(window.state().session().selected(), Some("road"));
    assert_eq!(steps(&window), before + 1, "one step to undo");
    let source = window.state().session().document().source();
    let text = source.split("\"road\": ").nth(1).and_then(|rest| rest.split(')').next()).expect("a node");
    for part in [
        "Carve(",
        "mode: grade",
        "course: graded",
        "profile: flat",
        "depth: 0",
        "wander: 0",
        "raggedness: 0",
        "detail: 0",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    settle(&mut window);
    for at in [pos2(400.0, 250.0), pos2(520.0, 290.0)] {
        click(&mut window, at);
    }
    assert_eq!(path(&window, "road").len(), 2);
    settle(&mut window);
    let session = window.state().session();
    assert!(session.built("road.height").is_some() && !session.document().has_errors());
}

/// The bar of the tool lies on the picture, which stays where it is.
#[test]
fn the_ground_stays_where_it_is_when_a_drawing_begins_and_ends() {
    let (_folder, mut window) = opened(LAND, "hole");
    let now = |window: &Harness<'_, App>| {
        let handle = window.get_by_label("point 1 of centre: x 250 m, y 250 m").rect();
        (window.get_by_label("map of the terrain").rect(), handle)
    };
    let before = now(&window);
    window.get_by_label("Draw").click();
    window.run_steps(3);
    assert_eq!(now(&window), before);
    let new = window.get_by_label("New ⏷").rect();
    assert!(before.0.contains_rect(new), "{new:?} in {before:?}");
    // a click between the buttons draws nothing
    let steps_before = steps(&window);
    click(&mut window, pos2(before.0.right() - 6.0, new.center().y));
    assert_eq!((steps(&window), point(&window, "hole")), (steps_before, [250.0, 250.0]));
    window.hover_at(before.0.center());
    window.run_steps(2);
    key(&mut window, Modifiers::NONE, Key::Escape);
    assert!(window.query_by_label("New ⏷").is_none());
    assert_eq!(now(&window), before);
}

/// Ten thousand points are shown and dragged; what is outside of the world is drawn too.
#[test]
fn a_point_of_a_long_line_is_dragged() {
    crate::draws();
    let points: Vec<String> = (0..10_000).map(|k| format!("({}, {})", 40 * (k % 101), 4 * (k * 31 % 1009))).collect();
    let text = format!(
        r#"(format: 1, world: (size: "4 km", cells: 64), nodes: {{ "land": Constant(value: 10),
        "way": Path(points: [{}], curve: 0), "road": Carve(version: 2, height: "land", lines: "way") }},
        outputs: {{ "height": "road" }})"#,
        points.join(", ")
    );
    let (_folder, mut window) = opened(&text, "way");
    let centre: Pos2 = pos2(470.0, 260.0);
    drag(&mut window, centre, centre + vec2(10.0, 10.0));
    settle(&mut window);
}

/// In a graph without terrain, a path is drawn on level ground: its first point where you click first.
#[test]
fn a_path_is_drawn_in_an_empty_world() {
    crate::draws();
    let text = r#"(format: 1, world: (size: "1 km", cells: 64), nodes: { "way": Path() }, outputs: {})"#;
    let (_folder, mut window) = opened(text, "way");
    window.get_by_label("Draw").click();
    window.run_steps(3);
    for at in [pos2(400.0, 250.0), pos2(470.0, 290.0), pos2(540.0, 260.0)] {
        click(&mut window, at);
    }
    let graph = window.state().session().document().graph();
    let points = match graph.instance(graph.find("way").expect("a node")).params.get("points") {
        Some(ParamValue::Waypoints(points)) => points.clone(),
        other => panic!("{other:?}"),
    };
    assert_eq!(points.len(), 3);
    assert!(points.iter().flat_map(|point| point.at).all(|metres| (0.0..=1000.0).contains(&metres)), "{points:?}");
    settle(&mut window);
    look(&mut window, "drawn_path");
}

/// The value of a number of a node.
fn number(window: &Harness<'_, App>, node: &str, param: &str) -> f64 {
    let graph = window.state().session().document().graph();
    graph.instance(graph.find(node).expect("a node")).params.read::<f64>(param)
}

#[test]
fn handles_have_names_and_radii_are_dragged() {
    crate::draws();
    let (_folder, mut window) = opened(LAND, "hole");
    // Screen readers, and this test, find the handles by their names.
    assert!(window.query_by_label("point 1 of centre: x 250 m, y 250 m").is_some());
    let rim = window.get_by_label("diameter: 150 m").rect().center();
    let centre = window.get_by_label("point 1 of centre: x 250 m, y 250 m").rect().center();
    assert!((rim.y - centre.y).abs() < 1.0 && rim.x > centre.x + 10.0, "the arm points east: {centre:?} {rim:?}");
    let before = steps(&window);
    drag(&mut window, rim, centre + 2.0 * (rim - centre));
    let wider = number(&window, "hole", "diameter");
    assert!((290.0..310.0).contains(&wider), "{wider}");
    assert_eq!((steps(&window), point(&window, "hole")), (before + 1, [250.0, 250.0]));
    settle(&mut window);
    look(&mut window, "arm_of_a_crater");
    window.state_mut().session_mut().undo();
    assert_eq!(number(&window, "hole", "diameter"), 150.0);
    // The points of a path have names too.
    window.state_mut().session_mut().select_only("road");
    window.get_by_label("Draw").click();
    window.run_steps(3);
    for at in [pos2(400.0, 205.0), pos2(500.0, 225.0)] {
        click(&mut window, at);
    }
    assert!(window.query_by_label_contains("point 2 of path: x ").is_some());
    assert!(window.query_by_label_contains("middle of path, before point 2: x ").is_some());
}

#[test]
fn an_azimuth_is_dragged_on_the_map_and_in_3d() {
    crate::draws();
    let text = r#"(world: (size: "1 km", cells: 128), nodes: {
        "slope": Gradient(centre: (500, 500), azimuth: 90, length: 400, to: 20) }, outputs: { "height": "slope" })"#;
    let (_folder, mut window) = opened(text, "slope");
    let end = window.get_by_label("length and azimuth: 400 m, 90°").rect().center();
    let centre = window.get_by_label("point 1 of centre: x 500 m, y 500 m").rect().center();
    // Straight to the south, with Ctrl to snap.
    let south = centre + vec2(0.0, end.x - centre.x);
    drag_with(&mut window, end, south, Modifiers::COMMAND);
    let [azimuth, length] = ["azimuth", "length"].map(|param| number(&window, "slope", param));
    assert!(azimuth == 180.0 && (380.0..=420.0).contains(&length), "{azimuth} {length}");
    assert_eq!(steps(&window), 1);
    settle(&mut window);
    look(&mut window, "arm_of_a_gradient");
    if device::missing().is_some() {
        return;
    }
    window.get_by_label("3D").click();
    settle(&mut window);
    look(&mut window, "arm_in_3d");
    let end = window.get_by_label_contains("length and azimuth: ").rect().center();
    drag(&mut window, end, end + vec2(60.0, 0.0));
    let turned = number(&window, "slope", "azimuth");
    assert!(turned != 180.0, "{turned}");
    assert_eq!(steps(&window), 2);
}
