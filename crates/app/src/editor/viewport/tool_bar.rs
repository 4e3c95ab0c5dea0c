//! The bar of a tool. It lies on the top of the picture, so that the ground stays where it is when a tool begins and ends.

use egui::{Align, Frame, Layout, Margin, Rect, Sense, Ui, UiBuilder, vec2};

/// The bar of the present tool.
#[derive(Debug, Default)]
pub(super) struct ToolBar {
    /// Its height in the last frame, in points; 0 without a bar.
    height: f32,
}

impl ToolBar {
    /// Height of what it covers of the picture, in points.
    pub(super) const fn height(&self) -> f32 {
        self.height
    }

    /// Draws it on a picture that fills a pane.
    pub(super) fn show(&mut self, ui: &mut Ui, pane: Rect, contents: impl FnOnce(&mut Ui)) {
        // What happens between the buttons is not the picture's. Without the focus, screen readers do not find the ground.
        let ground = Rect::from_min_size(pane.min, vec2(pane.width(), self.height));
        ui.interact(ground, ui.id().with("tool bar"), Sense::CLICK | Sense::DRAG);
        // Its own identity keeps that of the buttons, whatever lies below: a click may begin over one picture and end over
        // another.
        let inside = UiBuilder::new().id(ui.id().with("contents of the tool bar")).max_rect(pane);
        let mut inside = ui.new_child(inside.layout(Layout::top_down(Align::Min)));
        let frame = Frame::new().fill(ui.visuals().panel_fill).inner_margin(Margin::symmetric(0, 3));
        let bar = frame.show(&mut inside, |ui| {
            ui.set_width(ui.available_width());
            contents(ui);
        });
        let height = bar.response.rect.height();
        if height != self.height {
            self.height = height;
            ui.ctx().request_repaint();
        }
    }

    /// There is no bar.
    pub(super) const fn hide(&mut self) {
        self.height = 0.0;
    }
}
