//! The file of a session: saving, opening another file, and the questions that prevent losing work.

use std::path::{Path, PathBuf};

use orograph_graph::{Document, LoadError, Registry, Severity};

use super::{
    Lost, Session,
    unpacked::{Unpacked, take_along},
};
use crate::{
    files::archive::is_archive,
    report::{
        failure::{Failure, reason},
        terminal::counted,
    },
};

/// A command that closes the current document.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FileCommand {
    /// Start an empty graph.
    New,
    /// Open another file.
    Open(PathBuf),
    /// Open a copy of an example, which has no file yet.
    Copy {
        /// The title of the example.
        name: String,
        /// The text of the graph.
        text: String,
        /// The folder of the files that the graph reads.
        folder: PathBuf,
    },
    /// Close the window.
    Close,
}

/// A question that you must answer before anything else happens.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Question {
    /// There is unsaved work, which the command would discard.
    Unsaved(FileCommand),
    /// Exports run or wait, which closing the window would cancel.
    Exporting,
    /// The graph needs a file name.
    Name,
    /// The file changed on disk, and its changes conflict with unsaved work.
    Changed {
        /// The text of the file now.
        theirs: String,
        /// Values that both changed, such as `rivers.duration`.
        conflicts: Vec<String>,
        /// True if the work was about to be saved.
        saving: bool,
    },
    /// A journal has unsaved work of an earlier session.
    Found(Lost),
}

/// Your answer to a question.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    /// Do nothing.
    Cancel,
    /// Save the work in its file.
    Save,
    /// Save the work in this file.
    SaveAs(PathBuf),
    /// Discard the work.
    Discard,
    /// Recover the work of the earlier session.
    Recover,
    /// Keep the work and overwrite the file; at once if the work was about to be saved.
    KeepMine,
    /// Replace the work with the text of the file; undo restores the work.
    TakeTheirs,
}

/// A file that was opened.
pub(super) struct Opened {
    pub(super) document: Document,
    /// The text of the file; None for a copy.
    pub(super) saved: Option<String>,
    /// Where the files of an archive are.
    pub(super) unpacked: Option<Unpacked>,
}

impl Opened {
    /// Reads a graph file. An archive opens as a copy without a file, so that saving asks for a name and copies the
    /// archive's files.
    ///
    /// # Errors
    /// When the file cannot be read, or the archive is unsafe.
    pub(super) fn new(path: &Path, registry: &Registry) -> Result<Self, Failure> {
        if is_archive(path) {
            let (unpacked, document) = Unpacked::new(path, registry)?;
            return Ok(Self { document, saved: None, unpacked: Some(unpacked) });
        }
        let document = Document::load(path, registry).map_err(|error| Failure::wrong(error.to_string()))?;
        let saved = Some(document.source().to_owned());
        Ok(Self { document, saved, unpacked: None })
    }
}

impl Session {
    /// Returns true if the document differs from its file.
    #[must_use]
    pub fn is_dirty(&self) -> bool {
        match &self.saved {
            Some(saved) => *saved != self.document.source(),
            None => self.path().is_some() || self.document.can_undo(),
        }
    }

    /// Distinguishes the document from the others that this session has opened.
    #[must_use]
    pub const fn number(&self) -> u64 {
        self.number
    }

    /// The name of the document: that of its file or example, otherwise `Untitled`, with a number from the second one on.
    #[must_use]
    pub fn title(&self) -> String {
        match (self.path().and_then(Path::file_name), &self.example) {
            (Some(name), _) => name.to_string_lossy().into_owned(),
            (None, Some(example)) => format!("Copy of {example}"),
            (None, None) if self.nameless < 2 => "Untitled".to_owned(),
            (None, None) => format!("Untitled {}", self.nameless),
        }
    }

    /// The question that you must answer first. Returns None when there is none.
    #[must_use]
    pub const fn question(&self) -> Option<&Question> {
        self.question.as_ref()
    }

    /// Returns true if the window can close without losing anything.
    #[must_use]
    pub const fn is_over(&self) -> bool {
        self.over
    }

    /// Saves the work in its file. Returns false if it was not saved; then a question is open or a note says why.
    ///
    /// A file that changed on disk is never overwritten without asking.
    pub fn save(&mut self) -> bool {
        let Some(path) = self.path().map(Path::to_owned) else {
            self.ask_name();
            return false;
        };
        match read(&path, &self.document) {
            Ok(theirs) if theirs.is_none() || theirs == self.saved || theirs.as_deref() == Some(self.source()) => {
                self.write(&path)
            }
            Ok(theirs) => theirs.is_some_and(|theirs| self.meet(theirs, true)) && self.write(&path),
            Err(error) => {
                self.unsaved(&path, &error.to_string());
                false
            }
        }
    }

    /// Saves the work in another file, which becomes its file. Updates the paths of the files that the graph reads;
    /// copies the files of an archive or of an example. Returns false if the work was not saved; then a note says why,
    /// and nothing has changed.
    pub fn save_as(&mut self, path: &Path) -> bool {
        let path = if path.extension().is_some() { path.to_owned() } else { path.with_extension("ron") };
        // its own file may have changed since it was read
        let own = self.path().and_then(|own| own.canonicalize().ok());
        if own.is_some() && own == path.canonicalize().ok() {
            return self.save();
        }
        let before = self.document.clone();
        self.end_gesture();
        let taken = match take_along(&self.document, &path) {
            Ok(taken) => taken,
            Err(error) => {
                self.unsaved(&path, &format!("cannot copy the files that it reads: {}", reason(&error)));
                return false;
            }
        };
        if let Some(taken) = &taken {
            self.document.set_folder(&taken.folder);
        }
        let moved = self.document.move_to(&path);
        if self.write(&path) {
            if let Some(taken) = taken.filter(|taken| !taken.new.is_empty()) {
                let names: Vec<String> = taken.new.iter().map(|file| format!("`{}`", file.display())).collect();
                self.note(format!("the files that the graph reads were saved with it: {}", names.join(", ")), false);
            } else if moved {
                self.note("the paths of the files that the graph reads were updated for its new folder", false);
            }
            // The next edit starts a journal beside the new file.
            self.end_journal();
            (self.unpacked, self.example) = (None, None);
            self.watch_files();
            self.changed();
            return true;
        }
        if let Some(taken) = taken {
            taken.give_back();
        }
        self.document = before;
        false
    }

    /// Asks for a file name to save the work under.
    pub fn ask_name(&mut self) {
        self.question = Some(Question::Name);
    }

    /// Whether exports run or wait: then closing the window asks first.
    pub const fn set_exporting(&mut self, exporting: bool) {
        self.exporting = exporting;
    }

    /// Runs a command that closes the current document; asks first if there is unsaved work.
    pub fn request(&mut self, command: FileCommand) {
        self.end_gesture();
        if command == FileCommand::Close && self.exporting {
            self.question = Some(Question::Exporting);
        } else if self.is_dirty() {
            self.question = Some(Question::Unsaved(command));
        } else {
            self.execute(command);
        }
    }

    /// Applies the answer to [`Self::question`].
    pub fn answer(&mut self, answer: Answer) {
        let Some(question) = self.question.take() else { return };
        match (question, answer) {
            (Question::Found(_), Answer::Cancel) => self.leave_found(),
            (_, Answer::Cancel) => self.pending = None,
            (Question::Unsaved(command), Answer::Save) => {
                self.pending = Some(command);
                self.save();
            }
            (Question::Unsaved(command), Answer::Discard) => self.execute(command),
            (Question::Exporting, Answer::Discard) => {
                self.exporting = false;
                self.request(FileCommand::Close);
            }
            (question, Answer::SaveAs(path)) => {
                if !self.save_as(&path) && question == Question::Name {
                    self.question = Some(question);
                }
            }
            (Question::Changed { theirs, saving, .. }, answer @ (Answer::KeepMine | Answer::Save)) => {
                self.know(Some(theirs));
                if saving || answer == Answer::Save {
                    self.save();
                }
            }
            (Question::Changed { theirs, .. }, Answer::TakeTheirs) => {
                // what was to happen after saving does not: undo brings the work back
                self.pending = None;
                self.take(theirs);
            }
            (Question::Found(_), Answer::Recover) => self.recover(),
            (Question::Found(_), Answer::Discard) => self.forget_found(),
            (question, _) => self.question = Some(question),
        }
        if let Some(command) = self.pending.take_if(|_| self.question.is_none()) {
            // Only saved work may be closed.
            if !self.is_dirty() {
                self.execute(command);
            }
        }
    }

    /// Replaces the work with the text of the file, as one undo step. Returns false if the file could not be read.
    pub fn reload(&mut self) -> bool {
        let Some(path) = self.path().map(Path::to_owned) else { return false };
        match read(&path, &self.document) {
            Ok(Some(theirs)) => {
                self.take(theirs);
                true
            }
            Ok(None) => {
                self.note(LoadError::Missing(path).to_string(), true);
                false
            }
            Err(error) => {
                self.note(error.to_string(), true);
                false
            }
        }
    }

    /// Replaces the work with the text of the file, as one undo step.
    pub(super) fn take(&mut self, theirs: String) {
        self.replace(&theirs);
        self.know(Some(theirs));
    }

    /// Replaces the work with another text, as one undo step.
    pub(super) fn replace(&mut self, text: &str) {
        self.end_gesture();
        let before = self.document.edits();
        let nodes = self.document.nodes().iter().map(|entry| entry.name.clone()).collect();
        self.document.replace(text);
        self.keep_preferred_of(&nodes);
        self.made(before);
        self.changed();
    }

    fn execute(&mut self, command: FileCommand) {
        match command {
            FileCommand::New => {
                self.start(Document::empty(self.document.registry()), None);
                self.nameless += 1;
            }
            FileCommand::Open(path) => match Opened::new(&path, self.document.registry()) {
                Ok(Opened { document, saved, unpacked }) => {
                    self.start(document, saved);
                    self.nameless += u32::from(unpacked.is_some());
                    self.unpacked = unpacked;
                }
                Err(failure) => self.note(failure.to_string(), true),
            },
            FileCommand::Copy { name, text, folder } => {
                self.start(Document::parse_in(text, folder, self.document.registry()), None);
                self.example = Some(name);
            }
            FileCommand::Close => {
                self.end_journal();
                self.over = true;
            }
        }
    }

    /// Switches to another document.
    fn start(&mut self, document: Document, saved: Option<String>) {
        self.end_gesture();
        (self.document, self.saved, self.unpacked, self.example) = (document, saved, None, None);
        self.number += 1;
        self.selection.clear();
        self.pinned = None;
        self.preferred.clear();
        self.nodes.clear();
        self.built.clear();
        // those of another graph would replace this one
        self.snapshots.clear();
        self.compare(None);
        self.end_journal();
        self.changed();
        self.watch_files();
        self.look_back();
        if self.document.has_errors() {
            let errors = self.document.problems().iter().filter(|problem| problem.severity == Severity::Error).count();
            let (title, errors) = (self.title(), counted(errors, "error"));
            self.note(format!("{title} has {errors} and cannot be built; the Problems pane lists them"), true);
        }
    }

    fn write(&mut self, path: &Path) -> bool {
        let guarded = path.metadata().is_ok_and(|data| data.permissions().readonly());
        let written = match guarded {
            true => Err("the file is write-protected".to_owned()),
            false => self.document.save(path).map_err(|error| reason(&error)),
        };
        match written {
            Ok(()) => self.know(Some(self.source().to_owned())),
            Err(ref why) => self.unsaved(path, why),
        }
        written.is_ok()
    }

    fn unsaved(&mut self, path: &Path, why: &str) {
        self.note(
            format!("`{}` was not saved: {why}. Your work is still open; save it elsewhere", path.display()),
            true,
        );
    }

    pub(super) fn source(&self) -> &str {
        self.document.source()
    }
}

/// The text of a file. Returns None when there is no file.
pub(super) fn read(path: &Path, document: &Document) -> Result<Option<String>, LoadError> {
    match Document::load(path, document.registry()) {
        Ok(read) => Ok(Some(read.source().to_owned())),
        Err(LoadError::Missing(_)) => Ok(None),
        Err(error) => Err(error),
    }
}
