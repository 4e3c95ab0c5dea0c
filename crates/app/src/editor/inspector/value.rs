//! A widget for every kind of parameter.

use std::{
    hash::{BuildHasher as _, Hasher as _, RandomState},
    path::Path,
};

use egui::{Button, Checkbox, ComboBox, Id, Ui, WidgetInfo, WidgetType};
use orograph_graph::{Kind, ParamSpec, ParamValue, Unit, World};

use super::{
    column,
    form::{FormState, TextField, words},
    gradient, number, pad, waypoints,
};
use crate::{
    editor::{
        dialogs::system::{self, Ask},
        window::names::Named as _,
    },
    report::terminal::counted,
};

/// A change of a value.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum ValueChange {
    /// It is being dragged and has this value now.
    Drag(ParamValue),
    /// Set this value.
    Set(ParamValue),
    /// Set the typed text.
    Text(String),
    /// The typed text is invalid, for this reason.
    Wrong(String),
}

/// The row of a value and its context.
#[derive(Clone, Copy)]
pub(super) struct Place<'a> {
    /// The row.
    pub(super) line: Id,
    /// Its label.
    pub(super) label: Id,
    /// The text of the label.
    pub(super) name: &'a str,
    /// The world, in which positions lie.
    pub(super) world: World,
    /// The folder that files are relative to.
    pub(super) folder: &'a Path,
}

/// Returns true if a kind needs more room than there is beside its name.
pub(super) const fn is_tall(kind: &Kind) -> bool {
    matches!(
        kind,
        Kind::Curve { .. } | Kind::Path { .. } | Kind::Waypoints { .. } | Kind::Stops { .. } | Kind::Layers { .. }
    )
}

/// Shows a value, and returns the change that was made.
pub(super) fn show(
    ui: &mut Ui,
    form: &mut FormState,
    place: Place<'_>,
    spec: &ParamSpec,
    value: &ParamValue,
) -> Option<ValueChange> {
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
            response.changed().then_some(ValueChange::Set(ParamValue::Bool(now)))
        }
        (Kind::Choice { options, .. }, ParamValue::Choice(now)) => choice(ui, form, place, options, now),
        (Kind::Seed { .. }, ParamValue::Seed(now)) => seed(ui, form, place, *now),
        (Kind::Point { .. }, ParamValue::Point(now)) => {
            let typed = point(ui, form, place, spec.unit, *now, None)?;
            Some(typed.map_or_else(ValueChange::Wrong, |point| ValueChange::Set(ParamValue::Point(point))))
        }
        (Kind::Curve { steps, .. }, ParamValue::Curve(points)) => {
            let way = if *steps { pad::Way::Steps } else { pad::Way::Smooth };
            pad::curve(ui, form, place, (spec.unit, way), points)
        }
        (Kind::Path { .. }, ParamValue::Path(points)) => pad::path(ui, form, place, spec.unit, points),
        (Kind::Waypoints { .. }, ParamValue::Waypoints(points)) => waypoints::show(ui, form, place, spec.unit, points),
        (Kind::Stops { .. }, ParamValue::Stops(stops)) => gradient::show(ui, form, place, spec.unit, stops),
        (Kind::Layers { .. }, ParamValue::Layers(layers)) => column::show(ui, form, place, layers),
        (Kind::File, ParamValue::File(name)) => file(ui, form, place, name),
        (Kind::Strokes { .. }, ParamValue::Strokes(strokes)) => {
            ui.label(counted(strokes.len(), "stroke"));
            let clear = ui.add_enabled(!strokes.is_empty(), Button::new("✖").small());
            let clear = clear.named(format!("Clear {}", place.name)).on_hover_text("Remove all strokes");
            clear.clicked().then_some(ValueChange::Set(ParamValue::Strokes(Vec::new())))
        }
        _ => None,
    }
}

fn choice(
    ui: &mut Ui,
    form: &FormState,
    place: Place<'_>,
    options: &[(&'static str, &'static str)],
    now: &str,
) -> Option<ValueChange> {
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
    chosen.filter(|name| *name != now).map(|name| ValueChange::Set(ParamValue::Choice(name)))
}

fn seed(ui: &mut Ui, form: &mut FormState, place: Place<'_>, now: u32) -> Option<ValueChange> {
    let text = now.to_string();
    let width = (ui.available_width() - 34.0).max(40.0);
    let entry =
        TextField { salt: "seed", text: &text, hint: "", hover: "Integer", width, label: Some(place.label), name: "" };
    let typed = form.quantity(ui, place.line, Unit::Count, entry).map(ValueChange::Text);
    let dice = ui.button("🎲").named(format!("randomise {}", place.name)).on_hover_text("Randomise seed");
    if dice.clicked() { Some(ValueChange::Set(ParamValue::Seed(thrown(now)))) } else { typed }
}

/// Another seed of at most four digits.
pub(super) fn thrown(now: u32) -> u32 {
    let seed = (RandomState::new().build_hasher().finish() % 10_000) as u32;
    if seed == now { seed + 1 } else { seed }
}

/// Two fields for the coordinates of a point, which has a number among others; returns the new point, or why the input
/// is invalid.
pub(super) fn point(
    ui: &mut Ui,
    form: &mut FormState,
    place: Place<'_>,
    unit: Unit,
    now: [f64; 2],
    number: Option<usize>,
) -> Option<Result<[f64; 2], String>> {
    let width = ((ui.available_width() - ui.spacing().item_spacing.x) / 2.0).clamp(36.0, 110.0);
    let mut typed = None;
    for axis in 0..2 {
        let text = unit.display(now[axis]);
        let axis_name = ["x", "y"][axis];
        let salt = number.map_or_else(|| axis_name.to_owned(), |number| format!("{number}{axis_name}"));
        let name = match number {
            Some(number) => format!("{axis_name} of point {}", number + 1),
            None => format!("{axis_name} of {}", place.name),
        };
        let hover = number::hint(unit);
        let entry = TextField {
            salt: &salt,
            text: &text,
            hint: axis_name,
            hover: &hover,
            width,
            label: Some(place.label),
            name: &name,
        };
        if let Some(text) = form.quantity(ui, place.line, unit, entry) {
            typed = Some(unit.parse(&text).map_err(|error| error.to_string()).map(|part| {
                let mut point = now;
                point[axis] = part;
                point
            }));
        }
    }
    typed
}

fn file(ui: &mut Ui, form: &mut FormState, place: Place<'_>, name: &str) -> Option<ValueChange> {
    let width = (ui.available_width() - 62.0).max(40.0);
    let hover = "Relative to the folder of the graph file";
    let entry =
        TextField { salt: "file", text: name, hint: "no file", hover, width, label: Some(place.label), name: "" };
    let mut asked = form.entry(ui, place.line, entry).map(|text| ValueChange::Set(ParamValue::File(text)));
    ui.menu_button("⏷", |ui| {
        let near = files_near(place.folder);
        if near.is_empty() {
            ui.weak("No such files in the graph's folder");
        }
        for file in near {
            if ui.add(Button::selectable(file == name, file.as_str())).clicked() {
                asked = Some(ValueChange::Set(ParamValue::File(file)));
                ui.close();
            }
        }
    })
    .response
    .named(format!("list of files for {}", place.name))
    .on_hover_text("Files in the graph's folder");
    let browse = ui.button("📂").named(format!("browse for {}", place.name));
    if browse.on_hover_text("Choose a file").clicked() {
        system::ask(ui.ctx(), place.line, Ask::File, place.folder);
    }
    if let Some(path) = system::answer(ui.ctx(), place.line) {
        let inside = path.strip_prefix(place.folder.canonicalize().unwrap_or_else(|_| place.folder.to_owned()));
        let name = inside.map_or_else(|_| path.display().to_string(), |inside| inside.display().to_string());
        asked = Some(ValueChange::Set(ParamValue::File(name.replace('\\', "/"))));
    }
    asked
}

/// The usual values of a file parameter: graphs, rasters and drawings in a folder and in its direct subfolders, by name.
fn files_near(folder: &Path) -> Vec<String> {
    const MOST: usize = 40;
    let is_fit = |path: &Path| {
        let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
        ["tif", "tiff", "png", "exr", "r16", "r32", "raw", "asc", "hgt", "ron", "geojson", "svg"]
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
