//! The journal of a session, and the recovery of unsaved work of earlier sessions.

use std::{sync::PoisonError, time::SystemTime};

use orograph_graph::{Document, JournalEntry, diff};

use super::{Journals, Session, files::Question, journal::Found, unpacked::Unpacked};
use crate::report::failure::reason;

/// Maximum number of differences that are listed.
const MAX_DIFFERENCES: usize = 200;

/// Unsaved work of an earlier session.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Lost {
    /// When it was last edited.
    pub when: SystemTime,
    /// The number of edits that can be undone.
    pub steps: usize,
    /// The changes to the file, as text.
    pub differences: Vec<String>,
    /// True if the file has changed since.
    pub changed_since: bool,
    /// True if the end of its journal is damaged, so that the last edits may be missing.
    pub torn: bool,
}

impl Session {
    /// Starts to keep a journal of all edits, asks about unsaved work of earlier sessions, and follows changes by other
    /// programs. Calls `wake` when [`Session::poll`] has something new.
    pub fn keep(&mut self, journals: Journals, wake: impl Fn() + Send + 'static) {
        self.safety.journals = Some(journals);
        self.start_watch(wake);
        self.look_back();
    }

    /// Adds the last edit to the journal, if one was made.
    pub(super) fn made(&mut self, edits_before: usize) {
        if self.document.edits() != edits_before {
            let entry = self.document.last_edit().map(JournalEntry::Made);
            self.record(entry);
        }
    }

    /// Adds a change of the document to the journal.
    pub(super) fn record(&mut self, entry: Option<JournalEntry>) {
        let (Some(entry), Some(journals)) = (entry, &self.safety.journals) else { return };
        if let Some(journal) = &self.safety.journal {
            journal.write(entry);
            return;
        }
        let start = self.document.start_entry(self.saved.as_deref());
        match journals.begin(self.document.path(), start, self.safety.trouble.clone()) {
            Ok(journal) => {
                self.safety.journal = Some(journal);
                self.unpacked.iter().for_each(Unpacked::need);
            }
            Err(error) => {
                *self.safety.trouble.lock().unwrap_or_else(PoisonError::into_inner) = Some(reason(&error));
            }
        }
    }

    /// Sets the text that the file is known to have.
    pub(super) fn know(&mut self, saved: Option<String>) {
        if let Some(journal) = &self.safety.journal {
            journal.write(self.document.file_entry(saved.as_deref()));
        }
        self.saved = saved;
    }

    /// Ends the journal: all work is saved or discarded.
    pub(super) fn end_journal(&mut self) {
        if let Some(journal) = self.safety.journal.take() {
            journal.remove();
        }
    }

    /// Reports once that the journal cannot be written.
    pub(super) fn tell_trouble(&mut self) {
        let trouble = self.safety.trouble.lock().unwrap_or_else(PoisonError::into_inner).clone();
        if trouble != self.safety.reported {
            if let Some(why) = &trouble {
                self.note(format!("Crash recovery is off: {why}. Save often."), true);
            }
            self.safety.reported = trouble;
        }
    }

    /// Looks for unsaved work of earlier sessions on the open document.
    pub(super) fn look_back(&mut self) {
        self.safety.found.clear();
        let Some(journals) = &self.safety.journals else { return };
        let left = journals.look(self.document.path());
        if left.in_use && self.path().is_some() {
            self.note("another window has this file open; neither overwrites the other's changes without asking", true);
        }
        for (path, error) in left.unread {
            self.note(
                format!("cannot read the journal of unsaved work `{}`, which is kept: {error}", path.display()),
                true,
            );
        }
        for found in left.found {
            if found.recovered.has_work() && found.recovered.text != self.source() {
                self.safety.found.push(found);
            } else {
                discard(found);
            }
        }
        self.ask_found();
    }

    fn ask_found(&mut self) {
        let Some(found) = self.safety.found.first() else { return };
        let work = found.recovered.document(self.path(), self.document.registry());
        let mut differences = diff(&self.document, &work);
        if differences.is_empty() {
            differences.push("only comments, white space, node positions or frames".to_owned());
        }
        if differences.len() > MAX_DIFFERENCES {
            let more = differences.len() - MAX_DIFFERENCES;
            differences.truncate(MAX_DIFFERENCES);
            differences.push(format!("and {more} more"));
        }
        self.question = Some(Question::Found(Lost {
            when: found.when,
            steps: work.steps(),
            differences,
            changed_since: found.recovered.saved != self.saved,
            torn: found.recovered.torn,
        }));
    }

    fn next_found(&mut self) -> Option<Found> {
        (!self.safety.found.is_empty()).then(|| self.safety.found.remove(0))
    }

    /// Recovers the work of an earlier session.
    pub(super) fn recover(&mut self) {
        let Some(found) = self.next_found() else { return };
        // The others are offered at a later start.
        self.safety.found.clear();
        let work: Document = found.recovered.document(self.path(), self.document.registry());
        self.unpacked = found.recovered.folder.as_deref().and_then(Unpacked::left);
        let (file, known) = (self.saved.take(), found.recovered.saved.clone());
        match found.recover(self.safety.trouble.clone()) {
            Ok(journal) => self.safety.journal = Some(journal),
            Err(error) => self.note(format!("Crash recovery is off: {}. Save often.", reason(&error)), true),
        }
        (self.document, self.saved) = (work, known);
        self.preferred.clear();
        self.changed();
        self.watch_files();
        if let Some(theirs) = file.filter(|file| self.saved.as_ref() != Some(file)) {
            self.meet(theirs, false);
        }
    }

    /// Discards the work of an earlier session.
    pub(super) fn forget_found(&mut self) {
        if let Some(found) = self.next_found() {
            discard(found);
        }
        self.ask_found();
    }

    /// Leaves the work of an earlier session for a later start.
    pub(super) fn leave_found(&mut self) {
        drop(self.next_found());
        self.ask_found();
    }
}

/// Discards the work of an earlier session, with the files of its archive.
fn discard(found: Found) {
    drop(found.recovered.folder.as_deref().and_then(Unpacked::left));
    found.discard();
}

impl Drop for Session {
    /// Keeps the journal of unsaved work, and the files that it needs.
    fn drop(&mut self) {
        if !self.is_dirty() {
            self.end_journal();
        } else if self.safety.journal.is_some()
            && let Some(unpacked) = self.unpacked.take()
        {
            unpacked.leave();
        }
    }
}
