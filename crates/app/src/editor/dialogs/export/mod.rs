//! Export of outputs to files: the same outputs, formats and engines as `orograph run`, in the background.

mod command;
mod job;

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use clap::ValueEnum as _;
use egui::{Button, ComboBox, Context, Label, ProgressBar, RichText, TextEdit, Ui};
use orograph_graph::bytes;
use orograph_nodes::raster::Format;

use self::job::Job;
use super::browser::{Browser, Outcome, Purpose};
use crate::editor::Session;
use crate::{
    build::{
        Built,
        request::{Cells, Changes, Request},
    },
    export::{engine::Engine, mesh::MeshFormat, outputs::OutputOptions},
    report::{failure::Failure, progress::seconds},
};

/// The export window.
#[derive(Debug)]
pub(crate) struct Export {
    open: bool,
    folder: String,
    /// Outputs that are not exported.
    left_out: BTreeSet<String>,
    options: OutputOptions,
    /// The typed number of cells; empty for the file's own.
    cells: String,
    job: Option<Job>,
    /// Why the export could not start.
    refused: Option<Failure>,
    browser: Option<Browser>,
    /// True while the window scrolls down to the result, which may be below its end.
    follows: bool,
}

impl Default for Export {
    fn default() -> Self {
        let options = OutputOptions::default();
        Self {
            open: false,
            folder: String::new(),
            left_out: BTreeSet::new(),
            options,
            cells: String::new(),
            job: None,
            refused: None,
            browser: None,
            follows: false,
        }
    }
}

impl Export {
    /// Opens the window.
    pub(crate) fn open(&mut self, session: &Session) {
        if self.folder.is_empty() {
            let folder = session.path().and_then(Path::parent).map(Path::to_owned);
            let folder = folder.or_else(|| std::env::current_dir().ok()).unwrap_or_default();
            let folder = folder.canonicalize().unwrap_or(folder);
            self.folder = folder.join("out").display().to_string();
        }
        self.open = true;
    }

    /// Shows the window if it is open.
    pub(crate) fn ui(&mut self, context: &Context, session: &Session) {
        if !self.open {
            return;
        }
        if let Some(browser) = &mut self.browser {
            match browser.show(context) {
                None => {}
                Some(outcome) => {
                    if let Outcome::Chosen(path) = outcome {
                        self.folder = path.display().to_string();
                    }
                    self.browser = None;
                }
            }
        }
        let room = context.content_rect().size();
        let mut open = true;
        let window =
            egui::Window::new("Export").open(&mut open).collapsible(false).vscroll(true).resizable([true, false]);
        let window = window.default_width(400.0_f32.min(room.x - 40.0)).max_height((room.y - 80.0).max(120.0));
        window.default_pos([(room.x - 420.0).max(10.0) / 2.0, 60.0_f32.min(room.y / 6.0)]).show(context, |ui| {
            self.contents(ui, session);
        });
        self.open = open;
    }

    fn contents(&mut self, ui: &mut Ui, session: &Session) {
        let running = self.job.as_ref().is_some_and(|job| job.state().end.is_none());
        ui.add_enabled_ui(!running, |ui| {
            self.outputs(ui, session);
            ui.separator();
            self.settings(ui, session);
        });
        ui.separator();
        ui.horizontal_wrapped(|ui| {
            if running {
                if let Some(job) = &self.job
                    && ui.add_enabled(!job.is_cancelled(), Button::new("Stop")).clicked()
                {
                    job.cancel();
                }
            } else if ui.button(RichText::new("Export").strong()).clicked() {
                self.begin(ui.ctx(), session);
            }
            let line = self.command_line(session);
            if ui.button("Copy the command line").on_hover_text(&line).clicked() {
                ui.ctx().copy_text(line);
            }
        });
        if session.is_dirty() {
            let text = "Unsaved changes are not in the file that the command reads.";
            ui.add(Label::new(RichText::new(text).small().weak()).wrap());
        }
        if let Some(failure) = &self.refused {
            show_failure(ui, failure);
        }
        self.progress(ui);
    }

    fn outputs(&mut self, ui: &mut Ui, session: &Session) {
        ui.strong("Outputs");
        let outputs = session.document().outputs();
        if outputs.is_empty() {
            let text = "The graph has no outputs. Tick “output” on a node in the inspector to add one.";
            ui.add(Label::new(text).wrap());
        }
        for output in outputs {
            let mut on = !self.left_out.contains(&output.name);
            ui.horizontal(|ui| {
                if ui.checkbox(&mut on, &output.name).changed() {
                    let name = &output.name;
                    let _ = if on { self.left_out.remove(name) } else { self.left_out.insert(name.clone()) };
                }
                ui.add(Label::new(RichText::new(output.ty.to_string()).weak()).truncate());
            });
        }
    }

    fn settings(&mut self, ui: &mut Ui, session: &Session) {
        let options = &mut self.options;
        row(ui, "Engine", |ui| {
            let shown = options.engine.map_or("none", Engine::title);
            ComboBox::from_id_salt("engine").selected_text(shown).width(160.0).show_ui(ui, |ui| {
                ui.selectable_value(&mut options.engine, None, "none");
                for engine in Engine::value_variants() {
                    ui.selectable_value(&mut options.engine, Some(*engine), engine.title());
                }
            });
        });
        row(ui, "Format", |ui| {
            let hover = "For heights, masks and other numbers if no engine is chosen; colours are PNG, lines GeoJSON, \
                         reports JSON";
            let combo = ComboBox::from_id_salt("format").selected_text(options.format.name()).width(160.0);
            let response = combo.show_ui(ui, |ui| {
                for format in Format::ALL {
                    ui.selectable_value(&mut options.format, format, format.name());
                }
            });
            response.response.on_hover_text(hover);
        });
        row(ui, "Mesh", |ui| {
            let shown = options.mesh.map_or("none", MeshFormat::extension);
            ComboBox::from_id_salt("mesh").selected_text(shown).width(90.0).show_ui(ui, |ui| {
                ui.selectable_value(&mut options.mesh, None, "none");
                for mesh in MeshFormat::value_variants() {
                    ui.selectable_value(&mut options.mesh, Some(*mesh), mesh.extension());
                }
            });
            if options.mesh.is_some() {
                let drag = egui::DragValue::new(&mut options.triangles).range(2..=crate::export::mesh::MOST_TRIANGLES);
                ui.add(drag.speed(1000.0)).on_hover_text("Maximum number of triangles");
            }
        });
        row(ui, "Cells", |ui| {
            let cells = session.document().world().cells;
            let hint = format!("{} x {}", cells[0], cells[1]);
            let edit = TextEdit::singleline(&mut self.cells).hint_text(hint).desired_width(90.0);
            ui.add(edit).on_hover_text(
                "Cells along the longer side, or both sides as 2048x1024; leave empty to use the file's",
            );
        });
        row(ui, "", |ui| {
            ui.checkbox(&mut options.dither, "Dither").on_hover_text("Dither to avoid banding");
            let mut pictures = !options.no_preview;
            ui.checkbox(&mut pictures, "Pictures").on_hover_text("Save a shaded picture with each heightfield");
            options.no_preview = !pictures;
        });
        row(ui, "Folder", |ui| {
            let width = (ui.available_width() - 34.0).max(60.0);
            let response = ui.add(TextEdit::singleline(&mut self.folder).desired_width(width));
            response.widget_info(|| egui::WidgetInfo::labeled(egui::WidgetType::TextEdit, true, "Folder"));
            if ui.button("📂").on_hover_text("Choose a folder").clicked() {
                self.browser = Some(Browser::new(Purpose::Folder, Some(Path::new(&self.folder))));
            }
        });
    }

    /// The settings that differ from the file.
    fn changes(&self) -> Result<Changes, Failure> {
        let text = self.cells.trim();
        let cells = if text.is_empty() { None } else { Some(text.parse::<Cells>().map_err(Failure::wrong)?) };
        Ok(Changes { cells, ..Changes::default() })
    }

    /// The outputs to write; empty for all of them.
    fn only(&self, session: &Session) -> Vec<String> {
        let names = session.document().outputs().iter().map(|output| output.name.clone());
        let (out, kept): (Vec<String>, Vec<String>) = names.partition(|name| self.left_out.contains(name));
        if out.is_empty() { Vec::new() } else { kept }
    }

    fn begin(&mut self, context: &Context, session: &Session) {
        self.job = None;
        match self.request(session).and_then(|request| {
            let folder = PathBuf::from(self.folder.trim());
            Job::start(session.evaluator(), request, folder, self.options.clone(), context)
        }) {
            Ok(job) => (self.job, self.refused, self.follows) = (Some(job), None, true),
            Err(failure) => self.refused = Some(failure),
        }
    }

    fn request(&self, session: &Session) -> Result<Request, Failure> {
        let document = session.document();
        if document.has_errors() {
            return Err(Failure::wrong("the graph has errors").hint("the Problems pane lists them"));
        }
        let all = document.outputs().len();
        if all == 0 || document.outputs().iter().all(|output| self.left_out.contains(&output.name)) {
            return Err(Failure::wrong("no output is chosen: there is nothing to write"));
        }
        Request::of_document(document.clone(), &self.changes()?)?.only(&self.only(session))
    }

    fn command_line(&self, session: &Session) -> String {
        let file = session.path().map_or_else(|| PathBuf::from("GRAPH.ron"), Path::to_owned);
        command::line(&file, Path::new(self.folder.trim()), &self.only(session), &self.options, self.cells.trim())
    }

    fn progress(&mut self, ui: &mut Ui) {
        let Some(job) = &self.job else { return };
        let state = job.state();
        ui.separator();
        if self.follows && state.end.is_some() {
            ui.scroll_to_cursor(Some(egui::Align::TOP));
            self.follows = false;
        }
        match &state.end {
            None => {
                let node = state.node.as_ref().map_or("", |(node, _)| node.as_str());
                let text = match (job.is_cancelled(), state.writing) {
                    (true, _) => "Stopping".to_owned(),
                    (_, true) => "Writing files".to_owned(),
                    _ => format!("{} of {} nodes {node}", state.finished, state.planned),
                };
                ui.add(ProgressBar::new(state.fraction()).desired_height(8.0));
                ui.add(Label::new(text).truncate());
                if self.follows {
                    ui.scroll_to_cursor(Some(egui::Align::BOTTOM));
                }
            }
            Some(Ok(built)) => done(ui, built, &self.folder),
            Some(Err(failure)) => show_failure(ui, failure),
        }
        for warning in &state.warnings {
            ui.add(Label::new(RichText::new(warning).color(ui.visuals().warn_fg_color)).wrap());
        }
    }
}

/// A row of the settings.
fn row(ui: &mut Ui, name: &str, content: impl FnOnce(&mut Ui)) {
    ui.horizontal(|ui| {
        let size = egui::vec2(64.0, ui.spacing().interact_size.y);
        ui.allocate_ui_with_layout(size, egui::Layout::left_to_right(egui::Align::Center), |ui| {
            ui.set_min_width(size.x);
            ui.label(name);
        });
        content(ui);
    });
}

/// The written files, their import settings, and a button to open the folder.
fn done(ui: &mut Ui, built: &Built, folder: &str) {
    let count = built.files.len();
    let files = if count == 1 { "1 file".to_owned() } else { format!("{count} files") };
    ui.horizontal(|ui| {
        ui.label(RichText::new(format!("Wrote {files} in {}", seconds(built.time))).strong());
        if ui.button("Open folder").clicked() {
            open_folder(Path::new(folder.trim()));
        }
    });
    if let Some(missed) = built.expected.missed() {
        ui.add(Label::new(RichText::new(missed).color(ui.visuals().warn_fg_color)).wrap());
    }
    egui::Grid::new("files").num_columns(3).spacing([12.0, 2.0]).show(ui, |ui| {
        for file in &built.files {
            let name = file.path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
            ui.label(name).on_hover_text(file.path.display().to_string());
            ui.weak(file.what);
            ui.weak(bytes(file.bytes));
            ui.end_row();
        }
    });
    for file in &built.files {
        let Some(import) = &file.import else { continue };
        ui.add_space(4.0);
        let name = file.path.file_name().map(|name| name.to_string_lossy()).unwrap_or_default();
        ui.strong(format!("{name} in {}", import.engine.title()));
        egui::Grid::new(("import", &file.path)).num_columns(2).spacing([12.0, 2.0]).show(ui, |ui| {
            for (name, value) in import.lines() {
                ui.weak(name);
                ui.add(Label::new(value).selectable(true));
                ui.end_row();
            }
        });
    }
}

fn show_failure(ui: &mut Ui, failure: &Failure) {
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
