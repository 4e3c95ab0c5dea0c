//! A file browser in the window, to open a graph, to choose a folder or to name a picture. It works without a dialog of
//! the system, and offers that too.

use std::path::{Path, PathBuf};

use egui::{Align, Button, Context, Id, Key, Layout, RichText, ScrollArea, TextEdit, Ui};

use super::system::{self, Ask};
use crate::editor::window::{names::Named as _, theme};

/// The purpose of the browser.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// Open a graph.
    Open,
    /// Choose a folder for outputs.
    Folder,
    /// Save a picture.
    Picture,
}

/// The result of the browser.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// The dialog was cancelled.
    Cancelled,
    /// This file or folder was chosen.
    Chosen(PathBuf),
}

/// A file browser.
#[derive(Debug)]
pub(crate) struct Browser {
    purpose: Purpose,
    folder: PathBuf,
    /// The typed text: a name in the folder, or a whole path.
    text: String,
    entries: Vec<FileEntry>,
    /// True once the field has had the focus.
    begun: bool,
    /// An existing file that would be overwritten.
    over: Option<PathBuf>,
}

/// A folder or a file in the list.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
struct FileEntry {
    is_file: bool,
    name: String,
}

impl Browser {
    /// A browser in the folder of a file, or in the current folder.
    pub(crate) fn new(purpose: Purpose, near: Option<&Path>) -> Self {
        let present = || std::env::current_dir().unwrap_or_else(|_| PathBuf::from("."));
        let near_folder = near.map(|path| if path.is_dir() { path } else { path.parent().unwrap_or(path) });
        let folder = near_folder.and_then(|folder| folder.canonicalize().ok()).unwrap_or_else(present);
        let mut browser = Self { purpose, folder, text: String::new(), entries: Vec::new(), begun: false, over: None };
        browser.list();
        browser
    }

    /// The same with a name for a new file: the stem, with a number if necessary.
    pub(crate) fn named(mut self, stem: &str, extension: &str) -> Self {
        let name = |number: u32| match number {
            1 => format!("{stem}.{extension}"),
            number => format!("{stem} {number}.{extension}"),
        };
        let free = (1..).map(name).find(|name| !self.folder.join(name).exists());
        self.text = free.unwrap_or_default();
        self
    }

    fn list(&mut self) {
        let entries = std::fs::read_dir(&self.folder).into_iter().flatten().flatten();
        let wanted = |path: &Path| {
            let is = |wanted| path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(wanted));
            path.is_dir()
                || match self.purpose {
                    Purpose::Open => is("ron"),
                    Purpose::Folder => false,
                    Purpose::Picture => is("png"),
                }
        };
        let named = entries.map(|entry| entry.path()).filter(|path| wanted(path)).filter_map(|path| {
            let name = path.file_name()?.to_str()?.to_owned();
            (!name.starts_with('.')).then(|| FileEntry { is_file: !path.is_dir(), name })
        });
        self.entries = named.collect();
        self.entries.sort();
    }

    fn enter(&mut self, folder: PathBuf) {
        self.folder = folder;
        if self.purpose != Purpose::Picture {
            self.text.clear();
        }
        self.list();
    }

    /// The purpose of the browser.
    pub(crate) const fn purpose(&self) -> Purpose {
        self.purpose
    }

    /// Shows the browser above everything. Returns None until it is closed.
    pub(crate) fn show(&mut self, context: &Context) -> Option<Outcome> {
        let id = Id::new("browser");
        let mut outcome = None;
        let modal = theme::modal(context, id).show(context, |ui| {
            let room = ui.ctx().content_rect().size();
            ui.set_width((room.x - 60.0).clamp(200.0, 520.0));
            let (title, action) = match self.purpose {
                Purpose::Open => ("Open a graph", "Open"),
                Purpose::Folder => ("Choose an export folder", "Choose"),
                Purpose::Picture => ("Save a picture of the 3D view", "Save"),
            };
            ui.heading(title);
            let entered = self.path_line(ui);
            let chosen = self.rows(ui, (room.y - 200.0).clamp(60.0, 320.0));
            ui.add_space(4.0);
            if self.over.is_some() {
                ui.colored_label(ui.visuals().warn_fg_color, "File exists. Save again to overwrite.");
            }
            ui.horizontal(|ui| {
                let acted = ui.button(RichText::new(action).strong()).clicked();
                if ui.button("Cancel").clicked() {
                    outcome = Some(Outcome::Cancelled);
                }
                if ui.button("System dialog…").clicked() {
                    let ask = match self.purpose {
                        Purpose::Open => Ask::Graph,
                        Purpose::Folder => Ask::Folder,
                        Purpose::Picture => Ask::NewPicture,
                    };
                    system::ask(ui.ctx(), id, ask, &self.folder);
                }
                if acted || entered || chosen {
                    outcome = self.act();
                }
            });
        });
        if let Some(path) = system::answer(context, id) {
            outcome = Some(Outcome::Chosen(path));
        }
        if outcome.is_none() && modal.should_close() {
            outcome = Some(Outcome::Cancelled);
        }
        outcome
    }

    /// The folder and the text field. Returns true if Enter was pressed in the field.
    fn path_line(&mut self, ui: &mut Ui) -> bool {
        ui.horizontal(|ui| {
            let up = self.folder.parent().map(Path::to_owned);
            if ui
                .add_enabled(up.is_some(), Button::new("⬆"))
                .named("parent folder")
                .on_hover_text("Parent folder")
                .clicked()
                && let Some(up) = up
            {
                self.enter(up);
            }
            let shown = self.folder.display().to_string();
            ui.add(egui::Label::new(RichText::new(&shown).weak()).truncate()).on_hover_text(shown);
        });
        let hint = if self.purpose == Purpose::Folder { "this folder" } else { "name or path" };
        let edit = TextEdit::singleline(&mut self.text).hint_text(hint).desired_width(f32::INFINITY);
        let response = ui.add(edit).named("path");
        if !std::mem::replace(&mut self.begun, true) {
            response.request_focus();
        }
        response.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter))
    }

    /// The folders and files. Returns true if one was chosen by a double-click.
    fn rows(&mut self, ui: &mut Ui, height: f32) -> bool {
        let mut chosen = false;
        let mut entered = None;
        ScrollArea::vertical().max_height(height).min_scrolled_height(height).auto_shrink([false, true]).show(
            ui,
            |ui| {
                let lines = Layout::top_down_justified(Align::Min);
                ui.with_layout(lines, |ui| {
                    for entry in &self.entries {
                        let icon = if entry.is_file { "🗋" } else { "🗀" };
                        let button = Button::selectable(self.text == entry.name, format!("{icon}  {}", entry.name));
                        let response = ui.add(button.truncate());
                        if response.clicked() && entry.is_file {
                            self.text.clone_from(&entry.name);
                        } else if response.clicked() {
                            entered = Some(self.folder.join(&entry.name));
                        }
                        chosen |= response.double_clicked() && entry.is_file;
                    }
                });
                if self.entries.is_empty() {
                    ui.weak("No matching files in this folder");
                }
            },
        );
        if let Some(folder) = entered {
            self.enter(folder);
        }
        chosen
    }

    /// Applies the typed text: enters a folder, or chooses a file.
    fn act(&mut self) -> Option<Outcome> {
        let path = self.folder.join(self.text.trim());
        if self.purpose == Purpose::Folder {
            return Some(Outcome::Chosen(path));
        }
        if path.is_dir() {
            self.enter(path);
            return None;
        }
        if self.purpose == Purpose::Picture {
            if self.text.trim().is_empty() {
                return None;
            }
            let path = if path.extension().is_some() { path } else { path.with_extension("png") };
            if path.exists() && self.over.as_ref() != Some(&path) {
                self.over = Some(path);
                return None;
            }
            return Some(Outcome::Chosen(path));
        }
        Some(Outcome::Chosen(path))
    }
}
