//! The editor: a window in which a graph is wired and its land is seen.
//!
//! [`Session`] is the work: the document, its undo, its selection, and what is known of its nodes; it draws nothing.
//! The panes (`canvas`, `inspector`, `viewport`, `problems`) show a session and change it by edits of the
//! document. `actions` lists what can be asked for by menu and key. [`worker`] evaluates beside the window, which never waits for it. [`App`] is the window itself.

#![expect(
    clippy::disallowed_methods,
    reason = "what a window shows is not a part of the land, so it may differ by a bit"
)]

mod actions;
mod app;
mod browser;
mod canvas;
mod dialog;
mod export;
mod gallery;
mod inspector;
mod live;
mod menu;
mod problems;
mod questions;
mod session;
mod state;
mod theme;
mod toasts;
mod viewport;
pub mod worker;

use std::path::PathBuf;

pub use app::App;
pub use session::{Answer, Built, Detail, Journals, Lost, NodeState, Note, Question, Session, Simulation, Wish};

use crate::{
    failure::Failure,
    machine, memory,
    storage::{self, Storage},
};

/// Opens the window, on a file if one is named, and returns when it is closed.
///
/// # Errors
/// When there is no display, no graphics driver that can draw the window, or no threads.
pub fn open(file: Option<PathBuf>) -> Result<(), Failure> {
    machine::start_threads(None)?;
    memory::keeps_a_journal();
    let store = Storage::default().store(storage::memory_budget())?;
    let options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_title("Orograph")
            .with_app_id("orograph")
            .with_inner_size([1440.0, 900.0])
            .with_min_inner_size([400.0, 300.0]),
        ..eframe::NativeOptions::default()
    };
    eframe::run_native(
        "orograph",
        options,
        Box::new(|context| Ok(Box::new(App::new(context, file, store)?.kept(context, Journals::of_system())))),
    )
    .map_err(|error| {
        let why = error.to_string();
        // What is wrong with the file is no fault of the window.
        let inner = match error {
            eframe::Error::AppCreation(inner) => inner.downcast::<Failure>().ok(),
            _ => None,
        };
        inner.map(|failure| *failure).unwrap_or_else(|| {
            Failure::unable(format!("the window cannot be opened: {why}"))
                .hint("the editor needs a display and a graphics driver; `orograph run GRAPH.ron -o DIR` needs neither")
        })
    })
}
