//! The system's dialogs for files. They run beside the window, which goes on; the answer is fetched by who asked.
//!
//! A system may have none (no portal): whatever they give can be typed as well.

use std::{
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
    thread,
};

use egui::{Context, Id};
use rfd::AsyncFileDialog;

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ask {
    /// A file that exists.
    File,
    /// A graph file that exists.
    Graph,
    /// A graph file to write.
    NewGraph,
    /// A picture to write.
    NewPicture,
    /// A folder.
    Folder,
}

/// Where an answer is put.
type Slot = Arc<Mutex<Option<PathBuf>>>;

/// Opens a dialog, in a folder. [`answer`] with the same id gives what was chosen.
pub(super) fn ask(context: &Context, id: Id, what: Ask, folder: &Path) {
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
    // Some systems want dialogs to be made on the window's thread; waiting for them is done elsewhere.
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
    // Without a thread there is no dialog, and the name can be typed.
    drop(opened);
}

/// What was chosen since, once.
pub(super) fn answer(context: &Context, id: Id) -> Option<PathBuf> {
    let slot: Slot = context.data(|data| data.get_temp(id.with("dialog")))?;
    slot.lock().unwrap_or_else(PoisonError::into_inner).take()
}
