//! The file of a session: saving, opening another, and what is asked of the person before work could be lost.

use std::path::{Path, PathBuf};

use orograph_graph::{Document, LoadError, Registry};

use super::{
    Lost, Session,
    unpacked::{Unpacked, take_along},
};
use crate::{
    archive::is_archive,
    failure::{Failure, reason},
};

/// What a person wants that takes the present work out of the window.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Wish {
    /// An empty graph.
    New,
    /// Another file.
    Open(PathBuf),
    /// A copy of an example, which is in no file.
    Copy {
        /// What the example is called.
        name: String,
        /// What it says.
        text: String,
        /// The folder in which the files that it names lie.
        folder: PathBuf,
    },
    /// The end of the window.
    Close,
}

/// What the person must decide before anything else.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Question {
    /// There is unsaved work, which the wish would take out of the window.
    Unsaved(Wish),
    /// The work needs the name of a file.
    Name,
    /// The file says something else than what was read from it, and there is unsaved work that does not go together with
    /// that.
    Changed {
        /// What it says now.
        theirs: String,
        /// What both have changed, such as `rivers.duration`.
        conflicts: Vec<String>,
        /// Whether the work was about to be saved.
        saving: bool,
    },
    /// There is work of an earlier time that was not saved.
    Found(Lost),
}

/// What the person decides.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    /// Nothing is to happen.
    Cancel,
    /// The work is saved in its file.
    Save,
    /// The work is saved in this file.
    SaveAs(PathBuf),
    /// The work is given up.
    Discard,
    /// The work of an earlier time is gone on with.
    TakeUp,
    /// The work takes the place of what the file says, at once where it was about to be saved.
    KeepMine,
    /// What the file says takes the place of the work, which undo brings back.
    TakeTheirs,
}

/// A file that was opened.
pub(super) struct Opened {
    pub(super) document: Document,
    /// What the file says; nothing for a copy.
    pub(super) saved: Option<String>,
    /// Where the files of an archive are.
    pub(super) unpacked: Option<Unpacked>,
}

impl Opened {
    /// Reads a graph file; of an archive a copy that is in no file, so that saving asks for a name and takes the names of the
    /// archive's files along.
    ///
    /// # Errors
    /// When it cannot be read, or an archive cannot be trusted.
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
    /// Whether there is work that is not in the file.
    #[must_use]
    pub fn is_dirty(&self) -> bool {
        match &self.saved {
            Some(saved) => *saved != self.document.source(),
            None => self.path().is_some() || self.document.can_undo(),
        }
    }

    /// What the person must decide before anything else, if anything.
    #[must_use]
    pub const fn question(&self) -> Option<&Question> {
        self.question.as_ref()
    }

    /// Whether the person is done with the window, and nothing is lost by closing it.
    #[must_use]
    pub const fn is_over(&self) -> bool {
        self.over
    }

    /// Saves the work in its file. Says whether it is saved; if not, a question is asked or a note tells why.
    ///
    /// A file that says something else than what was read from it is not written over without being asked about.
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

    /// Saves the work in another file, which is its file from then on. Names of files that it reads follow; files that a copy
    /// out of an archive or of an example reads come along. Says whether it is saved; if not, a note tells why, and
    /// everything is as it was.
    pub fn save_as(&mut self, path: &Path) -> bool {
        let path = if path.extension().is_some() { path.to_owned() } else { path.with_extension("ron") };
        let before = self.document.clone();
        self.end_gesture();
        let taken = match take_along(&self.document, &path) {
            Ok(taken) => taken,
            Err(error) => {
                self.unsaved(&path, &format!("the files that it reads cannot be taken along: {}", reason(&error)));
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
                self.note(format!("what the graph reads is saved with it: {}", names.join(", ")), false);
            } else if moved {
                self.note("the names of the files that the graph reads follow it to its new folder", false);
            }
            // The next edit begins a journal where the file is now.
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

    /// Asks for the name of a file to save the work in.
    pub fn ask_name(&mut self) {
        self.question = Some(Question::Name);
    }

    /// Does what takes the present work out of the window; asks first where that is not saved.
    pub fn wish(&mut self, wish: Wish) {
        self.end_gesture();
        if self.is_dirty() {
            self.question = Some(Question::Unsaved(wish));
        } else {
            self.grant(wish);
        }
    }

    /// Takes what the person decided on [`Self::question`].
    pub fn answer(&mut self, answer: Answer) {
        let Some(question) = self.question.take() else { return };
        match (question, answer) {
            (Question::Found(_), Answer::Cancel) => self.leave_found(),
            (_, Answer::Cancel) => self.wish = None,
            (Question::Unsaved(wish), Answer::Save) => {
                self.wish = Some(wish);
                self.save();
            }
            (Question::Unsaved(wish), Answer::Discard) => self.grant(wish),
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
            (Question::Changed { theirs, .. }, Answer::TakeTheirs) => self.take(theirs),
            (Question::Found(_), Answer::TakeUp) => self.take_up(),
            (Question::Found(_), Answer::Discard) => self.forget_found(),
            (question, _) => self.question = Some(question),
        }
        if let Some(wish) = self.wish.take_if(|_| self.question.is_none()) {
            // Only what has been saved may go.
            if !self.is_dirty() {
                self.grant(wish);
            }
        }
    }

    /// Takes what the file says in place of the work, as one step for undo. Says whether it could be read.
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

    /// Takes what the file says in place of the work, as one step for undo.
    pub(super) fn take(&mut self, theirs: String) {
        self.replace(&theirs);
        self.know(Some(theirs));
    }

    /// Puts another text in place of the work, as one step for undo.
    pub(super) fn replace(&mut self, text: &str) {
        self.end_gesture();
        let before = self.document.steps();
        self.document.replace(text);
        self.made(before);
        self.changed();
    }

    fn grant(&mut self, wish: Wish) {
        match wish {
            Wish::New => self.start(Document::empty(self.document.registry()), None),
            Wish::Open(path) => match Opened::new(&path, self.document.registry()) {
                Ok(Opened { document, saved, unpacked }) => {
                    self.start(document, saved);
                    self.unpacked = unpacked;
                }
                Err(failure) => self.note(failure.to_string(), true),
            },
            Wish::Copy { name, text, folder } => {
                self.start(Document::parse_in(text, folder, self.document.registry()), None);
                self.example = Some(name);
            }
            Wish::Close => {
                self.end_journal();
                self.over = true;
            }
        }
    }

    /// Goes on with another document.
    fn start(&mut self, document: Document, saved: Option<String>) {
        self.end_gesture();
        (self.document, self.saved, self.unpacked, self.example) = (document, saved, None, None);
        self.selection.clear();
        self.pinned = None;
        self.nodes.clear();
        self.built.clear();
        self.end_journal();
        self.changed();
        self.watch_files();
        self.look_back();
    }

    fn write(&mut self, path: &Path) -> bool {
        let guarded = path.metadata().is_ok_and(|data| data.permissions().readonly());
        let written = match guarded {
            true => Err("it is write-protected".to_owned()),
            false => self.document.save(path).map_err(|error| reason(&error)),
        };
        match written {
            Ok(()) => self.know(Some(self.source().to_owned())),
            Err(ref why) => self.unsaved(path, why),
        }
        written.is_ok()
    }

    fn unsaved(&mut self, path: &Path, why: &str) {
        self.note(format!("`{}` is not saved: {why}. The work stays here; save it elsewhere", path.display()), true);
    }

    pub(super) fn source(&self) -> &str {
        self.document.source()
    }
}

/// What a file says; nothing where there is none.
pub(super) fn read(path: &Path, document: &Document) -> Result<Option<String>, LoadError> {
    match Document::load(path, document.registry()) {
        Ok(read) => Ok(Some(read.source().to_owned())),
        Err(LoadError::Missing(_)) => Ok(None),
        Err(error) => Err(error),
    }
}
