//! The pane of what is selected: its inputs and parameters, from its declaration alone.

use super::Session;

/// The pane of what is selected.
#[derive(Debug, Default)]
pub(super) struct Inspector {}

impl Inspector {
    pub(super) fn ui(&mut self, ui: &mut egui::Ui, session: &mut Session) {
        for name in session.selection() {
            ui.heading(name);
        }
    }
}
