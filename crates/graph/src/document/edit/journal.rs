//! The journal of a document: a record of its edits, so that a crash loses no work.
//!
//! A journal is a text of lines. Each line is a checksum, a space, and a [`JournalEntry`] as JSON. The first entry is a
//! [`JournalEntry::Start`] with the whole text and its history; the others record the changes since. A checksum covers
//! its line and all lines before it, so that reading ends at a line that is incomplete, changed or from another
//! journal. Entries contain replaced bytes instead of edits, so that they mean the same to a program with other nodes.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::document::{Document, History, subgraph::Home};
use crate::{
    document::syntax::splice::{Splice, redo, undo},
    registry::Registry,
};

/// The newest version of the journal format that this program reads.
const FORMAT: u32 = 1;

/// An entry of a journal.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum JournalEntry {
    /// The document with its history.
    Start(Start),
    /// An edit was applied: [`Document::apply`].
    Made(Vec<Splice>),
    /// An edit replaced the last one: [`Document::amend`].
    Amended(Vec<Splice>),
    /// The last edit is gone and cannot be redone: [`Document::amend`] with an edit that changes nothing.
    Dropped,
    /// [`Document::undo`].
    Undone,
    /// [`Document::redo`].
    Redone,
    /// The known contents of the file.
    File(OnDisk),
}

/// A document with its history.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Start {
    format: u32,
    path: Option<PathBuf>,
    /// The folder that file names are relative to, if the document has no file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    folder: Option<PathBuf>,
    file: OnDisk,
    text: String,
    history: History,
}

/// The contents of a file, compared with the document.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OnDisk {
    /// There is no file.
    Nothing,
    /// The same text.
    Same,
    /// The same text except for this splice.
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
    /// The first entry of a journal. `saved` is the contents of the document's file, if there is one.
    #[must_use]
    pub fn start_entry(&self, saved: Option<&str>) -> JournalEntry {
        JournalEntry::Start(Start {
            format: FORMAT,
            path: self.path().map(Path::to_owned),
            folder: self.path().is_none().then(|| std::path::absolute(self.folder().join(".")).ok()).flatten(),
            file: OnDisk::new(self.source(), saved),
            text: self.source().to_owned(),
            history: self.history.clone(),
        })
    }

    /// The entry for the known contents of the document's file.
    #[must_use]
    pub fn file_entry(&self, saved: Option<&str>) -> JournalEntry {
        JournalEntry::File(OnDisk::new(self.source(), saved))
    }

    /// The bytes that the last edit replaced. Returns None when there is no edit.
    #[must_use]
    pub fn last_edit(&self) -> Option<Vec<Splice>> {
        self.history.last().map(<[Splice]>::to_vec)
    }
}

/// Writes entries as lines of a journal.
#[derive(Clone, Debug)]
pub struct JournalWriter {
    before: blake3::Hash,
}

impl Default for JournalWriter {
    fn default() -> Self {
        Self { before: blake3::hash(b"orograph journal") }
    }
}

impl JournalWriter {
    /// The next line, with its line feed.
    #[must_use]
    pub fn line(&mut self, entry: &JournalEntry) -> String {
        // Plain data: serialization cannot fail.
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

    /// Reads a line without its line feed. Returns None when it is not the next line of the journal.
    fn read(&mut self, line: &str) -> Option<JournalEntry> {
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

/// Why a journal cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum JournalError {
    /// Its first line is incomplete, so it contains nothing.
    #[error("it contains nothing that can be read")]
    Nothing,
    /// A newer version of the program wrote it.
    #[error("it was written by a newer version of the program (format {0})")]
    Newer(u32),
}

/// The contents of a journal.
#[derive(Clone, Debug)]
pub struct Recovered {
    /// The path of the document's file, as it was then.
    pub path: Option<PathBuf>,
    /// The folder that file names were relative to, if the document had no file.
    pub folder: Option<PathBuf>,
    /// The known contents of the file; `None` when there was none.
    pub saved: Option<String>,
    /// The last text of the document.
    pub text: String,
    /// Its undo history.
    pub history: History,
    /// Number of bytes of the journal that were read.
    pub read: usize,
    /// True if more bytes follow, which are damaged.
    pub torn: bool,
    /// Writes the lines after those that were read.
    pub writer: JournalWriter,
}

impl Recovered {
    /// Returns true if there are changes that the file does not contain.
    #[must_use]
    pub fn has_work(&self) -> bool {
        match &self.saved {
            Some(saved) => *saved != self.text,
            None => self.path.is_some() || self.history.can_undo(),
        }
    }

    /// The document, with its history, as the text of a file; without a file, in its folder.
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
        let recovered =
            Self { path, folder, saved, text, history, read: 0, torn: false, writer: JournalWriter::default() };
        sound.then_some(recovered)
    }

    /// Replays an entry. Returns false, with everything unchanged, when it does not fit.
    fn follow(&mut self, entry: JournalEntry) -> bool {
        match entry {
            JournalEntry::Start(_) => false,
            JournalEntry::Made(splices) => {
                let fits = redo(&mut self.text, &splices);
                if fits {
                    self.history.made(splices);
                }
                fits
            }
            JournalEntry::Amended(splices) => {
                let before = (self.text.clone(), self.history.clone());
                let fits = self.history.take_last(&mut self.text) && redo(&mut self.text, &splices);
                if fits {
                    self.history.made(splices);
                } else {
                    (self.text, self.history) = before;
                }
                fits
            }
            JournalEntry::Dropped => self.history.take_last(&mut self.text),
            JournalEntry::Undone => self.history.undo(&mut self.text),
            JournalEntry::Redone => self.history.redo(&mut self.text),
            JournalEntry::File(file) => match file.text(&self.text) {
                Some(saved) => {
                    self.saved = saved;
                    true
                }
                None => false,
            },
        }
    }
}

/// Reads a journal from any bytes: up to its end, or to the first line that is damaged or does not fit.
///
/// # Errors
/// [`JournalError`] when it contains nothing that this program can read.
pub fn recover(journal: &[u8]) -> Result<Recovered, JournalError> {
    let mut writer = JournalWriter::default();
    let mut recovered: Option<Recovered> = None;
    let mut read = 0;
    while let Some(length) = journal[read..].iter().position(|byte| *byte == b'\n') {
        let line = std::str::from_utf8(&journal[read..read + length]).ok();
        let Some(entry) = line.and_then(|line| writer.read(line)) else { break };
        let fits = match (&mut recovered, entry) {
            (None, JournalEntry::Start(start)) if start.format > FORMAT => {
                return Err(JournalError::Newer(start.format));
            }
            (None, JournalEntry::Start(start)) => {
                recovered = Recovered::start(start);
                true
            }
            (Some(recovered), entry) => recovered.follow(entry),
            (None, _) => false,
        };
        let Some(recovered) = recovered.as_mut().filter(|_| fits) else { break };
        read += length + 1;
        (recovered.read, recovered.writer) = (read, writer.clone());
    }
    let mut recovered = recovered.ok_or(JournalError::Nothing)?;
    recovered.torn = read < journal.len();
    Ok(recovered)
}

impl History {
    /// Returns true if the edits fit a text, in both directions.
    fn fits(&self, text: &str) -> bool {
        let (mut back, mut forth) = (text.to_owned(), text.to_owned());
        self.done().iter().rev().all(|step| undo(&mut back, step))
            && self.undone().iter().rev().all(|step| redo(&mut forth, step))
    }
}
