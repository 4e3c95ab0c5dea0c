//! Questions that you must answer before you can continue, and closing the window.

use std::{
    path::{Path, PathBuf},
    time::SystemTime,
};

use egui::{Button, Context, Id, RichText, ScrollArea, TextEdit, Ui, ViewportCommand};

use super::system::{self, Ask};
use crate::editor::{
    Session,
    session::{Answer, FileCommand, Lost, Question},
    window::{names::Named as _, theme},
};

/// Maximum width of a question, in points.
const WIDTH: f32 = 460.0;

/// The dialog of questions.
#[derive(Debug, Default)]
pub(crate) struct Questions {
    /// The file name being typed.
    typed: String,
    /// The current title of the window.
    title: String,
    /// The question of the last frame.
    asked: Option<Question>,
}

impl Questions {
    /// Shows the open question, and closes the window when the session is over.
    pub(crate) fn ui(&mut self, context: &Context, session: &mut Session) {
        self.name_window(context, session);
        if context.input(|input| input.viewport().close_requested()) && !session.is_over() {
            if session.question().is_none() {
                session.request(FileCommand::Close);
            }
            if !session.is_over() {
                context.send_viewport_cmd(ViewportCommand::CancelClose);
            }
        } else if session.is_over() {
            context.send_viewport_cmd(ViewportCommand::Close);
        }
        let Some(question) = session.question().cloned() else {
            self.typed.clear();
            self.asked = None;
            return;
        };
        // The first button has the focus, so that Enter chooses the recommended answer.
        let new = self.asked.as_ref() != Some(&question);
        self.asked = Some(question.clone());
        let mut answer = None;
        let modal = theme::modal(context, Id::new("question")).show(context, |ui| {
            ui.set_max_width(WIDTH.min(context.content_rect().width() - 32.0));
            match &question {
                Question::Unsaved(command) => unsaved(ui, session, command, new, &mut answer),
                Question::Exporting => exporting(ui, new, &mut answer),
                Question::Name => self.name(ui, session, new, &mut answer),
                Question::Changed { conflicts, .. } => changed(ui, session, conflicts, new, &mut answer),
                Question::Found(lost) => found(ui, session, lost, new, &mut answer),
            }
        });
        if answer.is_none() && modal.should_close() {
            answer = Some(Answer::Cancel);
        }
        match answer {
            // Saving under another name asks for the name next.
            Some(Answer::SaveAs(path)) if path.as_os_str().is_empty() => {
                session.answer(Answer::Cancel);
                session.ask_name();
            }
            Some(answer) => session.answer(answer),
            None => {}
        }
    }

    /// Shows the open file, and whether it is saved, in the window's title.
    fn name_window(&mut self, context: &Context, session: &Session) {
        let mark = if session.is_dirty() { "\u{2022} " } else { "" };
        let title = format!("{mark}{} \u{2013} Orograph", session.title());
        if title != self.title {
            context.send_viewport_cmd(ViewportCommand::Title(title.clone()));
            self.title = title;
        }
    }

    fn name(&mut self, ui: &mut Ui, session: &Session, new: bool, answer: &mut Option<Answer>) {
        let id = Id::new("name of a graph");
        if self.typed.is_empty() {
            let folder = home(session);
            let name = session.example().unwrap_or("untitled");
            self.typed = folder.join(format!("{name}.ron")).display().to_string();
        }
        if let Some(path) = system::answer(ui.ctx(), id) {
            // as if it had been typed: the dialog knows neither the ending nor whether a file is replaced
            self.typed = path.display().to_string();
        }
        ui.heading("Save the graph as");
        ui.add_space(4.0);
        let typed = ui.add(TextEdit::singleline(&mut self.typed).desired_width(f32::INFINITY).hint_text("NAME.ron"));
        let typed = typed.named("path");
        if new {
            typed.request_focus();
        }
        let path = PathBuf::from(self.typed.trim());
        let with_ending = if path.extension().is_some() { path.clone() } else { path.with_extension("ron") };
        let replaces = with_ending.is_file() && session.path() != Some(with_ending.as_path());
        if replaces {
            let text = RichText::new("There is such a file already. Replacing it cannot be undone.");
            ui.label(text.color(ui.visuals().warn_fg_color));
        }
        let entered = typed.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
        buttons(ui, |ui| {
            let text = if replaces { "Replace" } else { "Save" };
            let save = ui.add_enabled(!self.typed.trim().is_empty(), Button::new(text));
            // another file is replaced only by its button
            if entered && replaces {
                save.request_focus();
            }
            if (save.clicked() || entered && !replaces) && answer.is_none() {
                *answer = Some(Answer::SaveAs(path));
            }
            if ui.button("Browse\u{2026}").clicked() {
                system::ask(ui.ctx(), id, Ask::NewGraph, &home(session));
            }
            if ui.button("Cancel").clicked() {
                *answer = Some(Answer::Cancel);
            }
        });
    }
}

/// The folder for saving: that of the graph's file, or the current folder for a graph without one. The files of an
/// example or an archive are elsewhere and are copied when the graph is saved.
fn home(session: &Session) -> PathBuf {
    let beside = session.path().and_then(Path::parent).filter(|folder| !folder.as_os_str().is_empty());
    let folder = beside.map(Path::to_owned).or_else(|| std::env::current_dir().ok());
    let folder = folder.unwrap_or_else(|| PathBuf::from("."));
    folder.canonicalize().unwrap_or(folder)
}

fn buttons(ui: &mut Ui, add: impl FnOnce(&mut Ui)) {
    ui.add_space(8.0);
    ui.horizontal_wrapped(add);
}

/// The button of the recommended answer.
fn first(ui: &mut Ui, new: bool, text: &str) -> egui::Response {
    let button = ui.button(text);
    if new {
        button.request_focus();
    }
    button
}

fn unsaved(ui: &mut Ui, session: &Session, command: &FileCommand, new: bool, answer: &mut Option<Answer>) {
    ui.heading(format!("Save the changes to {}?", session.title()));
    ui.label(match command {
        FileCommand::New => "A new graph will replace it.",
        FileCommand::Open(_) => "Another graph will replace it.",
        FileCommand::Copy { .. } => "A copy of an example will replace it.",
        FileCommand::Close => "The window is about to close.",
    });
    buttons(ui, |ui| {
        if first(ui, new, "Save").clicked() {
            *answer = Some(Answer::Save);
        }
        if ui.button("Discard").clicked() {
            *answer = Some(Answer::Discard);
        }
        if ui.button("Cancel").clicked() {
            *answer = Some(Answer::Cancel);
        }
    });
}

fn exporting(ui: &mut Ui, new: bool, answer: &mut Option<Answer>) {
    ui.heading("Cancel the exports?");
    ui.label("Closing the window cancels the running export and those that wait.");
    buttons(ui, |ui| {
        if first(ui, new, "Keep exporting").clicked() {
            *answer = Some(Answer::Cancel);
        }
        if ui.button("Cancel them and close").clicked() {
            *answer = Some(Answer::Discard);
        }
    });
}

fn changed(ui: &mut Ui, session: &Session, conflicts: &[String], new: bool, answer: &mut Option<Answer>) {
    ui.heading(format!("{} changed on disk", session.title()));
    ui.label("You changed the same values here:");
    lines(ui, conflicts);
    buttons(ui, |ui| {
        if first(ui, new, "Keep mine").on_hover_text("Saving will overwrite the changes on disk").clicked() {
            *answer = Some(Answer::KeepMine);
        }
        if ui.button("Take theirs").on_hover_text("Undo brings your work back").clicked() {
            *answer = Some(Answer::TakeTheirs);
        }
        if ui.button("Save mine as\u{2026}").clicked() {
            *answer = Some(Answer::SaveAs(PathBuf::new()));
        }
        if ui.button("Later").clicked() {
            *answer = Some(Answer::Cancel);
        }
    });
}

fn found(ui: &mut Ui, session: &Session, lost: &Lost, new: bool, answer: &mut Option<Answer>) {
    ui.heading(format!("Work on {} was not saved", session.title()));
    let steps = if lost.steps == 1 { "one step".to_owned() } else { format!("{} steps", lost.steps) };
    ui.label(format!("Last edited {}; you can undo {steps}.", ago(lost.when)));
    let warn = |ui: &mut Ui, text: &str| ui.label(RichText::new(text).color(ui.visuals().warn_fg_color));
    if lost.changed_since {
        warn(ui, "The file has changed since. Recovering will merge both versions; you will be asked about conflicts.");
    }
    if lost.torn {
        warn(ui, "The end of the journal is damaged; the last edits may be missing.");
    }
    ui.collapsing(format!("Differences ({})", lost.differences.len()), |ui| lines(ui, &lost.differences));
    buttons(ui, |ui| {
        if first(ui, new, "Recover").clicked() {
            *answer = Some(Answer::Recover);
        }
        if ui.button("Discard").clicked() {
            *answer = Some(Answer::Discard);
        }
        if ui.button("Later").on_hover_text("You will be asked again at the next start").clicked() {
            *answer = Some(Answer::Cancel);
        }
    });
}

fn lines(ui: &mut Ui, lines: &[String]) {
    ScrollArea::vertical().max_height(220.0).show(ui, |ui| {
        for line in lines {
            ui.label(RichText::new(line).monospace());
        }
    });
}

/// How long ago something was, as text.
fn ago(when: SystemTime) -> String {
    let seconds = when.elapsed().unwrap_or_default().as_secs();
    let count = |number: u64, unit: &str| match number {
        1 => format!("one {unit} ago"),
        number => format!("{number} {unit}s ago"),
    };
    match seconds {
        0..60 => "less than a minute ago".to_owned(),
        60..3600 => count(seconds / 60, "minute"),
        3600..86_400 => count(seconds / 3600, "hour"),
        _ => count(seconds / 86_400, "day"),
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn times_are_shown_as_text() {
        let before = |seconds| ago(SystemTime::now() - Duration::from_secs(seconds));
        assert_eq!(before(3), "less than a minute ago");
        assert_eq!(before(61), "one minute ago");
        assert_eq!(before(7300), "2 hours ago");
        assert_eq!(before(3 * 86_400), "3 days ago");
        assert_eq!(ago(SystemTime::now() + Duration::from_secs(500)), "less than a minute ago");
    }
}
