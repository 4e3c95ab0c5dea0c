//! Where on Earth the world lies: its coordinate system, and the easting and northing of its north-west corner.

use egui::{Button, Ui};
use orograph_graph::{Edit, GeoPlace, Unit, World};

use super::{
    form::{FormState, TextField, line},
    number,
};
use crate::editor::{Session, window::names::Named as _};

/// Shows the place; an empty field is a world that is nowhere on Earth.
pub(super) fn show(ui: &mut Ui, form: &mut FormState, session: &mut Session, now: World) {
    let id = ui.make_persistent_id("epsg");
    let (typed, label) = line(ui, "EPSG code", false, |ui, label| {
        let text = now.place.map_or_else(String::new, |place| place.epsg.to_string());
        let hover = "Code of a projected coordinate system in metres, such as 32611 for UTM zone 11 north";
        let entry =
            TextField { salt: "code", text: &text, hint: "none", hover, width: 90.0, label: Some(label.id), name: "" };
        let typed = form.quantity(ui, id, Unit::Count, entry);
        let remove = Button::new("✖").small().frame(false);
        let removed =
            now.place.is_some() && ui.add(remove).named("remove EPSG code").on_hover_text("Nowhere on Earth").clicked();
        if removed { Some(String::new()) } else { typed }
    });
    label
        .on_hover_text("Files leave with coordinates in this system; leave empty for a world that is nowhere on Earth");
    if let Some(text) = typed {
        let corner_m = now.place.map_or([0.0; 2], |place| place.corner_m);
        let place = match text.trim() {
            "" => Ok(None),
            text => text
                .parse()
                .map(|epsg| Some(GeoPlace { epsg, corner_m }))
                .map_err(|_| format!("`{text}` is not an EPSG code, such as 32611")),
        };
        form.judge(id, place.and_then(|place| session.attempt(&Edit::SetWorld(World { place, ..now }))));
    }
    form.reason(ui, id);
    let Some(place) = now.place else { return };
    for (axis, name) in ["easting", "northing"].into_iter().enumerate() {
        let id = ui.make_persistent_id(name);
        let (typed, label) = line(ui, name, false, |ui, label| {
            // every digit counts, so that the number is not rounded to a readable scale
            let text = format!("{} m", place.corner_m[axis]);
            let hover = number::hint(Unit::Metres);
            let label = Some(label.id);
            form.quantity(
                ui,
                id,
                Unit::Metres,
                TextField { salt: "m", text: &text, hint: "", hover: &hover, width: 110.0, label, name: "" },
            )
        });
        label.on_hover_text("Of the north-west corner of the world");
        if let Some(text) = typed {
            let made = Unit::Metres.parse(&text).map_err(|error| error.to_string()).and_then(|metres| {
                let mut place = place;
                place.corner_m[axis] = metres;
                session.attempt(&Edit::SetWorld(World { place: Some(place), ..now }))
            });
            form.judge(id, made);
        }
        form.reason(ui, id);
    }
}
