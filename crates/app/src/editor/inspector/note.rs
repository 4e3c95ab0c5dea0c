//! The note of a node: a text of several lines, applied when the field loses the focus.

use egui::{Id, Key, TextEdit, Ui, WidgetInfo};
use orograph_graph::Edit;

use crate::editor::Session;

/// A note that is being typed.
#[derive(Debug)]
pub(super) struct Draft {
    node: String,
    text: String,
}

impl Draft {
    /// Sets the note of the node, as one undo step.
    pub(super) fn take(self, session: &mut Session) {
        let Self { node, text } = self;
        let text = text.trim().to_owned();
        let before = session.document().node(&node).map(|entry| &entry.note);
        if before.is_some_and(|note| *note != text) {
            session.apply(&Edit::SetNote { node, note: text });
        }
    }
}

/// Shows the note of a node in a field that grows with it.
pub(super) fn show(ui: &mut Ui, draft: &mut Option<Draft>, session: &mut Session, (node, note): (&str, &str)) {
    let before = draft.as_ref().filter(|draft| draft.node == node).map_or(note, |draft| &draft.text);
    let mut text = before.to_owned();
    let edit = TextEdit::multiline(&mut text)
        .id(Id::new(("note of", node)))
        .desired_rows(1)
        .desired_width(ui.available_width() - 8.0)
        .hint_text("Note");
    let response = ui.add(edit);
    let enabled = ui.is_enabled();
    response.widget_info(|| WidgetInfo {
        label: Some("note".to_owned()),
        ..WidgetInfo::text_edit(enabled, before, &text, "Note")
    });
    if response.changed() {
        *draft = Some(Draft { node: node.to_owned(), text });
    }
    if response.lost_focus()
        && let Some(draft) = draft.take()
        && !ui.input(|input| input.key_pressed(Key::Escape))
    {
        draft.take(session);
    }
    response.on_hover_text("Shown below the node in the graph; leave the field to apply, press Escape to cancel");
}
