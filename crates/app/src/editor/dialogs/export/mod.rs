//! Export of outputs to files: the same outputs, formats and engines as `orograph run`, in the background.

mod command;
mod folders;
mod job;
mod queue;
mod result;

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

use clap::ValueEnum as _;
use egui::{ComboBox, Context, Label, RichText, TextEdit, Ui};
use orograph_graph::{PortType, Unit};
use orograph_nodes::raster::Format;

use self::{
    folders::{Folders, in_turn, is_free},
    queue::Queue,
};
use super::browser::{Browser, Outcome, Purpose};
use crate::editor::{Session, arithmetic::typed, window::names::Named as _};
use crate::{
    build::request::{Cells, Changes, Request},
    export::{
        engine::Engine,
        mesh::MeshFormat,
        outputs::{OutputFolder, OutputOptions},
        tiles::Tiles,
    },
    report::failure::Failure,
};

/// Height of the window where there is room for it, in points.
const HEIGHT: f32 = 520.0;

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
    /// Finer cells along the side of each cell.
    supersample: u32,
    queue: Queue,
    /// Why the export could not start.
    refused: Option<Failure>,
    /// The document that the folder and the choice of outputs belong to, and its file.
    of: Option<(u64, Option<PathBuf>)>,
    /// The folder that was proposed for it.
    proposed: String,
    /// Who has written which file.
    folders: Folders,
    /// The question whether an export may replace files.
    asked: Option<Asked>,
    browser: Option<Browser>,
}

/// A factor of supersampling in the list.
const fn supersampling(factor: u32) -> &'static str {
    match factor {
        1 => "1 sample",
        2 => "2 x 2",
        _ => "4 x 4",
    }
}

/// The question whether an export may replace files that the graph has not written.
#[derive(Debug)]
struct Asked {
    /// The folder, as it was typed.
    folder: String,
    files: Vec<PathBuf>,
    /// A folder beside it where nothing is replaced.
    other: Option<PathBuf>,
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
            supersample: 1,
            queue: Queue::default(),
            refused: None,
            of: None,
            proposed: String::new(),
            folders: Folders::default(),
            asked: None,
            browser: None,
        }
    }
}

impl Export {
    /// Opens the window.
    pub(crate) fn open(&mut self, session: &Session) {
        self.follow(session);
        self.open = true;
    }

    /// Another document starts with its own folder and with all outputs. Once a document has another file, a folder that
    /// was only proposed follows the file.
    fn follow(&mut self, session: &Session) {
        let now = (session.number(), session.path().map(Path::to_owned));
        if self.of.as_ref() == Some(&now) {
            return;
        }
        let is_other = self.of.as_ref().is_none_or(|(number, _)| *number != now.0);
        if is_other {
            self.left_out.clear();
            self.cells.clear();
            self.supersample = 1;
            self.refused = None;
        }
        if is_other || self.folder == self.proposed {
            self.proposed = self.folders.proposal(session).display().to_string();
            self.folder.clone_from(&self.proposed);
        }
        self.asked = None;
        self.of = Some(now);
    }

    /// The running build and those that wait, as text. Returns None when none runs.
    pub(crate) fn summary(&self) -> Option<String> {
        self.queue.summary()
    }

    /// Runs the builds, and shows the window if it is open.
    pub(crate) fn ui(&mut self, context: &Context, session: &mut Session) {
        self.queue.poll(context, session);
        if !self.open {
            return;
        }
        self.follow(session);
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
        let window = window.default_width(400.0_f32.min(room.x - 40.0));
        let height = (room.y - 80.0).max(120.0);
        let window = window.max_height(height);
        let window = if height > HEIGHT { window.default_height(HEIGHT) } else { window };
        let shown =
            window.default_pos([(room.x - 420.0).max(10.0) / 2.0, 60.0_f32.min(room.y / 6.0)]).show(context, |ui| {
                self.contents(ui, session);
            });
        // unless Escape ends the typing in a field or belongs to what is above
        let is_top = shown.is_some_and(|shown| context.top_layer_id() == Some(shown.response.layer_id));
        let is_free = context.memory(|memory| memory.focused().is_none());
        let escaped = is_top && is_free && context.input(|input| input.key_pressed(egui::Key::Escape));
        self.open = open && !escaped;
    }

    fn contents(&mut self, ui: &mut Ui, session: &Session) {
        self.outputs(ui, session);
        ui.separator();
        self.settings(ui, session);
        ui.separator();
        ui.horizontal_wrapped(|ui| {
            let button = ui.button(RichText::new("Export").strong());
            if button.on_hover_text("Builds run one after the other, in the background").clicked() {
                self.begin(session, &[]);
                ui.ctx().request_repaint();
            }
            let line = self.command_line(session);
            if ui.button("Copy the command line").on_hover_text(&line).clicked() {
                ui.ctx().copy_text(line);
            }
        });
        if session.is_dirty() {
            let text = "The command builds the file as it was saved, without your unsaved changes.";
            ui.add(Label::new(RichText::new(text).small().weak()).wrap());
        }
        if let Some(failure) = &self.refused {
            result::failure(ui, failure);
        }
        self.question(ui, session);
        self.queue.ui(ui);
    }

    /// Asks whether files may be replaced.
    fn question(&mut self, ui: &mut Ui, session: &Session) {
        let Some(asked) = self.asked.take_if(|asked| asked.folder == self.folder) else {
            self.asked = None;
            return;
        };
        let text = format!("{} Other files in the folder stay beside the new ones.", folders::what(&asked.files));
        ui.add(Label::new(RichText::new(text).color(ui.visuals().warn_fg_color)).wrap());
        let (mut stays, files) = (true, asked.files.as_slice());
        ui.horizontal_wrapped(|ui| {
            if ui.button("Replace them").clicked() {
                stays = false;
                self.begin(session, files);
            }
            if let Some(other) = &asked.other {
                let name = other.file_name().unwrap_or_default().to_string_lossy();
                let button = ui.button(format!("Export to “{name}”"));
                if button.on_hover_text(other.display().to_string()).clicked() {
                    stays = false;
                    self.folder = other.display().to_string();
                    self.begin(session, &[]);
                }
            }
            if ui.button("Cancel").named("Cancel this export").clicked() {
                stays = false;
            }
        });
        if stays {
            self.asked = Some(asked);
        }
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
        let chosen = session.document().outputs().iter().filter(|output| !self.left_out.contains(&output.name));
        let types: Vec<PortType> = chosen.map(|output| output.ty).collect();
        let options = &mut self.options;
        row(ui, "Engine", |ui| {
            let shown = options.engine.map_or("none", Engine::title);
            let list = ComboBox::from_id_salt("engine").selected_text(shown).width(160.0).show_ui(ui, |ui| {
                ui.selectable_value(&mut options.engine, None, "none");
                for engine in Engine::value_variants() {
                    ui.selectable_value(&mut options.engine, Some(*engine), engine.title());
                }
            });
            let _ = list.response.named("Engine");
        });
        row(ui, "Format", |ui| {
            let hover = "For heights, masks and other numbers; colours are PNG, lines GeoJSON, reports JSON. With an engine, \
                         only for the outputs that it does not import";
            let is_used = options.engine.is_none() || types.iter().any(|ty| options.has_format(*ty));
            let shown = if is_used { options.format.name() } else { "set by the engine" };
            ui.add_enabled_ui(is_used, |ui| {
                let combo = ComboBox::from_id_salt("format").selected_text(shown).width(160.0);
                let response = combo.show_ui(ui, |ui| {
                    for format in Format::ALL {
                        ui.selectable_value(&mut options.format, format, format.name());
                    }
                });
                let disabled = "The engine imports all chosen outputs in formats of its own";
                response.response.named("Format").on_hover_text(hover).on_disabled_hover_text(disabled);
            });
        });
        row(ui, "Mesh", |ui| {
            let shown = options.mesh.map_or("none", MeshFormat::extension);
            let list = ComboBox::from_id_salt("mesh").selected_text(shown).width(90.0).show_ui(ui, |ui| {
                ui.selectable_value(&mut options.mesh, None, "none");
                for mesh in MeshFormat::value_variants() {
                    ui.selectable_value(&mut options.mesh, Some(*mesh), mesh.extension());
                }
            });
            let _ = list.response.named("Mesh");
            if options.mesh.is_some() {
                let drag = egui::DragValue::new(&mut options.triangles).range(2..=crate::export::mesh::MOST_TRIANGLES);
                ui.add(typed(drag.speed(1000.0), Unit::One))
                    .named("triangles of the mesh")
                    .on_hover_text("Maximum number of triangles");
            }
        });
        row(ui, "Cells", |ui| {
            let cells = session.document().world().cells;
            let hint = format!("{} x {}", cells[0], cells[1]);
            let edit = TextEdit::singleline(&mut self.cells).hint_text(hint).desired_width(90.0);
            ui.add(edit).named("Cells").on_hover_text(
                "Cells along the longer side, or both sides as 2048x1024; leave empty to use the file's",
            );
            let shown = supersampling(self.supersample);
            let list = ComboBox::from_id_salt("supersampling").selected_text(shown).width(90.0).show_ui(ui, |ui| {
                for factor in [1, 2, 4] {
                    ui.selectable_value(&mut self.supersample, factor, supersampling(factor));
                }
            });
            list.response.named("Supersampling").on_hover_text(
                "Computes each cell from finer ones: finer detail, and crests that are not jagged. 2 x 2 takes four times the \
                 time and memory",
            );
        });
        row(ui, "Tiles", |ui| {
            // Terrain3D divides its maps itself
            let is_used = options.engine != Some(Engine::Godot);
            let mut counts = options.tiles.filter(|_| is_used).unwrap_or(Tiles::WHOLE).counts();
            for (count, name) in counts.iter_mut().zip(["columns of tiles", "rows of tiles"]) {
                let drag = egui::DragValue::new(count).range(1..=Tiles::MOST).speed(0.1);
                let field = ui.add_enabled(is_used, typed(drag, Unit::One)).named(name);
                field.on_hover_text("Tiles of one range, for engines that load a world in parts");
            }
            options.tiles = Tiles::of(counts);
        });
        row(ui, "", |ui| {
            ui.checkbox(&mut options.dither, "Dither").on_hover_text("Dither to avoid banding");
            let mut pictures = !options.no_preview;
            ui.checkbox(&mut pictures, "Pictures").on_hover_text("Save a shaded picture with each heightfield");
            options.no_preview = !pictures;
        });
        row(ui, "Folder", |ui| {
            let width = (ui.available_width() - 34.0).max(60.0);
            let _ = ui.add(TextEdit::singleline(&mut self.folder).desired_width(width)).named("Folder");
            if ui.button("📂").named("choose a folder").on_hover_text("Choose a folder").clicked() {
                self.browser = Some(Browser::new(Purpose::Folder, Some(Path::new(&self.folder))));
            }
        });
    }

    /// The settings that differ from the file.
    fn changes(&self) -> Result<Changes, Failure> {
        let text = self.cells.trim();
        let cells = if text.is_empty() { None } else { Some(text.parse::<Cells>().map_err(Failure::wrong)?) };
        Ok(Changes { cells, supersample: Some(self.supersample), ..Changes::default() })
    }

    /// The outputs to write; empty for all of them.
    fn only(&self, session: &Session) -> Vec<String> {
        let names = session.document().outputs().iter().map(|output| output.name.clone());
        let (out, kept): (Vec<String>, Vec<String>) = names.partition(|name| self.left_out.contains(name));
        if out.is_empty() { Vec::new() } else { kept }
    }

    /// Queues a build of the present state of the graph. Asks first if it would replace files that the graph has not
    /// written, other than these.
    fn begin(&mut self, session: &Session, allowed: &[PathBuf]) {
        (self.asked, self.refused) = (None, None);
        let request = match self.request(session) {
            Ok(request) => request,
            Err(failure) => {
                let message = failure.message.trim_start_matches("`--cells`: ").to_owned();
                self.refused = Some(Failure { message, ..failure });
                return;
            }
        };
        let folder = PathBuf::from(self.folder.trim());
        let files = OutputFolder::files(&folders::real(&folder), &request.outputs, &self.options);
        let queue = &self.queue;
        let is_there = |file: &Path| file.is_file() || queue.writes(file);
        let replaced = self.folders.of_others(&files, session, is_there);
        if replaced.iter().all(|file| allowed.contains(file)) {
            self.folders.take(&files, session);
            self.queue.add(session, request, (folder, files), self.options.clone());
        } else {
            let other = in_turn(folder).find(|folder| is_free(folder));
            self.asked = Some(Asked { folder: self.folder.clone(), files: replaced, other });
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
        command::line(
            &file,
            Path::new(self.folder.trim()),
            &self.only(session),
            &self.options,
            self.cells.trim(),
            self.supersample,
        )
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
