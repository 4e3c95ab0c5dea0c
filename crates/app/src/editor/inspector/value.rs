//! A widget for every kind of parameter.

use std::{
    hash::{BuildHasher as _, Hasher as _, RandomState},
    path::Path,
};

use egui::{Button, Checkbox, ComboBox, Id, Ui, WidgetInfo, WidgetType};
use orograph_graph::{Kind, ParamSpec, ParamValue, Unit, World};

use super::{
    form::{Entry, Form, words},
    gradient, number, pad,
};
use crate::editor::dialog::{self, Ask};

/// What a person does to a value.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Asked {
    /// It is being dragged and is this now.
    Drag(ParamValue),
    /// It is to be this.
    Set(ParamValue),
    /// It is to be what was typed.
    Text(String),
    /// What was typed is none, for this reason.
    Wrong(String),
}

/// A line on which a value stands, and what is around it.
#[derive(Clone, Copy)]
pub(super) struct Place<'a> {
    /// The line.
    pub(super) line: Id,
    /// Its label.
    pub(super) label: Id,
    /// The world, in which places lie.
    pub(super) world: World,
    /// The folder that files are relative to.
    pub(super) folder: &'a Path,
}

/// Whether a kind needs more room than is beside its name.
pub(super) const fn is_tall(kind: &Kind) -> bool {
    matches!(kind, Kind::Curve { .. } | Kind::Path { .. } | Kind::Stops { .. })
}

/// Shows a value, and gives what is done to it.
pub(super) fn show(
    ui: &mut Ui,
    form: &mut Form,
    place: Place<'_>,
    spec: &ParamSpec,
    value: &ParamValue,
) -> Option<Asked> {
    match (&spec.kind, value) {
        (Kind::Float { default, soft, .. }, ParamValue::Float(now)) => {
            let scale = number::Scale { soft: *soft, default: *default, whole: false };
            number::show(ui, form, place, spec.unit, scale, *now)
        }
        (Kind::Int { default, soft, .. }, ParamValue::Int(now)) => {
            let scale = number::Scale { soft: soft.map(|v| v as f64), default: *default as f64, whole: true };
            number::show(ui, form, place, spec.unit, scale, *now as f64)
        }
        (Kind::Bool { .. }, ParamValue::Bool(now)) => {
            let mut now = *now;
            let response = ui.add(Checkbox::without_text(&mut now));
            let (enabled, name) = (ui.is_enabled(), words(spec.name));
            response.widget_info(|| WidgetInfo::selected(WidgetType::Checkbox, enabled, now, &name));
            response.changed().then_some(Asked::Set(ParamValue::Bool(now)))
        }
        (Kind::Choice { options, .. }, ParamValue::Choice(now)) => choice(ui, form, place, options, now),
        (Kind::Seed { .. }, ParamValue::Seed(now)) => seed(ui, form, place, *now),
        (Kind::Point { .. }, ParamValue::Point(now)) => {
            let typed = point(ui, form, place, spec.unit, *now, "")?;
            Some(typed.map_or_else(Asked::Wrong, |point| Asked::Set(ParamValue::Point(point))))
        }
        (Kind::Curve { steps, .. }, ParamValue::Curve(points)) => {
            let way = if *steps { pad::Way::Steps } else { pad::Way::Smooth };
            pad::curve(ui, form, place, (spec.unit, way), points)
        }
        (Kind::Path { .. }, ParamValue::Path(points)) => pad::path(ui, form, place, spec.unit, points),
        (Kind::Stops { .. }, ParamValue::Stops(stops)) => gradient::show(ui, form, place, spec.unit, stops),
        (Kind::File, ParamValue::File(name)) => file(ui, form, place, name),
        (Kind::Strokes { .. }, ParamValue::Strokes(strokes)) => {
            ui.label(format!("{} strokes", strokes.len()));
            let clear = ui.add_enabled(!strokes.is_empty(), Button::new("Clear"));
            clear.clicked().then_some(Asked::Set(ParamValue::Strokes(Vec::new())))
        }
        _ => None,
    }
}

fn choice(
    ui: &mut Ui,
    form: &Form,
    place: Place<'_>,
    options: &[(&'static str, &'static str)],
    now: &str,
) -> Option<Asked> {
    let mut chosen = None;
    let combo = ComboBox::from_id_salt(place.line).selected_text(now).width(ui.available_width().max(40.0)).truncate();
    let shown = combo.show_ui(ui, |ui| {
        for (name, doc) in options {
            if ui.selectable_label(*name == now, *name).on_hover_text(*doc).clicked() {
                chosen = Some(*name);
            }
        }
    });
    let response = shown.response.labelled_by(place.label);
    if let Some((_, doc)) = options.iter().find(|(name, _)| *name == now && form.resting().is_none()) {
        response.on_hover_text(*doc);
    }
    chosen.filter(|name| *name != now).map(|name| Asked::Set(ParamValue::Choice(name)))
}

fn seed(ui: &mut Ui, form: &mut Form, place: Place<'_>, now: u32) -> Option<Asked> {
    let text = now.to_string();
    let width = (ui.available_width() - 34.0).max(40.0);
    let entry = Entry { salt: "seed", text: &text, hint: "", hover: "A whole number", width, label: Some(place.label) };
    let typed = form.entry(ui, place.line, entry).map(Asked::Text);
    let dice = ui.button("🎲").on_hover_text("Throw the dice");
    if dice.clicked() { Some(Asked::Set(ParamValue::Seed(thrown(now)))) } else { typed }
}

/// Another seed of at most four digits.
pub(super) fn thrown(now: u32) -> u32 {
    let seed = (RandomState::new().build_hasher().finish() % 10_000) as u32;
    if seed == now { seed + 1 } else { seed }
}

/// Two fields for the parts of a point; gives the point when one was typed, or why it is none.
pub(super) fn point(
    ui: &mut Ui,
    form: &mut Form,
    place: Place<'_>,
    unit: Unit,
    now: [f64; 2],
    salt: &str,
) -> Option<Result<[f64; 2], String>> {
    let width = ((ui.available_width() - ui.spacing().item_spacing.x) / 2.0).clamp(36.0, 110.0);
    let mut typed = None;
    for axis in 0..2 {
        let text = unit.display(now[axis]);
        let salt = format!("{salt}{}", ["x", "y"][axis]);
        let hover = number::hint(unit);
        let entry =
            Entry { salt: &salt, text: &text, hint: ["x", "y"][axis], hover: &hover, width, label: Some(place.label) };
        if let Some(text) = form.quantity(ui, place.line, entry) {
            typed = Some(unit.parse(&text).map_err(|error| error.to_string()).map(|part| {
                let mut point = now;
                point[axis] = part;
                point
            }));
        }
    }
    typed
}

fn file(ui: &mut Ui, form: &mut Form, place: Place<'_>, name: &str) -> Option<Asked> {
    let width = (ui.available_width() - 62.0).max(40.0);
    let hover = "Relative to the folder of the graph file";
    let entry = Entry { salt: "file", text: name, hint: "no file", hover, width, label: Some(place.label) };
    let mut asked = form.entry(ui, place.line, entry).map(|text| Asked::Set(ParamValue::File(text)));
    ui.menu_button("⏷", |ui| {
        let near = files_near(place.folder);
        if near.is_empty() {
            ui.weak("No rasters in the graph's folder");
        }
        for file in near {
            if ui.add(Button::selectable(file == name, file.as_str())).clicked() {
                asked = Some(Asked::Set(ParamValue::File(file)));
                ui.close();
            }
        }
    })
    .response
    .on_hover_text("Files in the graph's folder");
    if ui.button("📂").on_hover_text("Choose a file").clicked() {
        dialog::ask(ui.ctx(), place.line, Ask::File, place.folder);
    }
    if let Some(path) = dialog::answer(ui.ctx(), place.line) {
        let inside = path.strip_prefix(place.folder.canonicalize().unwrap_or_else(|_| place.folder.to_owned()));
        let name = inside.map_or_else(|_| path.display().to_string(), |inside| inside.display().to_string());
        asked = Some(Asked::Set(ParamValue::File(name.replace('\\', "/"))));
    }
    asked
}

/// What a file parameter usually names: graphs and rasters in a folder and in the folders in it, by name.
fn files_near(folder: &Path) -> Vec<String> {
    const MOST: usize = 40;
    let is_fit = |path: &Path| {
        let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
        ["tif", "tiff", "png", "exr", "r16", "r32", "raw", "asc", "hgt", "ron"]
            .contains(&extension.to_lowercase().as_str())
    };
    let list = |folder: &Path| -> Vec<std::path::PathBuf> {
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        entries.map(|entry| entry.path()).collect()
    };
    let here = list(folder);
    let below = here.iter().filter(|path| path.is_dir()).flat_map(|folder| list(folder));
    let mut names: Vec<String> = here
        .iter()
        .cloned()
        .chain(below)
        .filter(|path| is_fit(path) && path.is_file())
        .filter_map(|path| Some(path.strip_prefix(folder).ok()?.to_str()?.replace('\\', "/")))
        .collect();
    names.sort();
    names.truncate(MOST);
    names
}
