//! The outputs of a node: pinned to the viewport, written to files.

use egui::{Label, RichText, Ui};
use orograph_graph::{Edit, NodeIndex, Port};

use super::{
    form::{FormState, line, words},
    row::show_docs,
};
use crate::editor::{Session, window::names::Named as _};

/// The outputs of the node: each can be pinned to the viewport, and be an output of the file.
pub(super) fn show(ui: &mut Ui, form: &mut FormState, session: &mut Session, name: &str, index: NodeIndex) {
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
    candidates.find(|name| !taken(name)).unwrap_or_else(|| words(port))
}
