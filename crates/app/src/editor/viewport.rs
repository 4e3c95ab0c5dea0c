//! The pane of the land.

use super::Session;

/// The pane of the land.
#[derive(Debug)]
pub(super) struct Viewport {}

impl Viewport {
    /// A viewport that draws with the window's device; without one it says that there is none.
    pub(super) const fn new(_: Option<&eframe::egui_wgpu::RenderState>) -> Self {
        Self {}
    }

    pub(super) fn ui(&mut self, ui: &mut egui::Ui, session: &mut Session) {
        ui.label(session.shown().unwrap_or_default());
    }
}
