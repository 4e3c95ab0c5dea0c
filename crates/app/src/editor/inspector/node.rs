//! The selected node: state, inputs, parameters, outputs and manual page.

use egui::{Button, Frame, Label, RichText, Ui};
use orograph_graph::{Edit, Fallback, Input, Kind, Node, ParamSpec, ParamValue, Prefer, When, bytes};

use super::{
    form::{FormState, TextField, line, section, title, words},
    manual,
    note::{self, Draft},
    outputs,
    row::{RowAction, Subject, carry_out, menu, named_as, resting, row, show_docs, wires},
    shown::{self, Kept},
    target::Target,
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
            let idle = spec.idle(&instance.params, |input| graph.is_wired(index, input));
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
            let subject = Subject { target: &target, spec, value, changed };
            match idle {
                Some(when) => resting(ui, form, session, subject, when),
                None => row(ui, form, session, subject),
            }
        }
    }
    section(ui, "Outputs");
    outputs::show(ui, form, session, name, index);
    shown::show(ui, kept, session, name);
    section(ui, "Manual");
    egui::CollapsingHeader::new(node.id).id_salt(("manual", node.id)).show(ui, |ui| manual::show(ui, node));
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

/// An input: its wire, its constant, or nothing.
fn input(ui: &mut Ui, form: &mut FormState, session: &mut Session, node: &str, wiring: &Wiring) {
    let Wiring { input, source, constant } = wiring;
    let target = Target::Input { node: node.to_owned(), name: input.name.to_owned() };
    if let (None, Fallback::Constant { default, hard, soft }) = (source, input.fallback) {
        let kind = Kind::Float { default, hard, soft };
        let spec = ParamSpec { name: input.name, doc: input.doc, unit: input.ty.unit(), kind, when: &[] };
        let value = ParamValue::Float(constant.unwrap_or(default));
        row(ui, form, session, Subject { target: &target, spec: &spec, value: &value, changed: constant.is_some() });
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
