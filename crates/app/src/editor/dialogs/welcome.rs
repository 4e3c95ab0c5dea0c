//! The welcome page: three starting points, recent files, and the examples as pictures.

use std::path::PathBuf;

use egui::{Button, Context, Id, Label, RichText, Ui, vec2};

use super::gallery::{self, Cards};
use crate::editor::{
    FileCommand, Journals,
    window::{menu::file_name, state, theme},
};

/// The stored text that switches the page off at the start.
const NAME: &str = "welcome";
const OFF: &str = "off";

/// The number of recent files that are listed.
const RECENT: usize = 6;

/// Starting points: title, description, and the example that opens; none for an empty graph.
const STARTS: [(&str, &str, Option<&str>); 3] = [
    ("Empty graph", "Add nodes yourself", None),
    ("Mountains", "A range that rises while rivers cut it", Some("hello")),
    ("Islands", "Islands in a sea, with colours", Some("isles")),
];

/// The welcome page.
#[derive(Default)]
pub(crate) struct Welcome {
    cards: Cards,
    /// The recent files with unsaved work of an earlier session; known once the page has been shown.
    unsaved: Option<Vec<PathBuf>>,
}

impl Welcome {
    /// Returns true unless you have switched it off.
    pub(crate) fn is_wanted() -> bool {
        state::read(NAME).is_none_or(|text| text.trim() != OFF)
    }

    /// Shows the page above everything. Returns None until it is closed; then the inner value is what to open, or None.
    pub(crate) fn ui(&mut self, context: &Context, recent: &[PathBuf]) -> Option<Option<FileCommand>> {
        let mut chosen = None;
        let modal = theme::modal(context, Id::new("welcome")).show(context, |ui| {
            let room = ui.ctx().content_rect().size();
            let columns = ((room.x - 80.0) / 144.0).floor().clamp(1.0, 5.0);
            ui.set_width(Cards::width(columns));
            ui.heading("Welcome to Orograph");
            chosen = starts(ui);
            if !recent.is_empty() {
                ui.add_space(6.0);
                ui.strong("Recent files");
                let unsaved = self.unsaved.get_or_insert_with(|| {
                    let journals = Journals::of_system();
                    recent.iter().take(RECENT).filter(|path| journals.has_work(path)).cloned().collect()
                });
                chosen = recent_files(ui, recent, unsaved).or(chosen.take());
            }
            ui.add_space(6.0);
            ui.strong("Examples");
            let height = (room.y - 290.0).max(90.0);
            chosen = self.cards.ui(ui, columns, height).or(chosen.take());
            ui.add_space(6.0);
            ui.horizontal(|ui| {
                if ui.button("Close").clicked() {
                    ui.close();
                }
                let mut shown = Self::is_wanted();
                if ui.checkbox(&mut shown, "Show at the start").changed() {
                    state::write(NAME, if shown { "on" } else { OFF });
                }
            });
        });
        if chosen.is_some() {
            return Some(chosen);
        }
        modal.should_close().then_some(None)
    }
}

/// The starting points.
fn starts(ui: &mut Ui) -> Option<FileCommand> {
    let mut chosen = None;
    ui.horizontal_wrapped(|ui| {
        for (title, what, example) in STARTS {
            let button = ui.add(Button::new(RichText::new(title).strong()).min_size(vec2(132.0, 30.0)));
            if button.on_hover_text(what).clicked() {
                chosen = match example {
                    None => Some(FileCommand::New),
                    Some(name) => gallery::opened(name),
                };
            }
        }
    });
    chosen
}

/// The files that were opened or saved last; those with work to recover are marked.
fn recent_files(ui: &mut Ui, recent: &[PathBuf], unsaved: &[PathBuf]) -> Option<FileCommand> {
    let mut chosen = None;
    for path in recent.iter().take(RECENT) {
        ui.horizontal(|ui| {
            if ui.link(file_name(path)).on_hover_text(path.display().to_string()).clicked() {
                chosen = Some(FileCommand::Open(path.clone()));
            }
            if unsaved.contains(path) {
                let mark = RichText::new("unsaved work to recover").small().color(ui.visuals().warn_fg_color);
                ui.label(mark);
            }
            let folder = path.parent().map(|folder| folder.display().to_string()).unwrap_or_default();
            ui.add(Label::new(RichText::new(folder).weak().small()).truncate());
        });
    }
    chosen
}
