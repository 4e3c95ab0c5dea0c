//! Every control of the window has a name that a screen reader can speak, and no two in a pane have the same one.

mod offenders;

use egui::{Key, Modifiers, PointerButton, Pos2, accesskit::Role, pos2};
use egui_kittest::{Harness, kittest::Queryable as _};
use orograph::editor::App;

use self::offenders::Offenders;
use crate::{
    graph,
    hand::{button, key, title, type_text},
    harness, picture, scratch, settle, until, window,
};

fn press(window: &mut Harness<'_, App>, modifiers: Modifiers, what: Key) {
    window.key_press_modifiers(modifiers, what);
    window.run_steps(4);
}

fn click(window: &mut Harness<'_, App>, name: &str) {
    window.get_by_label(name).click();
    window.run_steps(4);
}

fn menu_at(window: &mut Harness<'_, App>, pos: Pos2) {
    window.hover_at(pos);
    window.step();
    button(window, pos, PointerButton::Secondary, true, Modifiers::NONE);
    button(window, pos, PointerButton::Secondary, false, Modifiers::NONE);
    window.run_steps(3);
}

#[test]
fn controls_of_dialogs_and_menus_have_names() {
    let mut found = Offenders::default();
    let mut window: Harness<'static, App> = harness([1280.0, 800.0]).with_step_dt(1.0 / 60.0).build_eframe(|context| {
        App::new(context, None, orograph::build::storage::in_memory()).expect("no file is read").welcoming()
    });
    window.run_steps(4);
    found.look(&window, "welcome");
    press(&mut window, Modifiers::NONE, Key::Escape);
    found.look(&window, "empty graph");

    let folder = scratch(&std::fs::read_to_string(graph("hello.ron")).expect("there"));
    let mut window = crate::window(Some(folder.path().join("graph.ron")));
    window.state_mut().session_mut().set_cells(64);
    window.state_mut().session_mut().select_only("rivers");
    settle(&mut window);
    for menu in ["File", "Edit", "View", "Help"] {
        window.get_by_role_and_label(Role::Button, menu).click();
        window.run_steps(4);
        found.look(&window, menu);
        press(&mut window, Modifiers::NONE, Key::Escape);
    }
    for (name, menu, item) in [
        ("Keys", "Help", "Keys and mouse"),
        ("Examples", "File", "Examples"),
        ("Save picture", "File", "Save picture"),
        ("Save as", "File", "Save as…"),
        ("Open", "File", "Open…"),
    ] {
        window.get_by_role_and_label(Role::Button, menu).click();
        window.run_steps(4);
        window.get_all_by_label_contains(item).next().expect("an item").click();
        window.run_steps(4);
        found.look(&window, name);
        press(&mut window, Modifiers::NONE, Key::Escape);
        press(&mut window, Modifiers::NONE, Key::Escape);
    }
    press(&mut window, Modifiers::COMMAND, Key::E);
    found.look(&window, "export");
    window.get_by_role_and_label(Role::Button, "Export").click();
    until(&mut window, "the files are written", |window| window.query_by_label_contains("Wrote ").is_some());
    found.look(&window, "exported");
    press(&mut window, Modifiers::NONE, Key::Escape);
    press(&mut window, Modifiers::COMMAND, Key::R);
    found.look(&window, "variations");
    click(&mut window, "Two parameters");
    found.look(&window, "variations of two parameters");
    press(&mut window, Modifiers::NONE, Key::Escape);
    found.assert_none();
}

#[test]
fn controls_of_every_kind_of_node_have_names() {
    let mut found = Offenders::default();
    let kinds: Vec<&str> = orograph_nodes::registry().nodes().iter().map(|node| node.id).collect();
    let nodes: String = kinds.iter().map(|kind| format!("\"{}\": {kind}(),\n", kind.to_lowercase())).collect();
    let folder = scratch(&format!("(world: (size: 3200, cells: 16), nodes: {{ {nodes} }})"));
    let mut window = window(Some(folder.path().join("graph.ron")));
    window.state_mut().session_mut().set_cells(16);
    window.run_steps(4);
    for kind in &kinds {
        window.state_mut().session_mut().select_only(&kind.to_lowercase());
        window.run_steps(4);
        found.look(&window, kind);
    }
    found.assert_none();
}

/// Parameters with values, of all the kinds that have a widget of their own.
const RICH: &str = r##"(
    world: (size: 1000, cells: 32, seed: 3, sea_level: 10),
    parameters: { "height": "hole.diameter" },
    nodes: {
        "base":   Perlin(wavelength: 700, amplitude: 90),
        "hole":   Crater(version: 2, pattern: one, centre: (250, 250), diameter: 150),
        "way":    Path(points: [(200, 200), (at: (500, 400), width: 40), (800, 300)]),
        "range":  Uplift(shape: range, path: [(0, 200), (500, 300), (1000, 800)], front: 300, back: 300),
        "rock":   Stratify(height: "base", layers: [(thickness: 30, hardness: 3), (thickness: 20, hardness: 1)]),
        "tints":  Ramp(version: 2, value: "base", palette: stops, stops: [(0, "#203040"), (90, "#f0f0f0")]),
        "paint":  Paint(height: "base", strokes: [(tool: raise, radius: 60, strength: 10, points: [(100, 100)])]),
        "storm":  HydraulicPipe(height: "base", duration: 3000, rain: 60),
        "steep":  Slope(height: "base"),
        "bent":   Curve(value: "base", shape: points, points: [(0, 0), (40, 70), (90, 90)]),
        "sizes":  Metrics(height: "base"),
    },
    outputs: { "height": "base", "colours": "tints", "steep": "steep.mask" },
    expect: { "relief": (10, inf) },
    layout: { "base": (0, 0), "hole": (0, 200), "way": (0, 400), "range": (240, 0), "rock": (240, 200) },
)"##;

fn rich() -> (Harness<'static, App>, tempfile::TempDir) {
    let folder = scratch(RICH);
    let mut window = window(Some(folder.path().join("graph.ron")));
    window.state_mut().session_mut().set_cells(32);
    settle(&mut window);
    let problems = window.state().session().document().problems().to_vec();
    assert!(problems.is_empty(), "{problems:?}");
    (window, folder)
}

#[test]
fn controls_of_the_panes_have_names() {
    crate::draws();
    let (mut window, _folder) = rich();
    let mut found = Offenders::default();
    found.look(&window, "file settings");
    click(&mut window, "➕ expectation");
    found.look(&window, "expectations");
    press(&mut window, Modifiers::NONE, Key::Escape);
    let nodes: Vec<String> = window.state().session().document().nodes().iter().map(|node| node.name.clone()).collect();
    for node in &nodes {
        window.state_mut().session_mut().select_only(node);
        settle(&mut window);
        window.run_steps(4);
        found.look(&window, &format!("{node} selected"));
    }
    window.state_mut().session_mut().select_only("tints");
    window.run_steps(4);
    for name in ["colour 1", "menu of palette", "palette", "shown output", "preview resolution"] {
        click(&mut window, name);
        found.look(&window, &format!("{name} clicked"));
        press(&mut window, Modifiers::NONE, Key::Escape);
    }
    window.state_mut().session_mut().select(["base".to_owned(), "hole".to_owned()]);
    window.run_steps(4);
    found.look(&window, "several nodes selected");

    window.state_mut().session_mut().select_only("way");
    settle(&mut window);
    for tool in ["Measure", "Brush", "Draw"] {
        click(&mut window, tool);
        found.look(&window, tool);
        click(&mut window, tool);
    }
    window.state_mut().session_mut().select_only("paint");
    click(&mut window, "Brush");
    found.look(&window, "a brush");
    click(&mut window, "Brush");
    click(&mut window, "A|B");
    found.look(&window, "two outputs");
    click(&mut window, "A|B");
    window.state_mut().session_mut().select_only("steep");
    settle(&mut window);
    if picture(&mut window, "names").is_some() {
        click(&mut window, "Look");
        found.look(&window, "look");
        window.hover_at(pos2(300.0, 400.0));
        press(&mut window, Modifiers::NONE, Key::Escape);
        click(&mut window, "Views");
        click(&mut window, "Save this view");
        click(&mut window, "Views");
        found.look(&window, "views");
        press(&mut window, Modifiers::NONE, Key::Escape);
        click(&mut window, "Fly");
        found.look(&window, "flying");
        click(&mut window, "Fly");
    }
    click(&mut window, "Map");
    window.hover_at(pos2(470.0, 260.0));
    window.run_steps(3);
    found.look(&window, "map");

    click(&mut window, "History");
    for _ in 0..2 {
        click(&mut window, "Take snapshot");
    }
    found.look(&window, "history and snapshots");
    window.get_by_label_contains("Problems").click();
    window.run_steps(4);
    found.look(&window, "problems");
    click(&mut window, "Inspector");
    window.state_mut().session_mut().select_only("storm");
    settle(&mut window);
    click(&mut window, "Live");
    until(&mut window, "it has started", |window| {
        window.state().session().simulation().is_some_and(|run| run.moment().is_some())
    });
    click(&mut window, "Brush");
    found.look(&window, "live run");
    found.assert_none();
}

#[test]
fn controls_of_the_canvas_have_names() {
    let (mut window, _folder) = rich();
    let mut found = Offenders::default();
    let empty = crate::canvas::ground(&window);
    menu_at(&mut window, empty);
    found.look(&window, "menu of the graph");
    press(&mut window, Modifiers::NONE, Key::Escape);
    let node = title(&window, "base");
    menu_at(&mut window, node);
    found.look(&window, "menu of a node");
    press(&mut window, Modifiers::NONE, Key::Escape);
    crate::hand::click(&mut window, node);
    key(&mut window, Modifiers::NONE, Key::F2);
    found.look(&window, "renaming");
    press(&mut window, Modifiers::NONE, Key::Escape);
    key(&mut window, Modifiers::COMMAND, Key::F);
    type_text(&mut window, "ba");
    found.look(&window, "search");
    press(&mut window, Modifiers::NONE, Key::Escape);
    key(&mut window, Modifiers::NONE, Key::Tab);
    type_text(&mut window, "te");
    found.look(&window, "palette");
    press(&mut window, Modifiers::NONE, Key::Escape);
    window.hover_at(empty);
    window.step();
    key(&mut window, Modifiers::NONE, Key::C);
    found.look(&window, "frame");
    crate::hand::click(&mut window, node);
    key(&mut window, Modifiers::COMMAND, Key::G);
    found.look(&window, "subgraph");
    found.assert_none();
}
