//! The result of a build: its files with their import settings, or why it failed.

use std::{
    path::Path,
    process::{Command, Stdio},
};

use egui::{Label, RichText, Ui};
use orograph_graph::bytes;

use crate::{
    build::Built,
    export::outputs::Import,
    report::{failure::Failure, progress::seconds, terminal::counted},
};

/// The number of files that were written, and the time.
pub(super) fn headline(built: &Built) -> String {
    let described = match described(built) {
        0 => String::new(),
        number => format!(", {number} of them JSON descriptions,"),
    };
    format!("Wrote {}{described} in {}", count(built), seconds(built.time))
}

/// The number of files that were written, with the JSON files that describe others.
pub(super) fn count(built: &Built) -> String {
    counted(built.files.len() + described(built), "file")
}

/// The number of files that a JSON file describes.
fn described(built: &Built) -> usize {
    built.files.iter().filter(|file| file.is_described).count()
}

/// The written files, their import settings, and a button to open the folder.
pub(super) fn done(ui: &mut Ui, built: &Built, folder: &Path) {
    ui.horizontal(|ui| {
        ui.label(RichText::new(headline(built)).strong());
        if ui.button("Open folder").clicked() {
            open_folder(folder);
        }
    });
    if let Some(missed) = built.expected.missed() {
        ui.add(Label::new(RichText::new(missed).color(ui.visuals().warn_fg_color)).wrap());
    }
    egui::Grid::new("files").num_columns(4).spacing([12.0, 2.0]).show(ui, |ui| {
        for file in &built.files {
            let name = file.path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
            ui.label(name).on_hover_text(file.path.display().to_string());
            ui.weak(file.what);
            ui.weak(bytes(file.bytes));
            if file.is_described {
                ui.weak("+ .json").on_hover_text("A JSON file beside it describes it");
            }
            ui.end_row();
        }
    });
    for (file, import, lines) in Import::of(&built.files) {
        ui.add_space(4.0);
        let name = file.path.file_name().map(|name| name.to_string_lossy()).unwrap_or_default();
        ui.strong(format!("{name} in {}", import.engine.title()));
        egui::Grid::new(("import", &file.path)).num_columns(2).spacing([12.0, 2.0]).show(ui, |ui| {
            for (name, value) in lines {
                ui.weak(name);
                ui.add(Label::new(value).selectable(true));
                ui.end_row();
            }
        });
    }
}

/// Why a build failed, and the remedy.
pub(super) fn failure(ui: &mut Ui, failure: &Failure) {
    let colour = ui.visuals().error_fg_color;
    ui.add(Label::new(RichText::new(&failure.message).color(colour)).wrap());
    if let Some(hint) = &failure.hint {
        ui.add(Label::new(RichText::new(hint).weak()).wrap());
    }
}

/// Shows a folder in the system's file manager, if there is one.
fn open_folder(folder: &Path) {
    let program = match std::env::consts::OS {
        "windows" => "explorer",
        "macos" => "open",
        _ => "xdg-open",
    };
    let command =
        Command::new(program).arg(folder).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn();
    // Without a file manager you can read the folder's path above.
    drop(command);
}
