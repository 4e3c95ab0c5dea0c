//! Pictures of dialogs, lists and help, in both themes and in a small window.

use egui::{Key, Modifiers, Rect, Theme, ThemePreference, Vec2, accesskit::Role, vec2};
use egui_kittest::{
    Harness,
    kittest::{NodeT as _, Queryable as _},
};
use orograph::editor::App;

use crate::{device, graph, look, settle, window};

/// A menu item, the name of its picture, and the labels that must be visible.
const ABOVE: [(&str, &str, &str, &[&str]); 5] = [
    ("File", "Examples", "examples", &["Examples", "Cancel"]),
    ("File", "Open…", "open", &["path", "Open", "Cancel"]),
    ("File", "Save picture", "save_picture", &["path", "Save", "Cancel"]),
    ("Help", "Keys and mouse", "keys", &["Keys and mouse", "Close"]),
    ("File", "Export", "export", &["Folder", "Export"]),
];

fn open(window: &mut Harness<'_, App>, menu: &str, item: &str) {
    window.get_by_role_and_label(Role::Button, menu).click();
    window.run_steps(3);
    window.get_by_label_contains(item).click();
    window.run_steps(6);
}

fn in_sight(window: &Harness<'_, App>, label: &str, size: Vec2) -> bool {
    let pane = Rect::from_min_size(egui::Pos2::ZERO, size).expand(1.0);
    let mut nodes = window.get_all_by_label(label);
    nodes.any(|node| node.rect().is_positive() && pane.contains_rect(node.rect()) && !node.accesskit_node().is_hidden())
}

#[test]
fn dialogs_fit_the_window_in_both_themes() {
    crate::draws();
    for (theme, size) in
        [(Theme::Dark, vec2(1280.0, 800.0)), (Theme::Light, vec2(1280.0, 800.0)), (Theme::Dark, vec2(400.0, 300.0))]
    {
        let mut window = window(Some(graph("hello.ron")));
        window.state_mut().session_mut().set_cells(128);
        window.ctx.set_theme(ThemePreference::from(theme));
        window.set_size(size);
        settle(&mut window);
        let small = if size.x < 500.0 { "small" } else { "" };
        for menu in ["Edit", "View"] {
            window.get_by_role_and_label(Role::Button, menu).click();
            window.run_steps(6);
            look(&mut window, &format!("menu_{menu}_{theme:?}{small}"));
            window.key_press_modifiers(Modifiers::NONE, Key::Escape);
            window.run_steps(4);
        }
        for (menu, item, name, labels) in ABOVE {
            // Only a 3D view can be saved as a picture.
            if name == "save_picture" && device::skips("the dialog that saves a picture") {
                continue;
            }
            open(&mut window, menu, item);
            look(&mut window, &format!("above_{name}_{theme:?}{small}"));
            for label in labels {
                assert!(in_sight(&window, label, size), "{label} of {name} at {size:?}");
            }
            window.key_press_modifiers(Modifiers::NONE, Key::Escape);
            window.run_steps(4);
        }
    }
}
