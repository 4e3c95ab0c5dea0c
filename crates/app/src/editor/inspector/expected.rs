//! What the file expects of its terrain: measures with their bounds, where they are measured, and the figures.

use egui::{Button, Key, Label, RichText, TextEdit, Ui};
use orograph_graph::{Edit, Expectation, MeasureSpec, Unit};

use super::{
    form::{FormState, TextField, line, words},
    number,
};
use crate::{
    editor::{Session, window::names::Named as _},
    report::{expect::Figure, terminal::counted},
};

/// Measures that the list shows at once.
const SHOWN: usize = 60;
/// The numbers of the measured part.
const PART: [(&str, &str); 4] = [
    ("x", "From the world's west side"),
    ("y", "From the world's north side"),
    ("width", "Width"),
    ("height", "Height"),
];

/// Shows the expectations, and the search for another measure.
pub(super) fn show(ui: &mut Ui, form: &mut FormState, session: &mut Session) {
    let expected = session.document().expectations().cloned();
    let list = expected.as_ref().map_or(&[][..], |expected| &expected.list);
    if list.is_empty() {
        let text = "None yet. Add a measure with its bounds, and every run checks that the terrain keeps them.";
        ui.add(Label::new(RichText::new(text).weak()).wrap());
    }
    for one in list {
        bounds(ui, form, session, one);
    }
    add(ui, form, session, list);
    if let Some(expected) = expected {
        part(ui, form, session, expected.part_m);
        cell(ui, form, session, expected.cell_m);
    }
}

/// A measure with its lowest and highest figure.
fn bounds(ui: &mut Ui, form: &mut FormState, session: &mut Session, one: &Expectation) {
    let name = one.measure.name;
    let id = ui.make_persistent_id(("expected", name));
    let unit = Unit::of_symbol(one.measure.unit).unwrap_or(Unit::One);
    let figure = figure(session, one);
    let mut values = None;
    let (_, label) = line(ui, name, false, |ui, label| {
        ui.spacing_mut().item_spacing.x = 4.0;
        let width = ((ui.available_width() - 62.0) / 2.0).clamp(36.0, 84.0);
        let hover = format!("{}. Empty: no bound at this side", number::hint(unit));
        for (at, text) in one.typed().iter().enumerate() {
            let salt = ["lowest", "highest"][at];
            let whole = format!("{salt} {}", words(name));
            let entry =
                TextField { salt, text, hint: "any", hover: &hover, width, label: Some(label.id), name: &whole };
            if let Some(text) = form.quantity(ui, id, unit, entry) {
                let mut both = vec![None, None];
                both[at] = Some(text);
                values = Some(both);
            }
            if at == 0 {
                ui.label("to");
            }
        }
        let remove = ui.add(Button::new("✖").small().frame(false)).named(format!("remove {}", words(name)));
        if remove.on_hover_text("Expect nothing of this measure").clicked() {
            values = Some(Vec::new());
        }
        if let Some((figure, is_coarse)) = figure {
            let weak = ui.visuals().weak_text_color();
            let (mark, colour, said) = match figure.is_met() {
                true => ("✔", weak, format!("It is {}", one.display(figure.value))),
                // as in the Problems pane
                false if is_coarse => ("–", weak, format!("{}; it does not count at this cell size", figure.text())),
                false => ("⚠", ui.visuals().warn_fg_color, figure.text()),
            };
            ui.label(RichText::new(mark).color(colour)).on_hover_text(said);
        }
    });
    label.on_hover_text(about(one.measure));
    if let Some(values) = values {
        form.judge(id, session.attempt(&Edit::SetExpected { name: name.to_owned(), values }));
    }
    form.reason(ui, id);
}

/// The figure that was measured for an expectation, and whether the cells are larger than those that it is about.
fn figure(session: &Session, one: &Expectation) -> Option<(Figure, bool)> {
    let checked = session.checked()?.checked.as_ref().ok()?;
    let figure = checked.figures.iter().find(|figure| figure.expectation == *one)?;
    Some((figure.clone(), checked.is_coarse))
}

/// The name, the unit and the meaning of a measure.
fn about(measure: &MeasureSpec) -> String {
    let unit = if measure.unit.is_empty() { String::new() } else { format!(" ({})", measure.unit) };
    format!("{}{unit}\n\n{}", measure.name, measure.doc)
}

/// The measures whose name or meaning has all words of a search; those with the words in their names come first.
fn found<'a>(measures: impl Iterator<Item = &'a MeasureSpec>, query: &str) -> Vec<&'a MeasureSpec> {
    let query = query.to_lowercase();
    let words: Vec<&str> = query.split_whitespace().collect();
    let has = |text: &str| words.iter().all(|word| text.contains(word));
    let (mut first, mut others) = (Vec::new(), Vec::new());
    for measure in measures {
        let name = measure.name.replace('_', " ");
        if has(&name) || has(measure.name) {
            first.push(measure);
        } else if has(&format!("{name} {}", measure.doc.to_lowercase())) {
            others.push(measure);
        }
    }
    first.append(&mut others);
    first
}

/// The search for a measure to add.
fn add(ui: &mut Ui, form: &mut FormState, session: &mut Session, list: &[Expectation]) {
    let id = ui.make_persistent_id("new expectation");
    let mut chosen = None;
    let config =
        egui::containers::menu::MenuConfig::new().close_behavior(egui::PopupCloseBehavior::CloseOnClickOutside);
    egui::containers::menu::MenuButton::new("➕ expectation").config(config).ui(ui, |ui| {
        ui.set_min_width(280.0);
        let mut query: String = ui.data(|data| data.get_temp(id)).unwrap_or_default();
        let field = ui.add(TextEdit::singleline(&mut query).hint_text("Search measures").desired_width(f32::INFINITY));
        let field = field.named("search measures");
        if !field.has_focus() && !field.lost_focus() {
            field.request_focus();
        }
        let measures = session.document().registry().measures();
        let free = measures.filter(|measure| list.iter().all(|one| one.measure.name != measure.name));
        let found = found(free, &query);
        let is_entered = field.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
        if is_entered {
            chosen = found.first().map(|measure| measure.name);
        }
        egui::ScrollArea::vertical().max_height(300.0).show(ui, |ui| {
            for measure in found.iter().take(SHOWN) {
                let button = ui.add(Button::new(measure.name).frame(false).truncate());
                if button.on_hover_text(about(measure)).clicked() {
                    chosen = Some(measure.name);
                }
            }
            let more = found.len().saturating_sub(SHOWN);
            if found.is_empty() {
                ui.weak("No measure has these words");
            } else if more > 0 {
                ui.weak(format!("{} more; type to search", counted(more, "measure")));
            }
        });
        ui.data_mut(|data| data.insert_temp(id, if chosen.is_some() { String::new() } else { query }));
        if chosen.is_some() {
            ui.close();
        }
    });
    if let Some(name) = chosen {
        let values = vec![Some(String::new()), Some(String::new())];
        form.judge(id, session.attempt(&Edit::SetExpected { name: name.to_owned(), values }));
    }
    form.reason(ui, id);
}

/// The part of the world that is measured: x, y, width and height.
fn part(ui: &mut Ui, form: &mut FormState, session: &mut Session, now: Option<[f64; 4]>) {
    let [width, height] = session.document().world().size;
    let shown = now.unwrap_or([0.0, 0.0, width, height]);
    let mut values = None;
    let id = ui.make_persistent_id("expected part");
    for (row, name) in [(0, "part from"), (2, "part size")] {
        let (_, label) = line(ui, name, now.is_some(), |ui, label| {
            ui.spacing_mut().item_spacing.x = 4.0;
            let wide = ((ui.available_width() - 40.0) / 2.0).clamp(36.0, 84.0);
            for at in [row, row + 1] {
                let text = Unit::Metres.display(shown[at]);
                let (salt, what) = PART[at];
                let hover = format!("{what}. {}", number::hint(Unit::Metres));
                let entry = TextField {
                    salt,
                    text: &text,
                    hint: salt,
                    hover: &hover,
                    width: wide,
                    label: Some(label.id),
                    name: &format!("part {salt}"),
                };
                if let Some(typed) = form.quantity(ui, id, Unit::Metres, entry) {
                    let mut all = shown.map(|metres| now.is_none().then(|| Unit::Metres.display(metres)));
                    all[at] = Some(typed);
                    values = Some(all.to_vec());
                }
            }
            let whole = Button::new("✖").small().frame(false);
            if row == 2
                && now.is_some()
                && ui.add(whole).named("remove part").on_hover_text("Measure the whole world").clicked()
            {
                values = Some(Vec::new());
            }
        });
        label.on_hover_text("The part of the world that is measured; x and y are those of its north-west corner");
    }
    if let Some(values) = values {
        form.judge(id, session.attempt(&Edit::SetExpected { name: "in".to_owned(), values }));
    }
    form.reason(ui, id);
}

/// The cell size at which the terrain is measured; an empty field is that of the world.
fn cell(ui: &mut Ui, form: &mut FormState, session: &mut Session, now: Option<f64>) {
    let id = ui.make_persistent_id("expected cell");
    let (typed, label) = line(ui, "measured cells", now.is_some(), |ui, label| {
        let text = now.map_or_else(String::new, |cell| Unit::Metres.display(cell));
        let hover = number::hint(Unit::Metres);
        let hint = "of the world";
        let entry =
            TextField { salt: "cell", text: &text, hint, hover: &hover, width: 100.0, label: Some(label.id), name: "" };
        let typed = form.quantity(ui, id, Unit::Metres, entry);
        let remove = Button::new("✖").small().frame(false);
        let is_removed = now.is_some()
            && ui.add(remove).named("remove measured cells").on_hover_text("Measure the cells of the world").clicked();
        if is_removed { Some(String::new()) } else { typed }
    });
    let about = "Heights are averaged to cells of this size before they are measured, so that figures do not depend on the cells \
                 of the world";
    label.on_hover_text(about);
    if let Some(text) = typed {
        let values = if text.is_empty() { Vec::new() } else { vec![Some(text)] };
        form.judge(id, session.attempt(&Edit::SetExpected { name: "cell".to_owned(), values }));
    }
    form.reason(ui, id);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measures_are_found_by_the_words_of_their_names_first() {
        let registry = orograph_nodes::registry();
        let names = |query: &str| -> Vec<&str> {
            found(registry.measures(), query).into_iter().map(|measure| measure.name).collect()
        };
        assert_eq!(names("slope p50")[0], "slope.p50");
        assert!(names("hypsometric integral").contains(&"hypsometric_integral"));
        assert!(names("").len() > 60 && names("zebra").is_empty());
    }
}
