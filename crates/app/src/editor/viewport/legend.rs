//! The legend of numbers in the viewport: the colours of their range, with the values at its ends and in its middle.

use egui::{Align2, Color32, FontId, Id, Mesh, Rect, Sense, Shape, Ui, WidgetInfo, WidgetType, pos2, vec2};
use orograph_graph::PortType;

use super::{Shown, map::short};
use crate::export::picture::{Scale, palette_of, tints};

/// Size of the bar of colours in points, and its distance from the corner.
const SIZE: egui::Vec2 = vec2(190.0, 10.0);
const MARGIN: f32 = 14.0;

/// The legend of an output, kept until its samples change.
#[derive(Debug, Default)]
pub(super) struct Legend {
    /// The output, the address of its samples, which never change in place, and their scale.
    kept: Option<(String, usize, Scale)>,
}

impl Legend {
    /// Draws the legend in the upper left corner of the rest of the pane, if the output has numbers with a unit.
    /// Returns the top of what is left of the pane.
    pub(super) fn ui(&mut self, ui: &Ui, pane: Rect, shown: &Shown) -> f32 {
        let room = pane.width() > SIZE.x + 2.0 * MARGIN && pane.height() > 120.0;
        let PortType::Scalar(unit) = shown.ty else { return pane.top() };
        let Some(values) = self.values(shown).filter(|_| room) else { return pane.top() };
        draw(ui, pane, shown, &values.map(|value| short(unit, f64::from(value))))
    }

    /// The numbers at the ends and in the middle of the scale.
    fn values(&mut self, shown: &Shown) -> Option<[f32; 3]> {
        let address = shown.field.samples().as_ptr() as usize;
        if self.kept.as_ref().is_none_or(|(port, at, _)| *port != shown.port || *at != address) {
            self.kept = Some((shown.port.clone(), address, Scale::of(&shown.field, shown.ty)));
        }
        let (_, _, scale) = self.kept.as_ref()?;
        Some([scale.number(0.0)?, scale.number(0.5)?, scale.number(1.0)?])
    }
}

/// Draws the legend; returns its lower end.
fn draw(ui: &Ui, pane: Rect, shown: &Shown, values: &[String; 3]) -> f32 {
    let port = &shown.port;
    let painter = ui.painter_at(pane);
    let bar = Rect::from_min_size(pane.left_top() + vec2(MARGIN, MARGIN + 18.0), SIZE);
    let all = Rect::from_min_max(bar.min - vec2(8.0, 24.0), bar.max + vec2(8.0, 20.0));
    painter.rect_filled(all, 3.0, Color32::from_black_alpha(150));
    let mut mesh = Mesh::default();
    let colours = tints(palette_of(shown.ty));
    for (at, [r, g, b]) in colours.iter().enumerate() {
        let x = bar.left() + bar.width() * at as f32 / (colours.len() - 1) as f32;
        let colour = egui::Rgba::from_rgb(*r, *g, *b).into();
        mesh.colored_vertex(pos2(x, bar.top()), colour);
        mesh.colored_vertex(pos2(x, bar.bottom()), colour);
        if at > 0 {
            let last = 2 * at as u32;
            mesh.add_triangle(last - 2, last - 1, last);
            mesh.add_triangle(last - 1, last, last + 1);
        }
    }
    painter.add(Shape::mesh(mesh));
    let font = FontId::proportional(11.0);
    let aligns = [Align2::LEFT_TOP, Align2::CENTER_TOP, Align2::RIGHT_TOP];
    for ((value, align), x) in values.iter().zip(aligns).zip([bar.left(), bar.center().x, bar.right()]) {
        painter.text(pos2(x, bar.bottom() + 4.0), align, value, font.clone(), Color32::WHITE);
    }
    painter.text(bar.left_top() - vec2(0.0, 4.0), Align2::LEFT_BOTTOM, port, font, Color32::WHITE);
    let response = ui.interact(all, Id::new("legend").with(port), Sense::hover());
    let [low, _, high] = values;
    let text = format!("legend of {port}: {low} to {high}");
    response.widget_info(|| WidgetInfo::labeled(WidgetType::Other, true, &text));
    all.bottom()
}
