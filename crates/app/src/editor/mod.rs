//! The editor: a window that wires a graph and previews its terrain.
//!
//! [`Session`] holds the document with its undo history, the selection, and the state of each node; it draws nothing.
//! Its worker evaluates on another thread, so the window never waits. `canvas`, `inspector` and `viewport` draw a
//! session and edit its document; `dialogs` ask for files and decisions. `window` holds the menus, the list of actions
//! behind menus and keys, and [`App`], which lays out the panes.

#![expect(
    clippy::disallowed_methods,
    reason = "what a window shows is not part of the terrain, so it may differ by a bit"
)]

mod arithmetic;
mod canvas;
mod dialogs;
mod inspector;
pub mod session;
mod viewport;
mod window;

use std::path::PathBuf;

pub use self::window::app::App;
pub use session::{
    Answer, Built, Detail, FileCommand, Journals, Lost, NodeState, Note, Question, Session, Simulation, Snapshot,
};

use crate::{
    build::storage::{self, Storage},
    machine, memory,
    report::failure::Failure,
};

/// Opens the window, on a file if there is one, and returns when it is closed.
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
        Box::new(|context| {
            let starts = file.is_none();
            let app = App::new(context, file, store)?.kept(context, Journals::of_system());
            Ok(Box::new(if starts { app.welcoming() } else { app }))
        }),
    )
    .map_err(|error| {
        let why = without_place(&error.to_string());
        // A problem of the file is not a failure of the window.
        let inner = match error {
            eframe::Error::AppCreation(inner) => inner.downcast::<Failure>().ok(),
            _ => None,
        };
        inner.map(|failure| *failure).unwrap_or_else(|| {
            Failure::unable(format!("cannot open the window: {why}"))
                .hint("the editor needs a display and a graphics driver; `orograph run GRAPH.ron -o DIR` needs neither")
        })
    })
}

/// The message of a window library without its own name and the place in its source code, as in `winit EventLoopError:
/// os error at /build/winit/src/linux.rs:765: DISPLAY is not set`.
fn without_place(message: &str) -> String {
    let reason = message.split_once("os error at ").and_then(|(_, rest)| rest.split_once(": "));
    reason.map_or(message, |(_, reason)| reason).to_owned()
}

#[cfg(test)]
mod tests {
    #[test]
    fn an_error_of_the_window_has_no_place_in_source_code() {
        let text = "winit EventLoopError: os error at /root/winit-0.30/src/linux/mod.rs:765: DISPLAY is not set: none";
        assert_eq!(super::without_place(text), "DISPLAY is not set: none");
        assert_eq!(super::without_place("no screen: none"), "no screen: none");
    }
}
