//! The pane of the graph: nodes and wires.

use super::Session;

/// The pane of the graph.
#[derive(Debug, Default)]
pub(super) struct Canvas {}

impl Canvas {
    pub(super) fn ui(&mut self, ui: &mut egui::Ui, session: &mut Session) {
        let names: Vec<String> = session.document().nodes().iter().map(|node| node.name.clone()).collect();
        for name in names {
            if ui.selectable_label(session.is_selected(&name), &name).clicked() {
                session.select_only(&name);
            }
        }
    }
}
