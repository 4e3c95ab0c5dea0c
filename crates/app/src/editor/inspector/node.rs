//! The selected node: state, inputs, parameters, outputs and manual page.

use egui::{Button, Frame, Label, RichText, Ui, containers::menu::MenuButton};
use orograph_graph::{Edit, Fallback, Input, Kind, Node, NodeIndex, ParamSpec, ParamValue, Port, Prefer, When, bytes};

use super::{
    form::{self, FormState, TextField, line, section, title, words},
    manual,
    note::{self, Draft},
    shown::{self, Kept},
    target::Target,
    value::{self, Place},
};
use crate::{
    editor::{NodeState, Session, window::names::Named as _},
    report::progress::seconds,
};

/// An input and its connection.
struct Wiring {
    input: &'static Input,
    /// The output that it reads, as `node.port`.
    source: Option<String>,
    /// The constant in the file.
    constant: Option<f64>,
}

/// Shows a node.
pub(super) fn show(
    ui: &mut Ui,
    form: &mut FormState,
    (kept, draft): (&mut Option<Kept>, &mut Option<Draft>),
    session: &mut Session,
    name: &str,
) {
    let document = session.document();
    let Some(entry) = document.node(name) else { return };
    let Some(index) = entry.index else {
        let (kind, span) = (entry.kind.clone(), entry.span.clone());
        let problems = document.problems().iter().filter(|problem| span.contains(&problem.span.start));
        let problems: Vec<(String, Option<String>)> =
            problems.map(|problem| (problem.message.clone(), problem.hint.clone())).collect();
        placeholder(ui, form, session, (name, &kind), &problems);
        return;
    };
    let graph = document.graph();
    let instance = graph.instance(index);
    let node = instance.node;
    let params: Vec<(ParamSpec, ParamValue, Option<&When>)> = node
        .specs()
        .into_iter()
        .map(|spec| {
            let value = instance.params.get(spec.name).cloned().unwrap_or_else(|| spec.kind.default_value());
            let idle = spec.idle(&instance.params);
            (spec, value, idle)
        })
        .collect();
    let inputs: Vec<Wiring> = node
        .inputs
        .iter()
        .enumerate()
        .map(|(position, input)| Wiring {
            input,
            source: graph.source(index, position).map(|port| graph.port_name(port)),
            constant: instance.constants[position],
        })
        .collect();

    let (muted, note_text) = (entry.muted, entry.note.clone());
    heading(ui, form, session, name, node, muted);
    state(ui, session, name);
    note::show(ui, draft, session, (name, &note_text));
    if !inputs.is_empty() {
        section(ui, "Inputs");
        for wiring in &inputs {
            input(ui, form, session, name, wiring);
        }
    }
    if !params.is_empty() {
        section(ui, "Parameters");
        for (spec, value, idle) in &params {
            let target = Target::Param { node: name.to_owned(), name: spec.name.to_owned() };
            let changed = *value != spec.kind.default_value();
            match idle {
                Some(when) => resting(ui, form, session, &target, (spec, value, changed), when),
                None => row(ui, form, session, &target, spec, value, changed),
            }
        }
    }
    section(ui, "Outputs");
    outputs(ui, form, session, name, index);
    shown::show(ui, kept, session, name);
    section(ui, "Manual");
    egui::CollapsingHeader::new(node.id).id_salt(("manual", node.id)).show(ui, |ui| manual::show(ui, node));
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

/// The name, which can be edited, and the type.
fn heading(ui: &mut Ui, form: &mut FormState, session: &mut Session, name: &str, node: &Node, muted: bool) {
    let id = ui.make_persistent_id(("node", name));
    rename(ui, form, session, name, id);
    let kind = format!("{} · {}", node.id, words(node.category));
    ui.horizontal(|ui| {
        let mut on = muted;
        let switch = ui.checkbox(&mut on, RichText::new("muted").small());
        if switch.on_hover_text("Bypass this node").changed() {
            form.judge(id, session.attempt(&Edit::SetMuted { node: name.to_owned(), muted: on }));
        }
        if cfg!(feature = "gpu") && session.can_prefer(name) {
            backend(ui, session, name);
        }
        ui.add(Label::new(RichText::new(kind).small().weak()).truncate());
    });
    ui.add(Label::new(node.summary).wrap());
}

/// Where its kernel runs.
fn backend(ui: &mut Ui, session: &mut Session, name: &str) {
    let told = |backend: Prefer| match backend {
        Prefer::Auto => "auto",
        Prefer::Cpu => "CPU",
        Prefer::Device => "GPU",
    };
    let before = session.preferred(name);
    let mut chosen = before;
    let text = |backend: Prefer| RichText::new(told(backend)).small();
    let choice = egui::ComboBox::from_id_salt(("backend", name)).selected_text(text(before)).width(48.0);
    let shown = choice.show_ui(ui, |ui| {
        for backend in [Prefer::Auto, Prefer::Cpu, Prefer::Device] {
            ui.selectable_value(&mut chosen, backend, told(backend));
        }
    });
    shown.response.named("where it is computed").on_hover_text(
        "Where it is computed: auto uses a graphics card if there is one, GPU also a driver in software. \
         The choice is not saved in the file",
    );
    if chosen != before {
        session.prefer(name, chosen);
    }
}

fn rename(ui: &mut Ui, form: &mut FormState, session: &mut Session, name: &str, line: egui::Id) {
    let width = ui.available_width() - 8.0;
    let entry = TextField {
        salt: "name",
        text: name,
        hint: "name",
        hover: "The node's name; wires are updated",
        width,
        label: None,
        name: "name of the node",
    };
    let typed = ui
        .scope(|ui| {
            ui.style_mut().override_text_style = Some(egui::TextStyle::Heading);
            form.entry(ui, line, entry)
        })
        .inner;
    if let Some(to) = typed {
        let made = session.attempt(&Edit::RenameNode { from: name.to_owned(), to: to.clone() });
        if made.is_ok() {
            session.select_only(&to);
        }
        form.judge(line, made);
    }
    form.reason(ui, line);
}

/// A node of an unknown type.
fn placeholder(
    ui: &mut Ui,
    form: &mut FormState,
    session: &mut Session,
    (name, kind): (&str, &str),
    problems: &[(String, Option<String>)],
) {
    title(ui, name);
    let what = if kind.is_empty() { "This is not a node".to_owned() } else { format!("{kind} cannot be used") };
    ui.label(RichText::new(what).color(ui.visuals().error_fg_color));
    for (message, hint) in problems {
        ui.add(Label::new(message).wrap());
        if let Some(hint) = hint {
            ui.add(Label::new(RichText::new(hint).weak()).wrap());
        }
    }
    ui.add(Label::new("It stays in the file unchanged until you fix it there or remove it.").wrap());
    if ui.button("Remove it").clicked() {
        let made = session.attempt(&Edit::RemoveNode { name: name.to_owned() });
        form.judge(ui.id(), made);
    }
    form.reason(ui, ui.id());
}

/// Its state, its time and memory, and its errors.
fn state(ui: &mut Ui, session: &mut Session, name: &str) {
    let info = session.node(name);
    match &info.state {
        NodeState::Waiting => standing(ui, |ui| ui.weak("Waiting")),
        NodeState::Unwired { .. } => {
            standing(ui, |ui| ui.weak(info.state.lacks().unwrap_or_default()));
        }
        NodeState::Running { fraction } => {
            standing(ui, |ui| ui.add(egui::ProgressBar::new(*fraction).desired_height(6.0)));
        }
        NodeState::Fresh => {
            let took = info.time.map(|(time, cells)| format!("{} at {cells} cells, ", seconds(time)));
            let mut text = took.map_or_else(|| "Ready".to_owned(), |took| took + &bytes(info.bytes as u64));
            if info.on_device {
                text += ", GPU";
            }
            standing(ui, |ui| ui.weak(text));
        }
        NodeState::Failed { message, hint, at } => {
            let colour = ui.visuals().error_fg_color;
            boxed(ui, colour, message, hint.as_deref());
            if let Some(at) = at
                && session.document().graph().find(at).is_ok()
                && ui.button(format!("Go to {at}")).on_hover_text("The node that failed").clicked()
            {
                session.select_only(at);
            }
        }
    }
    for warning in &info.warnings {
        let colour = ui.visuals().warn_fg_color;
        boxed(ui, colour, warning, None);
    }
    if session.lacks_device(name) {
        let colour = ui.visuals().warn_fg_color;
        let hint = "`orograph devices` lists the graphics drivers.";
        boxed(ui, colour, "Computed on the CPU: no graphics device is available.", Some(hint));
    }
}

/// A row of fixed height, whatever it contains, so that the rows below stay in place while a node is built.
fn standing(ui: &mut Ui, add: impl FnOnce(&mut Ui) -> egui::Response) {
    let size = egui::vec2(ui.available_width(), ui.text_style_height(&egui::TextStyle::Body) + 2.0);
    ui.allocate_ui_with_layout(size, egui::Layout::left_to_right(egui::Align::Center), |ui| {
        ui.set_min_size(size);
        add(ui);
    });
}

/// A highlighted message.
fn boxed(ui: &mut Ui, colour: egui::Color32, message: &str, hint: Option<&str>) {
    let frame = Frame::new().stroke(egui::Stroke::new(1.0, colour)).corner_radius(4.0).inner_margin(6.0);
    frame.show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.add(Label::new(RichText::new(message).color(colour)).wrap());
        if let Some(hint) = hint {
            ui.add(Label::new(hint).wrap());
        }
    });
}

/// An action on a whole row.
enum RowAction {
    Reset,
    Expose,
    Conceal(String),
    Wire(String),
    Jump(String),
}

/// An input: its wire, its constant, or nothing.
fn input(ui: &mut Ui, form: &mut FormState, session: &mut Session, node: &str, wiring: &Wiring) {
    let Wiring { input, source, constant } = wiring;
    let target = Target::Input { node: node.to_owned(), name: input.name.to_owned() };
    if let (None, Fallback::Constant { default, hard, soft }) = (source, input.fallback) {
        let kind = Kind::Float { default, hard, soft };
        let spec = ParamSpec { name: input.name, doc: input.doc, unit: input.ty.unit(), kind, when: &[] };
        let value = ParamValue::Float(constant.unwrap_or(default));
        let action = fields(ui, form, session, &target, &spec, &value, constant.is_some());
        carry_out(ui, form, session, &target, action);
        return;
    }
    let mut action = None;
    let (_, label) = line(ui, input.name, source.is_some(), |ui, _| match source {
        Some(source) => {
            let shown = source.strip_suffix(".height").unwrap_or(source);
            if ui.link(format!("⬅ {shown}")).on_hover_text("Go to this node").clicked() {
                action =
                    Some(RowAction::Jump(source.split_once('.').map_or(source.as_str(), |(node, _)| node).to_owned()));
            }
            let cut = ui.add(Button::new("✖").small().frame(false)).named(format!("disconnect {}", words(input.name)));
            if cut.on_hover_text("Disconnect").clicked() {
                action = Some(RowAction::Reset);
            }
        }
        None if input.fallback == Fallback::Required => {
            ui.colored_label(ui.visuals().warn_fg_color, "not wired");
            wires(ui, session, &target, &mut action);
        }
        None => {
            ui.weak("not wired");
            wires(ui, session, &target, &mut action);
        }
    });
    let named = named_as(session, &target);
    label.context_menu(|ui| menu(ui, session, &target, source.is_some(), named.as_deref(), &mut action));
    label.on_hover_ui(|ui| show_docs(ui, input.doc, &input.ty.to_string()));
    carry_out(ui, form, session, &target, action);
}

/// The button that lists the compatible outputs.
fn wires(ui: &mut Ui, session: &Session, target: &Target, action: &mut Option<RowAction>) {
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

/// A row with a value: its name, its widget, the reset button, and a menu.
pub(super) fn row(
    ui: &mut Ui,
    form: &mut FormState,
    session: &mut Session,
    target: &Target,
    spec: &ParamSpec,
    value: &ParamValue,
    changed: bool,
) {
    let action = fields(ui, form, session, target, spec, value, changed);
    carry_out(ui, form, session, target, action);
}

/// A row that has no effect with the current settings: it is greyed out, and its tooltip gives the reason. It can still
/// be edited; large widgets are hidden.
fn resting(
    ui: &mut Ui,
    form: &mut FormState,
    session: &mut Session,
    target: &Target,
    (spec, value, changed): (&ParamSpec, &ParamValue, bool),
    when: &When,
) {
    let why = format!("No effect with the current settings: used only if {when}");
    ui.scope(|ui| {
        ui.multiply_opacity(RESTING);
        if value::is_tall(&spec.kind) {
            let (_, label) = line(ui, target.label(), changed, |ui, _| {
                ui.add(Label::new(format!("only if {}", when.to_string().replace('`', ""))).truncate());
            });
            label.on_hover_ui(|ui| show_docs(ui, spec.doc, &spec.kind.describe(spec.unit)));
        } else {
            form.rest(Some(why));
            row(ui, form, session, target, spec, value, changed);
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
    target: &Target,
    spec: &ParamSpec,
    value: &ParamValue,
    changed: bool,
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
fn show_docs(ui: &mut Ui, doc: &str, allowed: &str) {
    ui.set_max_width(360.0);
    ui.label(doc);
    ui.weak(allowed);
}

/// The menu of a row.
fn menu(
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
fn named_as(session: &Session, target: &Target) -> Option<String> {
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

fn carry_out(ui: &Ui, form: &mut FormState, session: &mut Session, target: &Target, action: Option<RowAction>) {
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

/// The outputs of the node: each can be pinned to the viewport, and be an output of the file.
fn outputs(ui: &mut Ui, form: &mut FormState, session: &mut Session, name: &str, index: NodeIndex) {
    let document = session.document();
    let graph = document.graph();
    let ports: Vec<(String, String, &'static str, Option<String>, bool)> = graph
        .instance(index)
        .node
        .outputs
        .iter()
        .enumerate()
        .map(|(output, declared)| {
            let port = Port { node: index, output };
            let ty = graph.output_type(port);
            let written =
                document.outputs().iter().find(|output| output.port == port).map(|output| output.name.clone());
            (graph.port_name(port), ty.to_string(), declared.doc, written, ty.is_writable())
        })
        .collect();
    for (port, ty, doc, written, writable) in ports {
        let short = port.strip_prefix(name).and_then(|rest| rest.strip_prefix('.')).unwrap_or(&port).to_owned();
        let pinned = session.pinned() == Some(port.as_str());
        let (_, label) = line(ui, &short, written.is_some(), |ui, _| {
            let pin = ui.selectable_label(pinned, "👁").named(format!("pin {}", words(&short)));
            if pin.on_hover_text("Pin to viewport").clicked() {
                session.pin((!pinned).then(|| port.clone()));
            }
            let mut on = written.is_some();
            let check = ui.add_enabled(writable, egui::Checkbox::new(&mut on, "output"));
            let check = check.named(format!("output {}", words(&short)));
            if check.on_hover_text("Write this output to a file on export").changed() {
                let id = ui.id().with(&port);
                let edit = match &written {
                    Some(output) => Edit::RemoveOutput { name: output.clone() },
                    None => Edit::SetOutput { name: free_output(session, name, &short), from: port.clone() },
                };
                form.judge(id, session.attempt(&edit));
                form.reason(ui, id);
            }
            ui.add(Label::new(RichText::new(&ty).weak()).truncate());
        });
        label.on_hover_ui(|ui| show_docs(ui, doc, &ty));
    }
}

/// An unused name for an output.
fn free_output(session: &Session, node: &str, port: &str) -> String {
    let taken = |name: &str| session.document().outputs().iter().any(|output| output.name == name);
    let numbered = (2..).map(|number| format!("{node}_{number}"));
    let mut candidates = [port.to_owned(), node.to_owned()].into_iter().chain(numbered);
    candidates.find(|name| !taken(name)).unwrap_or_else(|| form::words(port))
}
