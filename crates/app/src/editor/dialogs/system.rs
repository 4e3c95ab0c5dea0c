//! The file dialogs of the system. They do not block the window; the caller fetches the answer.
//!
//! A system may have none (no portal), so every path can be typed as well.

use std::{
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
    thread,
};

use egui::{Context, Id};
use rfd::AsyncFileDialog;

/// The kind of dialog.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ask {
    /// An existing file.
    File,
    /// An existing graph file.
    Graph,
    /// A new graph file.
    NewGraph,
    /// A new picture.
    NewPicture,
    /// A folder.
    Folder,
}

/// Receives an answer.
type Slot = Arc<Mutex<Option<PathBuf>>>;

/// Opens a dialog in a folder. [`answer`] with the same id returns the choice.
pub(crate) fn ask(context: &Context, id: Id, what: Ask, folder: &Path) {
    let slot = Slot::default();
    context.data_mut(|data| data.insert_temp(id.with("dialog"), Arc::clone(&slot)));
    let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    let dialog = AsyncFileDialog::new().set_directory(folder);
    let graphs = |dialog: AsyncFileDialog| dialog.add_filter("Orograph graphs", &["ron"]);
    let wake = context.clone();
    let give = move |path: Option<PathBuf>| {
        *slot.lock().unwrap_or_else(PoisonError::into_inner) = path;
        wake.request_repaint();
    };
    // Some systems need dialogs to be created on the window's thread; another thread waits for them.
    let open = thread::Builder::new().name("dialog".to_owned());
    let opened = match what {
        Ask::Folder => {
            let chosen = dialog.pick_folder();
            open.spawn(move || give(pollster::block_on(chosen).map(|file| file.path().to_owned())))
        }
        Ask::NewGraph => {
            let chosen = graphs(dialog).save_file();
            open.spawn(move || give(pollster::block_on(chosen).map(|file| file.path().to_owned())))
        }
        Ask::NewPicture => {
            let chosen = dialog.add_filter("PNG pictures", &["png"]).save_file();
            open.spawn(move || give(pollster::block_on(chosen).map(|file| file.path().to_owned())))
        }
        Ask::File | Ask::Graph => {
            let dialog = if what == Ask::Graph { graphs(dialog) } else { dialog };
            let chosen = dialog.pick_file();
            open.spawn(move || give(pollster::block_on(chosen).map(|file| file.path().to_owned())))
        }
    };
    // Without a thread there is no dialog; the path can be typed.
    drop(opened);
}

/// The choice, once it is made; returned once.
pub(crate) fn answer(context: &Context, id: Id) -> Option<PathBuf> {
    let slot: Slot = context.data(|data| data.get_temp(id.with("dialog")))?;
    slot.lock().unwrap_or_else(PoisonError::into_inner).take()
}
