//! The journal of a document: what is written down while it is edited, so that a crash loses nothing.
//!
//! A journal is a text of lines. Each is a checksum, a blank, and an [`Entry`] as JSON; the first entry is a
//! [`Entry::Start`] with the whole text and its history, the others are what happened since. A checksum is taken over the
//! line and all lines before it, so that a line that is torn, changed or of another journal ends what is read. Entries
//! hold bytes that were replaced, not edits, so that they mean the same to a program that knows other nodes.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::{Document, History, subgraph::Home};
use crate::{
    document::splice::{Splice, redo, undo},
    registry::Registry,
};

/// The newest form of journals that this program reads.
const FORMAT: u32 = 1;

/// What is written down of a document.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Entry {
    /// The document as it is, with its history.
    Start(Start),
    /// An edit was made: [`Document::apply`].
    Made(Vec<Splice>),
    /// An edit was made in place of the last one: [`Document::amend`].
    Amended(Vec<Splice>),
    /// The last edit is gone, and cannot be made again: [`Document::amend`] with what changes nothing.
    Dropped,
    /// [`Document::undo`].
    Undone,
    /// [`Document::redo`].
    Redone,
    /// The file is known to say this.
    File(OnDisk),
}

/// A document as it is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Start {
    format: u32,
    path: Option<PathBuf>,
    /// Where the files that it names are looked for, if it is in no file itself.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    folder: Option<PathBuf>,
    file: OnDisk,
    text: String,
    history: History,
}

/// What a file says, held against the document.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OnDisk {
    /// There is no file.
    Nothing,
    /// The same.
    Same,
    /// The same but for this.
    Other(Splice),
}

impl OnDisk {
    fn new(text: &str, saved: Option<&str>) -> Self {
        match saved {
            None => Self::Nothing,
            Some(saved) => Splice::between(text, saved).map_or(Self::Same, Self::Other),
        }
    }

    fn text(&self, text: &str) -> Option<Option<String>> {
        let mut said = text.to_owned();
        match self {
            Self::Nothing => Some(None),
            Self::Same => Some(Some(said)),
            Self::Other(splice) => splice.forth(&mut said).then_some(Some(said)),
        }
    }
}

impl Document {
    /// The entry that a journal begins with. `saved` is what the document's file says, if there is one.
    #[must_use]
    pub fn start_entry(&self, saved: Option<&str>) -> Entry {
        Entry::Start(Start {
            format: FORMAT,
            path: self.path().map(Path::to_owned),
            folder: self.path().is_none().then(|| std::path::absolute(self.folder().join(".")).ok()).flatten(),
            file: OnDisk::new(self.source(), saved),
            text: self.source().to_owned(),
            history: self.history.clone(),
        })
    }

    /// The entry of what the document's file is known to say.
    #[must_use]
    pub fn file_entry(&self, saved: Option<&str>) -> Entry {
        Entry::File(OnDisk::new(self.source(), saved))
    }

    /// What the last edit replaced, if there is one.
    #[must_use]
    pub fn last_edit(&self) -> Option<Vec<Splice>> {
        self.history.last().map(<[Splice]>::to_vec)
    }
}

/// Writes entries as lines of a journal.
#[derive(Clone, Debug)]
pub struct Scribe {
    before: blake3::Hash,
}

impl Default for Scribe {
    fn default() -> Self {
        Self { before: blake3::hash(b"orograph journal") }
    }
}

impl Scribe {
    /// The next line, with its line feed.
    #[must_use]
    pub fn line(&mut self, entry: &Entry) -> String {
        // Plain data: nothing in it can fail to be written.
        let json = serde_json::to_string(entry).unwrap_or_default();
        let sum = self.sum(&json);
        self.before = sum;
        format!("{} {json}\n", short(&sum))
    }

    fn sum(&self, json: &str) -> blake3::Hash {
        let mut hasher = blake3::Hasher::new();
        hasher.update(self.before.as_bytes()).update(json.as_bytes());
        hasher.finalize()
    }

    /// Reads a line without its line feed; `None` when it is not the next one.
    fn read(&mut self, line: &str) -> Option<Entry> {
        let (said, json) = line.split_once(' ')?;
        let sum = self.sum(json);
        if said != short(&sum) {
            return None;
        }
        let entry = serde_json::from_str(json).ok()?;
        self.before = sum;
        Some(entry)
    }
}

fn short(sum: &blake3::Hash) -> String {
    sum.to_hex()[..16].to_owned()
}

/// Why a journal cannot be read at all.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum JournalError {
    /// Not even its first line is whole, so that there is nothing in it.
    #[error("it holds nothing that can be read")]
    Nothing,
    /// It is of a newer program.
    #[error("it was written by a newer version of the program (form {0})")]
    Newer(u32),
}

/// What a journal holds.
#[derive(Clone, Debug)]
pub struct Recovered {
    /// The file that the work is of, as it was named then.
    pub path: Option<PathBuf>,
    /// The folder in which the files that it names were looked for, if it was in no file.
    pub folder: Option<PathBuf>,
    /// What was known that the file says; `None` where there was none.
    pub saved: Option<String>,
    /// The text as it was last.
    pub text: String,
    /// Its edits.
    pub history: History,
    /// Bytes of the journal that were read.
    pub read: usize,
    /// Whether there is more in it, which is damaged.
    pub torn: bool,
    /// Writes what comes after what was read.
    pub scribe: Scribe,
}

impl Recovered {
    /// Whether there is anything that the file does not say.
    #[must_use]
    pub fn has_work(&self) -> bool {
        match &self.saved {
            Some(saved) => *saved != self.text,
            None => self.path.is_some() || self.history.can_undo(),
        }
    }

    /// The document, with its history, as the text of a file; or, in no file, where it was.
    #[must_use]
    pub fn document(&self, path: Option<&Path>, registry: &Registry) -> Document {
        let nowhere = || Home { folder: self.folder.clone().unwrap_or_default(), ..Home::default() };
        let home = path.map_or_else(nowhere, Home::of_file);
        let mut document = Document::with_home(self.text.clone(), registry, home);
        document.history = self.history.clone();
        document
    }

    fn start(start: Start) -> Option<Self> {
        let saved = start.file.text(&start.text)?;
        let sound = start.history.fits(&start.text);
        let Start { path, folder, text, history, .. } = start;
        let recovered = Self { path, folder, saved, text, history, read: 0, torn: false, scribe: Scribe::default() };
        sound.then_some(recovered)
    }

    /// Does again what an entry says; says no, with everything as it was, when that does not fit.
    fn follow(&mut self, entry: Entry) -> bool {
        match entry {
            Entry::Start(_) => false,
            Entry::Made(splices) => {
                let fits = redo(&mut self.text, &splices);
                if fits {
                    self.history.made(splices);
                }
                fits
            }
            Entry::Amended(splices) => {
                let before = (self.text.clone(), self.history.clone());
                let fits = self.history.take_last(&mut self.text) && redo(&mut self.text, &splices);
                if fits {
                    self.history.made(splices);
                } else {
                    (self.text, self.history) = before;
                }
                fits
            }
            Entry::Dropped => self.history.take_last(&mut self.text),
            Entry::Undone => self.history.undo(&mut self.text),
            Entry::Redone => self.history.redo(&mut self.text),
            Entry::File(file) => match file.text(&self.text) {
                Some(saved) => {
                    self.saved = saved;
                    true
                }
                None => false,
            },
        }
    }
}

/// Reads a journal, whatever bytes it is of: up to its end, or to the first line that is torn or does not fit.
///
/// # Errors
/// [`JournalError`] when there is nothing in it that this program can read.
pub fn recover(journal: &[u8]) -> Result<Recovered, JournalError> {
    let mut scribe = Scribe::default();
    let mut recovered: Option<Recovered> = None;
    let mut read = 0;
    while let Some(length) = journal[read..].iter().position(|byte| *byte == b'\n') {
        let line = std::str::from_utf8(&journal[read..read + length]).ok();
        let Some(entry) = line.and_then(|line| scribe.read(line)) else { break };
        let fits = match (&mut recovered, entry) {
            (None, Entry::Start(start)) if start.format > FORMAT => return Err(JournalError::Newer(start.format)),
            (None, Entry::Start(start)) => {
                recovered = Recovered::start(start);
                true
            }
            (Some(recovered), entry) => recovered.follow(entry),
            (None, _) => false,
        };
        let Some(recovered) = recovered.as_mut().filter(|_| fits) else { break };
        read += length + 1;
        (recovered.read, recovered.scribe) = (read, scribe.clone());
    }
    let mut recovered = recovered.ok_or(JournalError::Nothing)?;
    recovered.torn = read < journal.len();
    Ok(recovered)
}

impl History {
    /// Whether the edits lead from and to a text.
    fn fits(&self, text: &str) -> bool {
        let (mut back, mut forth) = (text.to_owned(), text.to_owned());
        self.done().iter().rev().all(|step| undo(&mut back, step))
            && self.undone().iter().rev().all(|step| redo(&mut forth, step))
    }
}
