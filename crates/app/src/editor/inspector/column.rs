//! A table of layers as a geologist's column: the layers to scale, hard ones wide, and a row of fields for each.

use egui::{
    Align2, Button, Color32, CornerRadius, FontId, Label, Rect, RichText, Sense, Stroke, StrokeKind, Ui, WidgetInfo,
    WidgetType, pos2, vec2,
};
use orograph_graph::{Layer, ParamValue, Srgb, Unit};
use orograph_nodes::numerics::math;

use super::{
    form::{FormState, TextField},
    gradient, number,
    value::{Place, ValueChange},
};
use crate::editor::window::names::Named as _;

/// Height of the column.
const TALL: f32 = 180.0;
/// The most rows with fields; longer tables are edited in the file.
const MOST_ROWS: usize = 60;
/// The hardness of the widest bar, and its inverse that of the narrowest.
const WIDEST: f64 = 8.0;

/// Shows a table of layers, and returns the change that was made.
pub(super) fn show(ui: &mut Ui, form: &mut FormState, place: Place<'_>, layers: &[Layer]) -> Option<ValueChange> {
    if layers.is_empty() {
        ui.weak("No table: the layers are generated");
    } else {
        draw(ui, layers, TALL);
        let columns = RichText::new("Thickness, hardness and angle of repose, from the top down").small().weak();
        ui.add(Label::new(columns).wrap());
    }
    let set = |layers: Vec<Layer>| Some(ValueChange::Set(ParamValue::Layers(layers)));
    let mut change = None;
    for (at, layer) in layers.iter().enumerate().take(MOST_ROWS) {
        ui.horizontal(|ui| {
            let remove = ui.add(Button::new("✖").small().frame(false)).named(format!("remove layer {}", at + 1));
            if remove.on_hover_text("Remove the layer").clicked() {
                let mut fewer = layers.to_vec();
                fewer.remove(at);
                change = set(fewer);
            }
            let add = ui.add_enabled(layers.len() < Layer::MOST, Button::new("+").small().frame(false));
            let add = add.named(format!("add a layer below layer {}", at + 1));
            if add.on_hover_text("Add a layer like this one below it").clicked() {
                let mut more = layers.to_vec();
                more.insert(at + 1, *layer);
                change = set(more);
            }
            if let Some(row) = fields(ui, form, place, at, layer) {
                change = Some(row.map_or_else(ValueChange::Wrong, |(layer, dragged)| {
                    let mut changed = layers.to_vec();
                    changed[at] = layer;
                    let changed = ParamValue::Layers(changed);
                    if dragged { ValueChange::Drag(changed) } else { ValueChange::Set(changed) }
                }));
            }
        });
    }
    if layers.len() > MOST_ROWS {
        ui.weak(format!("{} more layers: edit them in the file", layers.len() - MOST_ROWS));
    }
    if layers.is_empty() && ui.button("Add a layer").clicked() {
        change = set(vec![Layer::USUAL]);
    }
    change
}

/// A number of a layer.
type Part = fn(&mut Layer) -> &mut f64;

/// The fields of a layer. Returns the changed layer and whether it is being dragged, or why a text is wrong.
fn fields(
    ui: &mut Ui,
    form: &mut FormState,
    place: Place<'_>,
    at: usize,
    layer: &Layer,
) -> Option<Result<(Layer, bool), String>> {
    let mut changed = None;
    let mut colour = layer.colour.0;
    let what = format!("colour of layer {}", at + 1);
    if ui.color_edit_button_srgb(&mut colour).named(&what).changed() {
        changed = Some(Ok((Layer { colour: Srgb(colour), ..*layer }, true)));
    }
    if let Some(typed) = gradient::hex(ui, form, place, (at, &what), layer.colour) {
        changed = Some(typed.map(|colour| (Layer { colour, ..*layer }, false)));
    }
    let width = ((ui.available_width() - 2.0 * ui.spacing().item_spacing.x) / 3.0).clamp(36.0, 90.0);
    let columns: [(&str, Unit, Part); 3] = [
        ("Thickness", Unit::Metres, |layer| &mut layer.thickness),
        ("Hardness", Unit::One, |layer| &mut layer.hardness),
        ("Repose", Unit::Degrees, |layer| &mut layer.repose),
    ];
    for (name, unit, field) in columns {
        let mut now = *layer;
        let (text, salt) = (unit.display(*field(&mut now)), format!("{name}{at}"));
        let whole = format!("{name} of layer {}", at + 1);
        let hover = format!("{whole}. {}", number::hint(unit));
        let entry = TextField {
            salt: &salt,
            text: &text,
            hint: name,
            hover: &hover,
            width,
            label: Some(place.label),
            name: &whole,
        };
        if let Some(text) = form.quantity(ui, place.line, unit, entry) {
            let parsed = unit.parse(&text).map_err(|error| error.to_string());
            changed = Some(parsed.map(|value| {
                *field(&mut now) = value;
                (now, false)
            }));
        }
    }
    changed
}

/// Draws the layers to scale, from the top down. Hard layers stand out to the right, as they do on a cliff.
pub(super) fn draw(ui: &mut Ui, layers: &[Layer], tall: f32) {
    let (response, painter) = ui.allocate_painter(vec2(ui.available_width().min(220.0), tall), Sense::hover());
    let name =
        if layers.len() == 1 { "Column of 1 layer".to_owned() } else { format!("Column of {} layers", layers.len()) };
    response.widget_info(|| WidgetInfo::labeled(WidgetType::Image, true, &name));
    let total: f64 = layers.iter().map(|layer| layer.thickness).sum();
    let rect = response.rect.shrink2(vec2(2.0, 2.0));
    let y = |depth: f64| rect.top() + rect.height() * (depth / total) as f32;
    let line = Stroke::new(1.0, ui.visuals().weak_text_color());
    let (mut depth, mut under) = (0.0, None);
    for (at, layer) in layers.iter().enumerate() {
        let bar = Rect::from_min_max(
            pos2(rect.left(), y(depth)),
            pos2(rect.left() + rect.width() * share(layer.hardness), y(depth + layer.thickness)),
        );
        depth += layer.thickness;
        let [red, green, blue] = layer.colour.0;
        painter.rect_filled(bar, CornerRadius::ZERO, Color32::from_rgb(red, green, blue));
        if bar.height() > 3.0 {
            painter.rect_stroke(bar, CornerRadius::ZERO, line, StrokeKind::Inside);
        }
        if bar.height() > 14.0 {
            let bright = 0.3 * f32::from(red) + 0.6 * f32::from(green) + 0.1 * f32::from(blue) > 120.0;
            let ink = if bright { Color32::BLACK } else { Color32::WHITE };
            let text = Unit::Metres.display(layer.thickness);
            painter.text(
                bar.left_center() + vec2(5.0, 0.0),
                Align2::LEFT_CENTER,
                text,
                FontId::proportional(11.0),
                ink,
            );
        }
        if response.hover_pos().is_some_and(|pointer| (bar.top()..bar.bottom()).contains(&pointer.y)) {
            under = Some((at, depth - layer.thickness, *layer));
        }
    }
    if let Some((at, top, layer)) = under {
        response.on_hover_text_at_pointer(format!(
            "Layer {}, {} below the top\n{} thick, hardness {}, repose {}",
            at + 1,
            Unit::Metres.display(top),
            Unit::Metres.display(layer.thickness),
            Unit::One.display(layer.hardness),
            Unit::Degrees.display(layer.repose),
        ));
    }
}

/// The share of the width that a bar of a hardness has, on a logarithmic scale.
fn share(hardness: f64) -> f32 {
    let place = math::ln(hardness.clamp(1.0 / WIDEST, WIDEST)) / math::ln(WIDEST);
    (0.65 + 0.35 * place) as f32
}

#[cfg(test)]
mod tests {
    #[test]
    fn hard_layers_stand_out() {
        let widths = [0.001, 0.125, 0.5, 1.0, 2.0, 8.0, 1000.0].map(super::share);
        assert!(widths.is_sorted() && widths[0] == widths[1] && widths[5] == widths[6], "{widths:?}");
        assert!(widths[0] > 0.25 && widths[6] <= 1.0, "{widths:?}");
    }
}
