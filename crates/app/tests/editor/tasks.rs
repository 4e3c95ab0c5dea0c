//! Three tasks from the manual alone, with the clicks and keys that each takes.
//!
//! They begin at the welcome page. The table in `docs/checks.md` compares them with those of an earlier window.

use egui::{Key, Modifiers, Pos2, accesskit::Role};
use egui_kittest::{Harness, kittest::Queryable as _};
use orograph::{editor::App, export::engine::Engine};
use orograph_graph::ParamValue;

use crate::{
    canvas::document,
    hand::{click, drag, key, type_text},
    look, settle, until,
    welcome::welcomed,
};

/// Somebody at the window, whose actions are counted.
struct User {
    window: Harness<'static, App>,
    done: Actions,
}

/// Clicks, drags, keys, and texts that are typed.
#[derive(Debug, Default, PartialEq)]
struct Actions {
    clicks: u32,
    drags: u32,
    keys: u32,
    texts: u32,
}

impl User {
    /// In front of the welcome page.
    fn new() -> Self {
        let mut user = Self { window: welcomed([1280.0, 800.0]), done: Actions::default() };
        // until the page is laid out
        user.window.run_steps(12);
        user
    }

    /// Clicks the first widget with this name.
    #[track_caller]
    fn press(&mut self, label: &str) {
        let found = self.window.get_all_by_label(label).next().map(|widget| widget.rect().center());
        self.click(found.expect("a widget"));
    }

    fn click(&mut self, at: Pos2) {
        click(&mut self.window, at);
        self.window.run_steps(3);
        self.done.clicks += 1;
    }

    fn drag(&mut self, from: Pos2, to: Pos2) {
        drag(&mut self.window, from, to);
        self.done.drags += 1;
    }

    fn key(&mut self, modifiers: Modifiers, pressed: Key) {
        key(&mut self.window, modifiers, pressed);
        self.done.keys += 1;
    }

    fn text(&mut self, text: &str) {
        type_text(&mut self.window, text);
        self.done.texts += 1;
    }

    /// Adds a node by name, with the pointer over empty canvas.
    fn add(&mut self, name: &str) {
        let canvas = self.window.get_by_label("graph").rect();
        self.window.hover_at(canvas.right_bottom() - egui::vec2(40.0, 40.0));
        self.window.run_steps(2);
        self.key(Modifiers::NONE, Key::Tab);
        self.text(name);
        self.key(Modifiers::NONE, Key::Enter);
    }

    fn settle(&mut self) {
        settle(&mut self.window);
    }

    fn coarse(&mut self, cells: u32) {
        self.window.state_mut().session_mut().set_cells(cells);
        self.settle();
    }

    fn heights(&self, port: &str) -> Vec<f32> {
        let built = self.window.state().session().built(port).expect("it is built");
        built.value.as_field().expect("a field").samples().to_vec()
    }
}

#[test]
fn an_island_with_a_road() {
    crate::draws();
    let mut user = User::new();
    user.press("Empty graph");
    user.add("island");
    user.coarse(128);
    for name in ["Draw", "New ⏷", "Road"] {
        user.press(name);
    }
    user.settle();
    let view = user.window.get_by_label("view of the terrain").rect();
    for share in [(0.34, 0.30), (0.42, 0.36), (0.50, 0.33), (0.60, 0.40)] {
        user.click(view.lerp_inside(egui::vec2(share.0, share.1)));
    }
    user.key(Modifiers::NONE, Key::Escape);
    user.settle();
    look(&mut user.window, "task_island");
    let graph = document(&user.window).graph();
    let road = graph.find("road").expect("a road");
    let source = graph.source(road, 0).expect("wired");
    assert_eq!(graph.port_name(source), "island.height");
    let path = graph.instance(road).params.get("path");
    assert!(matches!(path, Some(ParamValue::Path(points)) if points.len() == 4), "{path:?}");
    let moved = user.heights("road.height").into_iter().zip(user.heights("island.height"));
    assert!(moved.map(|(after, before)| (after - before).abs()).fold(0.0, f32::max) > 0.5, "ground is cut or filled");
    assert_eq!(user.done, Actions { clicks: 8, drags: 0, keys: 3, texts: 1 });
}

#[test]
fn an_alpine_valley_with_a_painted_lake() {
    crate::draws();
    let mut user = User::new();
    user.press("Alps");
    user.coarse(96);
    for name in ["Brush", "Add a Paint node here", "Lower"] {
        user.press(name);
    }
    user.settle();
    let view = user.window.get_by_label("view of the terrain").rect();
    user.drag(view.lerp_inside(egui::vec2(0.45, 0.5)), view.lerp_inside(egui::vec2(0.55, 0.55)));
    user.add("lake");
    user.settle();
    look(&mut user.window, "task_lake");
    let shown = user.window.state().session().shown();
    assert_eq!(shown.as_deref(), Some("lakes.level"));
    let depths = user.heights("lakes.level").into_iter().zip(user.heights("paint.height"));
    let deepest = depths.map(|(level, bed)| level - bed).fold(0.0, f32::max);
    assert!(deepest > 20.0, "{deepest} m");
    assert_eq!(user.done, Actions { clicks: 4, drags: 1, keys: 2, texts: 1 });
}

#[test]
fn a_canyon_for_unreal() {
    crate::draws();
    let mut user = User::new();
    let out = tempfile::tempdir().expect("a folder");
    user.press("A canyon in layered rock");
    user.coarse(64);
    user.key(Modifiers::COMMAND, Key::E);
    let field = user.window.get_by_role_and_label(Role::TextInput, "Folder").rect().center();
    user.click(field);
    user.key(Modifiers::COMMAND, Key::A);
    let folder = out.path().join("canyon");
    user.text(&folder.display().to_string());
    let engines = user.window.get_all_by_role(Role::ComboBox);
    let engines = engines.into_iter().find(|combo| combo.value().as_deref() == Some("none"));
    let engines = engines.expect("a choice of engines").rect().center();
    user.click(engines);
    user.press(Engine::Unreal.title());
    look(&mut user.window, "task_canyon");
    let export = user.window.get_by_role_and_label(Role::Button, "Export").rect().center();
    user.click(export);
    until(&mut user.window, "files are written", |window| window.query_by_label_contains("Wrote ").is_some());
    for file in ["height.png", "unreal.txt"] {
        assert!(folder.join(file).is_file(), "{file}");
    }
    assert_eq!(user.done, Actions { clicks: 5, drags: 0, keys: 2, texts: 1 });
}
