//! Rows of the inspector: a name on the left, a value on the right; the text being typed, and the reason if a value is
//! refused.

use egui::{
    Align, Id, Key, Label, Layout, Response, RichText, TextEdit, Ui,
    text::{CCursor, CCursorRange},
    vec2,
};

use orograph_graph::Unit;

use crate::editor::{Session, arithmetic::calculated, window::names::Named as _};
pub(super) use crate::report::reading::words;

/// The text being typed, the drag and the refusal in the inspector.
#[derive(Debug, Default)]
pub(super) struct FormState {
    typing: Option<Typing>,
    /// The row whose value was refused, and the reason.
    refused: Option<(Id, String)>,
    /// True while a value is being dragged.
    dragging: bool,
    /// Why the rows that follow have no effect.
    resting: Option<String>,
}

/// A text that is being typed.
#[derive(Debug)]
struct Typing {
    field: Id,
    text: String,
}

impl FormState {
    /// Discards the typed text, for example when another node is selected.
    pub(super) fn forget(&mut self) {
        (self.typing, self.refused) = (None, None);
    }

    /// Marks the rows that follow as having no effect, with the reason, or as normal again.
    pub(super) fn rest(&mut self, why: Option<String>) {
        self.resting = why;
    }

    /// Why the current row has no effect. Returns None when it has one.
    pub(super) fn resting(&self) -> Option<&str> {
        self.resting.as_deref()
    }

    /// Stores why the value of a row was refused, or that it was accepted.
    pub(super) fn judge(&mut self, line: Id, result: Result<(), String>) {
        match result {
            Ok(()) => self.forget(),
            Err(reason) => self.refused = Some((line, reason)),
        }
    }

    /// Marks the start of a drag: all of it is one undo step.
    pub(super) const fn drag(&mut self) {
        self.dragging = true;
    }

    /// Ends typing in a field, as if you had clicked elsewhere. Returns false if nothing is typed.
    pub(super) fn leave(&self, ui: &Ui) -> bool {
        let Some(typing) = &self.typing else { return false };
        let had = ui.memory(|memory| memory.has_focus(typing.field));
        ui.memory_mut(|memory| memory.surrender_focus(typing.field));
        had
    }

    /// Ends a drag once no button is pressed.
    pub(super) fn settle(&mut self, ui: &Ui, session: &mut Session) {
        if self.dragging && !ui.input(|input| input.pointer.any_down()) {
            self.dragging = false;
            session.end_gesture();
        }
    }

    /// A field for a quantity, as [`Self::entry`]; it also takes a calculation and returns its result. When it has no
    /// focus it shows the whole number and cuts the unit if there is no room; the tooltip has all of it.
    pub(super) fn quantity(&mut self, ui: &mut Ui, line: Id, unit: Unit, field: TextField<'_>) -> Option<String> {
        self.number(ui, line, field).map(|text| calculated(unit, &text))
    }

    fn number(&mut self, ui: &mut Ui, line: Id, field: TextField<'_>) -> Option<String> {
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
        let typed = self.entry(ui, line, TextField { text: &shown, hover: &hover, ..field });
        if ui.memory(|memory| memory.has_focus(id)) {
            // From now on it shows all of its text.
            select_all(ui, id, whole);
            ui.ctx().request_repaint();
        }
        typed
    }

    /// A field that shows a text, and returns the new text when typing ends (Enter, Tab or a click elsewhere); Escape
    /// cancels. `line` is its row, `label` its accessible label.
    pub(super) fn entry(&mut self, ui: &mut Ui, line: Id, field: TextField<'_>) -> Option<String> {
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
        let response = if field.name.is_empty() { response } else { response.named(field.name) };
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

    /// The reason below a row whose value was refused.
    pub(super) fn reason(&self, ui: &mut Ui, line: Id) {
        if let Some((_, reason)) = self.refused.as_ref().filter(|(refused, _)| *refused == line) {
            ui.add(Label::new(RichText::new(reason).small().color(ui.visuals().error_fg_color)).wrap());
        }
    }
}

/// A text field of [`FormState::entry`].
pub(super) struct TextField<'a> {
    /// Identifies the field within its row.
    pub(super) salt: &'a str,
    /// The text it shows.
    pub(super) text: &'a str,
    /// The hint while it is empty.
    pub(super) hint: &'a str,
    /// The tooltip.
    pub(super) hover: &'a str,
    /// Its width in points.
    pub(super) width: f32,
    /// The label that names it.
    pub(super) label: Option<Id>,
    /// Its own name for screen readers; empty if the label is enough.
    pub(super) name: &'a str,
}

/// The margins of a field on both sides, in points.
pub(super) const FRAME: f32 = 8.0;

/// A quantity cut to the width of a field: its number, and as much of its unit as fits.
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

/// The width of a text in a field, in points.
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

/// In an inspector narrower than this, a value is below its name.
const STACKED: f32 = 200.0;

/// One row: its name, then its widgets on the right. Also returns the response of the name.
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

/// The heading of a section.
pub(super) fn section(ui: &mut Ui, text: &str) {
    ui.add_space(4.0);
    ui.separator();
    ui.label(RichText::new(text).strong());
}
