//! The divider between two compared outputs.

use egui::{Align2, Color32, CursorIcon, Rect, Sense, Stroke, pos2, vec2};

use super::map::label;

/// The position of the divider.
#[derive(Debug)]
pub(super) struct Split {
    /// As a fraction of the pane's width.
    share: f32,
}

impl Default for Split {
    fn default() -> Self {
        Self { share: 0.5 }
    }
}

impl Split {
    /// Moves the divider by a fraction of the pane's width.
    pub(super) fn step(&mut self, by: f32) {
        self.share = (self.share + by).clamp(0.02, 0.98);
    }

    /// Lets you drag the divider; returns its x on the screen.
    pub(super) fn ui(&mut self, ui: &egui::Ui, pane: Rect) -> f32 {
        let x = pane.left() + self.share * pane.width();
        let grip = Rect::from_center_size(pos2(x, pane.center().y), vec2(12.0, pane.height()));
        let response =
            ui.interact(grip, ui.id().with("split"), Sense::drag()).on_hover_cursor(CursorIcon::ResizeHorizontal);
        if let Some(at) = response.interact_pointer_pos() {
            self.share = ((at.x - pane.left()) / pane.width()).clamp(0.02, 0.98);
        }
        pane.left() + self.share * pane.width()
    }
}

/// The part of the pane that shows one side.
pub(super) fn half(pane: Rect, edge: Option<f32>, side: usize) -> Rect {
    match (edge, side) {
        (Some(x), 0) => Rect::from_min_max(pane.min, pos2(x, pane.max.y)),
        (Some(x), _) => Rect::from_min_max(pos2(x, pane.min.y), pane.max),
        (None, _) => pane,
    }
}

/// Draws the divider, with the names of the outputs on its left and right.
pub(super) fn draw(painter: &egui::Painter, pane: Rect, x: f32, names: [&str; 2]) {
    painter.vline(x, pane.y_range(), Stroke::new(2.0, Color32::WHITE));
    for (name, align, x) in [(names[0], Align2::RIGHT_TOP, x - 12.0), (names[1], Align2::LEFT_TOP, x + 12.0)] {
        label(painter, pos2(x, pane.top() + 8.0), align, name);
    }
}
