//! The row of a number or a parameter: its name, its widget, the reset button, and a menu.

use egui::{Button, Label, RichText, Ui, containers::menu::MenuButton};
use orograph_graph::{Edit, ParamSpec, ParamValue, Port, When};

use super::{
    form::{FormState, line, words},
    target::Target,
    value::{self, Place},
};
use crate::editor::{Session, window::names::Named as _};

/// An action on a whole row.
pub(super) enum RowAction {
    Reset,
    Expose,
    Conceal(String),
    Wire(String),
    Jump(String),
}

/// What a row is about.
#[derive(Clone, Copy)]
pub(super) struct Subject<'a> {
    pub target: &'a Target,
    pub spec: &'a ParamSpec,
    pub value: &'a ParamValue,
    /// Whether the value differs from the default.
    pub changed: bool,
}

/// A row with a value: its name, its widget, the reset button, and a menu.
pub(super) fn row(ui: &mut Ui, form: &mut FormState, session: &mut Session, subject: Subject<'_>) {
    let action = fields(ui, form, session, subject);
    carry_out(ui, form, session, subject.target, action);
}

/// A row that has no effect with the current settings and wires: it is greyed out, and its tooltip gives the reason. It
/// can still be edited; large widgets are hidden.
pub(super) fn resting(ui: &mut Ui, form: &mut FormState, session: &mut Session, subject: Subject<'_>, when: &When) {
    let Subject { target, spec, changed, .. } = subject;
    let why = format!("No effect now: used only if {when}");
    ui.scope(|ui| {
        ui.multiply_opacity(RESTING);
        if value::is_tall(&spec.kind) {
            let (_, label) = line(ui, target.label(), changed, |ui, _| {
                ui.add(Label::new(format!("only if {}", when.to_string().replace('`', ""))).truncate());
            });
            label.on_hover_ui(|ui| show_docs(ui, spec.doc, &spec.kind.describe(spec.unit)));
        } else {
            form.rest(Some(why));
            row(ui, form, session, subject);
            form.rest(None);
        }
    });
}

/// Opacity of rows without effect.
const RESTING: f32 = 0.45;

/// Width of the buttons at the end of a row.
const BUTTONS: f32 = 48.0;

fn fields(
    ui: &mut Ui,
    form: &mut FormState,
    session: &mut Session,
    Subject { target, spec, value, changed }: Subject<'_>,
) -> Option<RowAction> {
    let id = ui.make_persistent_id(target.key());
    let world = session.document().world();
    let folder = session.document().folder().to_owned();
    let named = named_as(session, target);
    let name = words(target.label());
    let tall = value::is_tall(&spec.kind);
    let (mut asked, mut action) = (None, None);
    let (label_id, label) = line(ui, target.label(), changed, |ui, label| {
        let place = Place { line: id, label: label.id, name: &name, world, folder: &folder };
        let size = egui::vec2((ui.available_width() - BUTTONS).max(20.0), ui.spacing().interact_size.y);
        let room = ui.allocate_ui_with_layout(size, egui::Layout::left_to_right(egui::Align::Center), |ui| {
            ui.set_min_width(size.x);
            if !tall {
                asked = value::show(ui, form, place, spec, value);
            }
        });
        if let Some(why) = form.resting() {
            ui.interact(room.response.rect, id.with("why"), egui::Sense::hover()).on_hover_text(why);
        }
        ui.spacing_mut().item_spacing.x = 2.0;
        ui.spacing_mut().button_padding.x = 1.0;
        if changed {
            let back = ui.add_sized([18.0, size.y], Button::new("⟲").frame(false));
            let back = back.named(format!("reset {}", words(target.label())));
            let default = in_words(spec, &spec.kind.default_value());
            if back.on_hover_text(format!("Back to {default}")).clicked() {
                action = Some(RowAction::Reset);
            }
        } else {
            ui.add_space(18.0 + ui.spacing().item_spacing.x);
        }
        let more =
            MenuButton::from_button(Button::new("…").frame_when_inactive(false).min_size(egui::vec2(18.0, size.y)));
        let more = more.ui(ui, |ui| menu(ui, session, target, changed, named.as_deref(), &mut action)).0;
        let _ = more.named(format!("menu of {}", words(target.label())));
        label.id
    });
    label.context_menu(|ui| menu(ui, session, target, changed, named.as_deref(), &mut action));
    label.on_hover_ui(|ui| {
        show_docs(ui, spec.doc, &spec.kind.describe(spec.unit));
        if let Some(why) = form.resting() {
            ui.label(why);
        }
    });
    if tall {
        let place = Place { line: id, label: label_id, name: &name, world, folder: &folder };
        asked = ui.push_id(id, |ui| value::show(ui, form, place, spec, value)).inner;
    }
    if let Some(name) = &named
        && !matches!(target, Target::Named { .. })
    {
        ui.label(RichText::new(format!("exposed as `{name}`")).small().weak());
    }
    if let Some(asked) = asked {
        target.carry_out(asked, id, form, session);
    }
    form.reason(ui, id);
    action
}

/// A value as text.
fn in_words(spec: &ParamSpec, value: &ParamValue) -> String {
    match value {
        ParamValue::Float(number) => spec.unit.display(*number),
        other => other.to_string(),
    }
}

/// Documentation in a tooltip.
pub(super) fn show_docs(ui: &mut Ui, doc: &str, allowed: &str) {
    ui.set_max_width(360.0);
    ui.label(doc);
    ui.weak(allowed);
}

/// The menu of a row.
pub(super) fn menu(
    ui: &mut Ui,
    session: &Session,
    target: &Target,
    changed: bool,
    named: Option<&str>,
    action: &mut Option<RowAction>,
) {
    let mut offer = |ui: &mut Ui, enabled: bool, text: &str, what: RowAction| {
        if ui.add_enabled(enabled, Button::new(text)).clicked() {
            *action = Some(what);
            ui.close();
        }
    };
    offer(ui, changed, "Reset", RowAction::Reset);
    match named {
        _ if matches!(target, Target::Several { .. }) => {}
        Some(name) => offer(ui, true, &format!("Stop exposing `{name}`"), RowAction::Conceal(name.to_owned())),
        None => offer(ui, true, "Expose as parameter", RowAction::Expose),
    }
    if matches!(target, Target::Input { .. }) {
        ui.menu_button("Wire", |ui| wire_list(ui, session, target, action));
    }
}

/// The name under which the file exposes a value. Returns None when it is not exposed.
pub(super) fn named_as(session: &Session, target: &Target) -> Option<String> {
    let document = session.document();
    let (node, name) = match target {
        Target::Param { node, name } | Target::Input { node, name } => (node, name),
        Target::Named { name, .. } => return Some(name.clone()),
        Target::Several { .. } => return None,
    };
    let index = document.graph().find(node).ok()?;
    let leads = |places: &[orograph_graph::Place]| {
        places.iter().any(|place| place.node == index && place.name == name.as_str())
    };
    let parameter = document.parameters().iter().find(|named| leads(&named.places)).map(|named| named.name.clone());
    let input = || document.inputs().iter().find(|named| leads(&named.places)).map(|named| named.name.clone());
    parameter.or_else(input)
}

pub(super) fn carry_out(
    ui: &Ui,
    form: &mut FormState,
    session: &mut Session,
    target: &Target,
    action: Option<RowAction>,
) {
    let id = ui.make_persistent_id(target.key());
    let edit = match (action, target) {
        (None, _) => return,
        (Some(RowAction::Jump(node)), _) => return session.select_only(&node),
        (Some(RowAction::Reset), _) => target.reset(),
        (Some(RowAction::Conceal(name)), _) => Edit::Conceal { name },
        (Some(RowAction::Wire(from)), Target::Input { node, name }) => {
            Edit::Connect { from, to: node.clone(), input: name.clone() }
        }
        (Some(RowAction::Expose), Target::Param { node, name } | Target::Input { node, name }) => {
            form.judge(id, expose(session, node, name));
            return;
        }
        (Some(RowAction::Wire(_) | RowAction::Expose), _) => return,
    };
    form.judge(id, session.attempt(&edit));
}

/// Exposes a value: under its own name, or with the name of the node if that is taken or too vague.
fn expose(session: &mut Session, node: &str, name: &str) -> Result<(), String> {
    let document = session.document();
    let parameters = document.parameters().iter().map(|named| named.name.as_str());
    let taken: Vec<String> =
        parameters.chain(document.inputs().iter().map(|named| named.name.as_str())).map(str::to_owned).collect();
    let long = format!("{}_{name}", node.replace('-', "_"));
    let numbered = (2..100).map(|number| format!("{long}_{number}"));
    let candidates = [name.to_owned(), long.clone()].into_iter().chain(numbered);
    let mut result = Ok(());
    for to in candidates.filter(|to| !taken.contains(to)) {
        result = session.attempt(&Edit::Expose { node: node.to_owned(), name: name.to_owned(), to: to.clone() });
        if result.is_ok() || to != name {
            break;
        }
    }
    result
}

/// The button that lists the compatible outputs.
pub(super) fn wires(ui: &mut Ui, session: &Session, target: &Target, action: &mut Option<RowAction>) {
    ui.menu_button("wire…", |ui| wire_list(ui, session, target, action))
        .response
        .named(format!("wire into {}", words(target.label())))
        .on_hover_text("Choose a compatible output");
}

fn wire_list(ui: &mut Ui, session: &Session, target: &Target, action: &mut Option<RowAction>) {
    let [node, input] = target.key();
    let fitting = fitting(session, node, input);
    if fitting.is_empty() {
        ui.weak("No compatible output");
    }
    egui::ScrollArea::vertical().max_height(320.0).show(ui, |ui| {
        for port in &fitting {
            if ui.button(port).clicked() {
                *action = Some(RowAction::Wire(port.clone()));
                ui.close();
            }
        }
    });
}

/// Outputs of other nodes that fit an input without closing a cycle.
fn fitting(session: &Session, node: &str, input: &str) -> Vec<String> {
    let graph = session.document().graph();
    let Ok(to) = graph.find(node) else { return Vec::new() };
    let mut trial = graph.clone();
    let mut names = Vec::new();
    for node in graph.indices().filter(|node| *node != to) {
        for output in 0..graph.instance(node).node.outputs.len() {
            let port = Port { node, output };
            if trial.connect(port, to, input).is_ok() {
                names.push(graph.port_name(port));
            }
        }
    }
    names
}
