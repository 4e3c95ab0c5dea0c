//! Names of controls for screen readers.
//!
//! A button with a text has that text as its name. [`Named`] gives a name to every other control: those with a symbol, and
//! fields and lists whose name stands beside them. [`install`] names the parts that the libraries of the window add.

use std::collections::HashMap;

use egui::{
    Context, FullOutput, Plugin, Response,
    accesskit::{Action, Node, NodeId, Role, TreeUpdate},
};

/// The greatest width of a divider between panes, in points.
const THIN: f64 = 8.0;

/// The greatest height of a bar of tabs, in points.
const TABS: f64 = 30.0;

/// The text of the button that copies a colour.
const COPY: &str = "📋";

/// A control that gets a name.
pub(crate) trait Named {
    /// Gives it a name, which screen readers speak instead of its text.
    #[must_use]
    fn named(self, name: impl Into<String>) -> Self;
}

impl Named for Response {
    fn named(self, name: impl Into<String>) -> Self {
        self.ctx.accesskit_node_builder(self.id, |node| node.set_label(name.into()));
        self
    }
}

/// Names the parts of the window that have no response in this program.
pub(super) fn install(context: &Context) {
    context.add_plugin(Parts);
}

/// Names scroll bars, dividers between panes, bars of tabs, backgrounds of menus, numbers beside sliders, and the parts of
/// the choice of a colour.
struct Parts;

impl Plugin for Parts {
    fn debug_name(&self) -> &'static str {
        "names for screen readers"
    }

    fn output_hook(&mut self, _: &Context, output: &mut FullOutput) {
        if let Some(update) = &mut output.platform_output.accesskit_update {
            name_numbers(update);
            name_parts(update);
        }
    }
}

fn is_named(node: &Node) -> bool {
    node.label().is_some_and(|label| !label.is_empty()) || !node.labelled_by().is_empty()
}

/// Gives the number beside a slider the name of the slider.
fn name_numbers(update: &mut TreeUpdate) {
    let places: HashMap<NodeId, usize> = update.nodes.iter().enumerate().map(|(at, (id, _))| (*id, at)).collect();
    let is = |at: usize, role| update.nodes[at].1.role() == role;
    let mut pairs = Vec::new();
    for (_, parent) in &update.nodes {
        for pair in parent.children().windows(2) {
            if let [Some(slider), Some(number)] = [pair[0], pair[1]].map(|id| places.get(&id).copied())
                && is(slider, Role::Slider)
                && is(number, Role::SpinButton)
                && !is_named(&update.nodes[number].1)
            {
                pairs.push((slider, number));
            }
        }
    }
    for (slider, number) in pairs {
        let name = update.nodes[slider].1.label().map(str::to_owned);
        if let Some(name) = name {
            update.nodes[number].1.set_label(name);
        }
    }
}

/// Names what the libraries add without a name.
fn name_parts(update: &mut TreeUpdate) {
    let tabs: Vec<(egui::accesskit::Rect, String)> = update.nodes.iter().filter_map(|(_, node)| tab(node)).collect();
    for (_, node) in &mut update.nodes {
        let acts = node.supports_action(Action::Click) || node.supports_action(Action::Focus);
        if node.label() == Some(COPY) {
            node.set_label("copy the colour");
        }
        let Some(bounds) = node.bounds().filter(|_| !is_named(node)) else { continue };
        match node.role() {
            Role::SpinButton => {
                let colours = [("R ", "red"), ("G ", "green"), ("B ", "blue")];
                let is_of = |(prefix, _): &(&str, &str)| node.value().is_some_and(|value| value.starts_with(prefix));
                if let Some((_, name)) = colours.into_iter().find(is_of) {
                    node.set_label(name);
                }
            }
            Role::ScrollBar if bounds.width() > bounds.height() => node.set_label("horizontal scroll bar"),
            Role::ScrollBar => node.set_label("vertical scroll bar"),
            Role::Unknown if acts && bounds.height() <= THIN => {
                node.set_role(Role::Splitter);
                node.set_label("divider of the panes above and below");
            }
            Role::Unknown if acts && bounds.width() <= THIN => {
                node.set_role(Role::Splitter);
                node.set_label("divider of the panes left and right");
            }
            Role::Unknown if acts && bounds.height() <= TABS => {
                let inside = tabs.iter().find(|(tab, _)| bounds.contains(centre(tab)));
                node.set_label(inside.map_or_else(|| "hue".to_owned(), |(_, name)| format!("tabs from {name}")));
            }
            Role::Unknown if acts => node.set_label("background"),
            _ => {}
        }
    }
}

/// The bounds and the name of a tab: a button that is on or off.
fn tab(node: &Node) -> Option<(egui::accesskit::Rect, String)> {
    let is_tab = node.role() == Role::Button && node.toggled().is_some();
    Some((node.bounds().filter(|_| is_tab)?, node.label()?.to_owned()))
}

fn centre(bounds: &egui::accesskit::Rect) -> egui::accesskit::Point {
    egui::accesskit::Point::new(0.5 * (bounds.x0 + bounds.x1), 0.5 * (bounds.y0 + bounds.y1))
}
