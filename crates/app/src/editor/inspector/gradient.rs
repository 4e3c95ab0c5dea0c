//! A colour gradient: a bar with a handle for each stop, which you drag; a click on its field opens the colour picker.

use egui::{Color32, CornerRadius, Mesh, Pos2, Rect, Sense, Shape, Stroke, StrokeKind, Ui, pos2, vec2};
use orograph_graph::{ParamValue, Srgb, Stop, Unit};

use super::{
    eyedropper,
    form::{FormState, TextField},
    number,
    value::{Place, ValueChange},
};
use crate::editor::window::names::Named as _;

/// Height of the bar, and of the handles below it.
const BAR: f32 = 20.0;
const HANDLE: f32 = 12.0;

/// Shows a gradient, and returns the change that was made.
pub(super) fn show(
    ui: &mut Ui,
    form: &mut FormState,
    place: Place<'_>,
    unit: Unit,
    stops: &[Stop],
) -> Option<ValueChange> {
    let mut asked = bar(ui, place, stops);
    let mut changed = stops.to_vec();
    for (at, stop) in stops.iter().enumerate() {
        ui.horizontal(|ui| {
            let remove = ui.add_enabled(stops.len() > 1, egui::Button::new("✖").small().frame(false));
            let what = format!("colour {}", at + 1);
            let remove = remove.named(format!("remove {what}"));
            if remove.on_hover_text("Remove the colour").clicked() {
                changed.remove(at);
                asked = Some(ValueChange::Set(ParamValue::Stops(changed.clone())));
            }
            let mut colour = stop.colour.0;
            if ui.color_edit_button_srgb(&mut colour).named(&what).changed() {
                changed[at].colour = Srgb(colour);
                asked = Some(ValueChange::Drag(ParamValue::Stops(changed.clone())));
            }
            let (text, hover) = (unit.display(stop.at), number::hint(unit));
            let (salt, name) = (format!("at{at}"), format!("position of {what}"));
            let entry = TextField {
                salt: &salt,
                text: &text,
                hint: "",
                hover: &hover,
                width: 84.0,
                label: Some(place.label),
                name: &name,
            };
            if let Some(text) = form.quantity(ui, place.line, unit, entry) {
                asked = Some(match unit.parse(&text) {
                    Ok(value) => {
                        changed[at].at = value;
                        changed.sort_by(|a, b| a.at.total_cmp(&b.at));
                        ValueChange::Set(ParamValue::Stops(changed.clone()))
                    }
                    Err(error) => ValueChange::Wrong(error.to_string()),
                });
            }
            if let Some(typed) = hex(ui, form, place, (at, &what), stop.colour) {
                asked = Some(match typed {
                    Ok(colour) => {
                        changed[at].colour = colour;
                        ValueChange::Set(ParamValue::Stops(changed.clone()))
                    }
                    Err(reason) => ValueChange::Wrong(reason),
                });
            }
        });
    }
    asked
}

/// A field for a colour, with its number and name, as six hexadecimal digits, with an eyedropper; returns the new colour,
/// or why the text is none.
pub(super) fn hex(
    ui: &mut Ui,
    form: &mut FormState,
    place: Place<'_>,
    (at, what): (usize, &str),
    now: Srgb,
) -> Option<Result<Srgb, String>> {
    let (text, salt) = (now.to_string(), format!("colour{at}"));
    let name = format!("{what} in hexadecimal digits");
    let hover = "The colour as six hexadecimal digits: red, green, blue";
    let entry =
        TextField { salt: &salt, text: &text, hint: "", hover, width: 64.0, label: Some(place.label), name: &name };
    let typed = form.entry(ui, place.line, entry);
    if let Some(taken) = eyedropper::button(ui, place.line.with(&salt), what) {
        return Some(Ok(taken));
    }
    let typed = typed?;
    let digits = typed.trim_start_matches('#');
    Some(format!("#{digits}").parse().map_err(|error: orograph_graph::NoColour| error.to_string()))
}

/// The bar with its handles; returns the change that was made.
fn bar(ui: &mut Ui, place: Place<'_>, stops: &[Stop]) -> Option<ValueChange> {
    let id = place.line.with("bar");
    let (first, last) = (stops.first()?.at, stops.last()?.at);
    let margin = if last > first { 0.0 } else { first.abs().max(1.0) };
    let held: Option<(usize, [f64; 2])> = ui.data(|data| data.get_temp(id));
    let [low, high] = held.map_or([first - margin, last + margin], |(_, range)| range);
    let (response, painter) = ui.allocate_painter(vec2(ui.available_width(), BAR + HANDLE), Sense::click_and_drag());
    let response = response.named(format!("gradient of {}", place.name));
    let rect = Rect::from_min_size(response.rect.min + vec2(5.0, 0.0), vec2(response.rect.width() - 10.0, BAR));
    let x = |value: f64| rect.left() + rect.width() * ((value - low) / (high - low)) as f32;
    let value = |at: Pos2| low + f64::from((at.x - rect.left()) / rect.width()) * (high - low);
    let near = |pointer: Pos2| {
        let far = |stop: &Stop| (x(stop.at) - pointer.x).abs();
        let nearest = stops.iter().enumerate().min_by(|(_, a), (_, b)| far(a).total_cmp(&far(b)));
        nearest.filter(|(_, stop)| far(stop) < 9.0).map(|(index, _)| index)
    };
    painter.add(Shape::mesh(gradient(rect, stops, &x)));
    painter.rect_stroke(rect, CornerRadius::ZERO, ui.visuals().widgets.noninteractive.bg_stroke, StrokeKind::Outside);
    let edge = Stroke::new(1.0, ui.visuals().strong_text_color());
    for stop in stops {
        let tip = pos2(x(stop.at), rect.bottom() + 1.0);
        let corners = vec![tip, tip + vec2(5.0, HANDLE - 3.0), tip + vec2(-5.0, HANDLE - 3.0)];
        painter.add(Shape::convex_polygon(corners, colour(*stop), edge));
    }

    let pointer = response.interact_pointer_pos();
    if response.drag_started()
        && let Some(point) = ui.input(|input| input.pointer.press_origin()).and_then(near)
    {
        ui.data_mut(|data| data.insert_temp(id, (point, [low, high])));
    }
    if !response.dragged() && held.is_some() {
        ui.data_mut(|data| data.remove::<(usize, [f64; 2])>(id));
    }
    let mut changed = stops.to_vec();
    if let (Some((index, _)), true, Some(pointer)) = (held, response.dragged(), pointer)
        && index < stops.len()
    {
        let least = (high - low) * 1e-3;
        let after = index.checked_sub(1).map_or(low, |before| stops[before].at + least);
        let before = stops.get(index + 1).map_or(high, |next| next.at - least);
        if after <= before {
            changed[index].at = number::short(value(pointer), high - low).clamp(after, before);
        }
        return (changed != stops).then_some(ValueChange::Drag(ParamValue::Stops(changed)));
    }
    if response.double_clicked()
        && let Some(pointer) = pointer.filter(|pointer| near(*pointer).is_none())
    {
        let at = number::short(value(pointer), high - low);
        let index = changed.partition_point(|stop| stop.at < at);
        changed.insert(index, Stop { at, colour: between(stops, at) });
        return Some(ValueChange::Set(ParamValue::Stops(changed)));
    }
    response.on_hover_text_at_pointer("Drag a handle; double-click the bar to add a colour");
    None
}

const fn colour(stop: Stop) -> Color32 {
    let [red, green, blue] = stop.colour.0;
    Color32::from_rgb(red, green, blue)
}

/// The colour between two stops, as the bar shows it.
fn between(stops: &[Stop], at: f64) -> Srgb {
    let after = stops.partition_point(|stop| stop.at < at).min(stops.len() - 1);
    let (a, b) = (stops[after.saturating_sub(1)], stops[after]);
    let share = if b.at > a.at { ((at - a.at) / (b.at - a.at)).clamp(0.0, 1.0) } else { 0.0 };
    let mix = |a: u8, b: u8| (f64::from(a) + (f64::from(b) - f64::from(a)) * share).round() as u8;
    Srgb([0, 1, 2].map(|part| mix(a.colour.0[part], b.colour.0[part])))
}

fn gradient(rect: Rect, stops: &[Stop], x: &dyn Fn(f64) -> f32) -> Mesh {
    let mut mesh = Mesh::default();
    let mut column = |at: f32, colour: Color32| {
        let index = mesh.vertices.len() as u32;
        mesh.colored_vertex(pos2(at, rect.top()), colour);
        mesh.colored_vertex(pos2(at, rect.bottom()), colour);
        if index > 0 {
            mesh.add_triangle(index - 2, index - 1, index);
            mesh.add_triangle(index - 1, index, index + 1);
        }
    };
    let (first, last) = (stops[0], stops[stops.len() - 1]);
    column(rect.left(), colour(first));
    for stop in stops {
        column(x(stop.at).clamp(rect.left(), rect.right()), colour(*stop));
    }
    column(rect.right(), colour(last));
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_new_colour_lies_between_its_neighbours() {
        let stops = [Stop { at: 0.0, colour: Srgb([0, 100, 200]) }, Stop { at: 10.0, colour: Srgb([100, 100, 0]) }];
        assert_eq!(between(&stops, 5.0), Srgb([50, 100, 100]));
        assert_eq!(between(&stops, -5.0), Srgb([0, 100, 200]));
        assert_eq!(between(&stops, 50.0), Srgb([100, 100, 0]));
    }
}
