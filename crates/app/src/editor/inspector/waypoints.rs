//! The points of a path with their heights and widths: a map of them, and a table.

use egui::Ui;
use orograph_graph::{ParamValue, Unit, Waypoint};

use super::{
    form::{FormState, TextField},
    pad,
    value::{Place, ValueChange, point},
};
use crate::editor::{arithmetic::calculated, window::names::Named as _};

/// Height of the table in points of the screen.
const TABLE: f32 = 240.0;

/// Shows a path, and returns the change that was made.
pub(super) fn show(
    ui: &mut Ui,
    form: &mut FormState,
    place: Place<'_>,
    unit: Unit,
    points: &[Waypoint],
) -> Option<ValueChange> {
    let places: Vec<[f64; 2]> = points.iter().map(|point| point.at).collect();
    if let Some(moved) = pad::world(ui, place, unit, &places) {
        return Some(moved.map_or_else(ValueChange::Wrong, |(places, drag)| {
            let value = ParamValue::Waypoints(carried(points, &places));
            if drag { ValueChange::Drag(value) } else { ValueChange::Set(value) }
        }));
    }
    table(ui, form, place, unit, points).map(|changed| {
        changed.map_or_else(ValueChange::Wrong, |points| ValueChange::Set(ParamValue::Waypoints(points)))
    })
}

/// The points at new positions, of which at most one is new, missing or moved; the others keep their numbers.
fn carried(points: &[Waypoint], places: &[[f64; 2]]) -> Vec<Waypoint> {
    let same = points.iter().zip(places).take_while(|(point, place)| point.at == **place).count();
    let mut kept = points.to_vec();
    match places.len().cmp(&points.len()) {
        std::cmp::Ordering::Greater => kept.insert(same, Waypoint::default()),
        std::cmp::Ordering::Less => _ = kept.remove(same),
        std::cmp::Ordering::Equal => {}
    }
    kept.iter().zip(places).map(|(point, place)| Waypoint { at: *place, ..*point }).collect()
}

/// The numbers of the points.
fn table(
    ui: &mut Ui,
    form: &mut FormState,
    place: Place<'_>,
    unit: Unit,
    points: &[Waypoint],
) -> Option<Result<Vec<Waypoint>, String>> {
    let mut changed = None;
    egui::CollapsingHeader::new(format!("{} points", points.len())).id_salt(place.line.with("points")).show(ui, |ui| {
        ui.weak("x, y, height, width; empty: as the points around it");
        let row = ui.spacing().interact_size.y;
        let area = egui::ScrollArea::vertical().id_salt(place.line.with("table")).max_height(TABLE);
        area.auto_shrink([false, true]).show_rows(ui, row, points.len(), |ui, rows| {
            for at in rows {
                if let Some(new) = self::row(ui, form, place, unit, (at, points)) {
                    changed = Some(new);
                }
            }
        });
    });
    changed
}

/// A row of the table.
fn row(
    ui: &mut Ui,
    form: &mut FormState,
    place: Place<'_>,
    unit: Unit,
    (at, points): (usize, &[Waypoint]),
) -> Option<Result<Vec<Waypoint>, String>> {
    let now = points[at];
    let with = |point: Waypoint| {
        let mut points = points.to_vec();
        points[at] = point;
        points
    };
    let mut changed = None;
    ui.horizontal(|ui| {
        let remove = ui.add_enabled(points.len() > 2, egui::Button::new("✖").small().frame(false));
        let remove = remove.named(format!("remove point {}", at + 1));
        if remove.on_hover_text("Remove the point").clicked() {
            let mut fewer = points.to_vec();
            fewer.remove(at);
            changed = Some(Ok(fewer));
        }
        let room = ui.available_width();
        ui.scope(|ui| {
            ui.set_max_width(0.52 * room);
            if let Some(typed) = point(ui, form, place, unit, now.at, Some(at)) {
                changed = Some(typed.map(|at| with(Waypoint { at, ..now })));
            }
        });
        let width = ((ui.available_width() - 2.0 * ui.spacing().item_spacing.x) / 2.0).clamp(30.0, 80.0);
        for (name, value) in [("height", now.height), ("width", now.width)] {
            let text = value.map_or_else(String::new, |value| Unit::Metres.display(value));
            let (salt, whole) = (format!("{at}{name}"), format!("{name} of point {}", at + 1));
            let entry = TextField {
                salt: &salt,
                text: &text,
                hint: name,
                hover: name,
                width,
                label: Some(place.label),
                name: &whole,
            };
            let Some(typed) = form.entry(ui, place.line, entry) else { continue };
            let number = match typed.as_str() {
                "" => Ok(None),
                typed => Unit::Metres.parse(&calculated(Unit::Metres, typed)).map(Some),
            };
            changed = Some(number.map_err(|error| error.to_string()).map(|number| {
                with(if name == "height" {
                    Waypoint { height: number, ..now }
                } else {
                    Waypoint { width: number, ..now }
                })
            }));
        }
    });
    changed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stay_with_their_points() {
        let point = |x: f64, width| Waypoint { width: Some(width), ..Waypoint::new([x, 0.0]) };
        let points = [point(0.0, 1.0), point(1.0, 2.0), point(2.0, 3.0)];
        let widths = |places: &[f64]| -> Vec<Option<f64>> {
            let places: Vec<[f64; 2]> = places.iter().map(|x| [*x, 0.0]).collect();
            carried(&points, &places).iter().map(|point| point.width).collect()
        };
        assert_eq!(widths(&[0.0, 5.0, 2.0]), [Some(1.0), Some(2.0), Some(3.0)]);
        assert_eq!(widths(&[0.0, 0.5, 1.0, 2.0]), [Some(1.0), None, Some(2.0), Some(3.0)]);
        assert_eq!(widths(&[0.0, 2.0]), [Some(1.0), Some(3.0)]);
        assert_eq!(widths(&[0.0, 1.0, 2.0, 3.0]), [Some(1.0), Some(2.0), Some(3.0), None]);
    }
}
