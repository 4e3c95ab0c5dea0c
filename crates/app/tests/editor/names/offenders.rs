//! Looks at the controls of a window, as a screen reader finds them.

use std::collections::{BTreeMap, BTreeSet};

use egui::{
    Pos2, Rect,
    accesskit::{Action, Role},
    pos2,
};
use egui_kittest::{
    Harness, Node,
    kittest::{NodeT as _, Queryable as _},
};
use orograph::editor::App;

/// Roles of controls. Other nodes are controls if they can be clicked or can have the keyboard.
const CONTROLS: [Role; 10] = [
    Role::Button,
    Role::CheckBox,
    Role::ColorWell,
    Role::ComboBox,
    Role::Link,
    Role::RadioButton,
    Role::Slider,
    Role::SpinButton,
    Role::Tab,
    Role::TextInput,
];

/// The controls without a proper name, by state of the window.
#[derive(Default)]
pub(super) struct Offenders(BTreeSet<String>);

impl Offenders {
    /// Looks at all controls of the window.
    pub(super) fn look(&mut self, window: &Harness<'_, App>, state: &str) {
        let screen = window.ctx.content_rect();
        let mut seen: BTreeMap<(String, String, String), Vec<Rect>> = BTreeMap::new();
        for node in window.query_all_by(|_| true) {
            let inner = node.accesskit_node();
            let data = inner.data();
            let acts = data.supports_action(Action::Click) || data.supports_action(Action::Focus);
            if !acts && !CONTROLS.contains(&inner.role()) {
                continue;
            }
            let is_label = inner.role() == Role::Label;
            let name = if is_label { inner.value() } else { inner.label() }.unwrap_or_default();
            let bounds = data.bounds().unwrap_or_default();
            let [min, max] = [(bounds.x0, bounds.y0), (bounds.x1, bounds.y1)].map(|(x, y)| pos2(x as f32, y as f32));
            let rect = Rect::from_min_max(min, max);
            if !name.chars().any(char::is_alphanumeric) {
                self.0.insert(format!("{:?} {name:?} at {rect:.0?}, {state}", inner.role()));
            }
            if screen.intersects(rect) && rect.is_positive() {
                let place = format!("{} of {}", pane(window, rect), layer(&node));
                seen.entry((format!("{:?}", inner.role()), name, place)).or_default().push(rect);
            }
        }
        for ((role, name, place), rects) in seen.into_iter().filter(|(_, rects)| rects.len() > 1) {
            // Links and names of rows stand in columns of lists.
            let is_list = rects.iter().all(|rect| (rect.left() - rects[0].left()).abs() < 1.0);
            if !(is_list && ["Label", "Link"].contains(&role.as_str())) {
                self.0.insert(format!("{} times {role} {name:?} in the {place}, {state}", rects.len()));
            }
        }
    }

    /// Asserts that there are none.
    #[track_caller]
    pub(super) fn assert_none(&self) {
        let list: Vec<&str> = self.0.iter().map(String::as_str).collect();
        assert!(list.is_empty(), "{} controls:\n{}", list.len(), list.join("\n"));
    }
}

/// The pane of a rectangle of the wide layout: its tab is at the top.
fn pane(window: &Harness<'_, App>, rect: Rect) -> &'static str {
    let tab = |name: &str| {
        let tabs = window.query_all_by_role_and_label(Role::Button, name).map(|node| node.rect().min);
        tabs.max_by(|a, b| a.y.total_cmp(&b.y)).unwrap_or(Pos2::new(f32::INFINITY, f32::INFINITY))
    };
    match rect.center() {
        at if at.x >= tab("Inspector").x => "inspector",
        at if at.y >= tab("Graph").y => "graph",
        _ => "viewport",
    }
}

/// The outermost part of the window that a node is in: the window itself, or a menu or dialog above it.
fn layer(node: &Node<'_>) -> String {
    let mut layers = Vec::new();
    let mut here = node.parent();
    while let Some(parent) = here {
        layers.push(format!("{:?}", parent.accesskit_node().id()));
        here = parent.parent();
    }
    layers.iter().rev().nth(1).cloned().unwrap_or_default()
}
