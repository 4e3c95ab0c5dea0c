//! Lines of a form: a name on the left, a value on the right; what is being typed, and why a value was refused.

use egui::{
    Align, Id, Key, Label, Layout, Response, RichText, TextEdit, Ui,
    text::{CCursor, CCursorRange},
    vec2,
};

use crate::editor::Session;

/// What is being typed, dragged or refused in a form.
#[derive(Debug, Default)]
pub(super) struct Form {
    typing: Option<Typing>,
    /// The line whose value was refused, and why.
    refused: Option<(Id, String)>,
    /// Whether a value is being dragged.
    dragging: bool,
    /// Why what is shown now has no effect.
    resting: Option<String>,
}

/// A text that is being typed.
#[derive(Debug)]
struct Typing {
    field: Id,
    text: String,
}

impl Form {
    /// Forgets what was typed, as when another node is selected.
    pub(super) fn forget(&mut self) {
        (self.typing, self.refused) = (None, None);
    }

    /// Shows what follows as without effect, for a reason, or as usual.
    pub(super) fn rest(&mut self, why: Option<String>) {
        self.resting = why;
    }

    /// Why what is shown now has no effect.
    pub(super) fn resting(&self) -> Option<&str> {
        self.resting.as_deref()
    }

    /// Remembers why a line's value was refused, or that it was taken.
    pub(super) fn judge(&mut self, line: Id, result: Result<(), String>) {
        match result {
            Ok(()) => self.forget(),
            Err(reason) => self.refused = Some((line, reason)),
        }
    }

    /// Notes that a value is being dragged: all of it is one step of undo.
    pub(super) const fn drag(&mut self) {
        self.dragging = true;
    }

    /// Ends a drag once no button is held any more.
    pub(super) fn settle(&mut self, ui: &Ui, session: &mut Session) {
        if self.dragging && !ui.input(|input| input.pointer.any_down()) {
            self.dragging = false;
            session.end_gesture();
        }
    }

    /// A field for a quantity, as [`Self::entry`]: while nothing is typed its number is whole, and its unit is cut where there
    /// is no room for it; below the pointer it is whole.
    pub(super) fn quantity(&mut self, ui: &mut Ui, line: Id, field: Entry<'_>) -> Option<String> {
        let id = line.with(field.salt);
        let shown = match ui.memory(|memory| memory.has_focus(id))
            || self.typing.as_ref().is_some_and(|typing| typing.field == id)
        {
            true => field.text.to_owned(),
            false => fitted(ui, field.text, field.width),
        };
        if shown == field.text {
            return self.entry(ui, line, field);
        }
        let hover = format!("{}\n\n{}", field.text, field.hover);
        let whole = field.text;
        let typed = self.entry(ui, line, Entry { text: &shown, hover: &hover, ..field });
        if ui.memory(|memory| memory.has_focus(id)) {
            // From now on it shows all of its text.
            select_all(ui, id, whole);
            ui.ctx().request_repaint();
        }
        typed
    }

    /// A field that shows a text until something is typed, and gives that when it is done (Enter, Tab or a click
    /// elsewhere); Escape takes it back. `line` is where it stands, `label` what names it.
    pub(super) fn entry(&mut self, ui: &mut Ui, line: Id, field: Entry<'_>) -> Option<String> {
        let id = line.with(field.salt);
        let typed = self.typing.as_ref().filter(|typing| typing.field == id);
        let mut text = typed.map_or_else(|| field.text.to_owned(), |typing| typing.text.clone());
        let wrong = typed.is_some() && self.refused.as_ref().is_some_and(|(refused, _)| *refused == line);
        let edit = TextEdit::singleline(&mut text)
            .id(id)
            .desired_width(field.width)
            .hint_text(field.hint.to_owned())
            .text_color_opt(wrong.then(|| ui.visuals().error_fg_color));
        let response = edit.show(ui).response.response;
        let response = match field.label {
            Some(label) => response.labelled_by(label),
            None => response,
        };
        if response.gained_focus() {
            select_all(ui, id, &text);
        }
        if response.changed() {
            self.refused = None;
            self.typing = Some(Typing { field: id, text: text.clone() });
        }
        if response.lost_focus() {
            if ui.input(|input| input.key_pressed(Key::Escape)) {
                self.forget();
            } else if self.typing.as_ref().is_some_and(|typing| typing.field == id) {
                if text.trim() != field.text {
                    return Some(text.trim().to_owned());
                }
                self.forget();
            }
        }
        if !field.hover.is_empty() && self.resting.is_none() {
            response.on_hover_text(field.hover);
        }
        None
    }

    /// The reason below a line whose value was refused.
    pub(super) fn reason(&self, ui: &mut Ui, line: Id) {
        if let Some((_, reason)) = self.refused.as_ref().filter(|(refused, _)| *refused == line) {
            ui.add(Label::new(RichText::new(reason).small().color(ui.visuals().error_fg_color)).wrap());
        }
    }
}

/// A field of [`Form::entry`].
pub(super) struct Entry<'a> {
    /// Which field of its line it is.
    pub(super) salt: &'a str,
    /// What it shows.
    pub(super) text: &'a str,
    /// What it shows while it is empty.
    pub(super) hint: &'a str,
    /// What it tells below the pointer.
    pub(super) hover: &'a str,
    /// Its width in points.
    pub(super) width: f32,
    /// The label that names it.
    pub(super) label: Option<Id>,
}

/// The margins of a field on both sides, in points.
pub(super) const FRAME: f32 = 8.0;

/// A quantity as wide as a field: its number, and as much of its unit as there is room for.
fn fitted(ui: &Ui, text: &str, width: f32) -> String {
    let room = width - FRAME - 1.0;
    if wide(ui, text) <= room {
        return text.to_owned();
    }
    let number = text.split(' ').next().unwrap_or(text).len();
    let cuts = text.char_indices().map(|(at, _)| at).filter(|at| *at > number).rev();
    let shorter = cuts.map(|at| format!("{}…", text[..at].trim_end()));
    let found = shorter.into_iter().find(|text| wide(ui, text) <= room);
    found.unwrap_or_else(|| text[..number].to_owned())
}

/// How wide a text of a field is, in points.
pub(super) fn wide(ui: &Ui, text: &str) -> f32 {
    let font = egui::TextStyle::Body.resolve(ui.style());
    ui.painter().layout_no_wrap(text.to_owned(), font, ui.visuals().text_color()).size().x
}

fn select_all(ui: &Ui, id: Id, text: &str) {
    if let Some(mut state) = egui::text_edit::TextEditState::load(ui.ctx(), id) {
        let end = CCursor::new(text.chars().count());
        state.cursor.set_char_range(Some(CCursorRange::two(CCursor::default(), end)));
        state.store(ui.ctx(), id);
    }
}

/// A name for people: `uplift_course` is "uplift course".
pub(super) fn words(name: &str) -> String {
    name.replace('_', " ")
}

/// In a form narrower than this, a value stands below its name.
const STACKED: f32 = 200.0;

/// One line: its name, then what it has on the right. Gives the response of the name as well.
pub(super) fn line<R>(
    ui: &mut Ui,
    name: &str,
    changed: bool,
    content: impl FnOnce(&mut Ui, &Response) -> R,
) -> (R, Response) {
    let height = ui.spacing().interact_size.y;
    let width = (ui.available_width() * 0.36).clamp(60.0, 150.0);
    let shown = words(name);
    let text = if changed { RichText::new(shown).strong() } else { RichText::new(shown) };
    let name = Label::new(text).truncate().selectable(false).sense(egui::Sense::click());
    if ui.available_width() < STACKED {
        let label = ui.add(name);
        let content = ui.horizontal(|ui| content(ui, &label)).inner;
        return (content, label);
    }
    let inner = ui.horizontal(|ui| {
        let layout = Layout::left_to_right(Align::Center);
        let label = ui.allocate_ui_with_layout(vec2(width, height), layout, |ui| {
            ui.set_min_size(vec2(width, height));
            ui.add(name)
        });
        (content(ui, &label.inner), label.inner)
    });
    inner.inner
}

/// The heading of the pane.
pub(super) fn title(ui: &mut Ui, text: &str) {
    ui.add(Label::new(RichText::new(text).heading()).truncate());
}

/// The heading of a part of the form.
pub(super) fn section(ui: &mut Ui, text: &str) {
    ui.add_space(4.0);
    ui.separator();
    ui.label(RichText::new(text).strong());
}
