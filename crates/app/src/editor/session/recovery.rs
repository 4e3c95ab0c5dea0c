//! The journal of a session, and work of earlier times that was not saved.

use std::{sync::PoisonError, time::SystemTime};

use orograph_graph::{Document, Entry, diff};

use super::{Journals, Session, files::Question, journal::Found, unpacked::Unpacked};
use crate::failure::reason;

/// The most differences that are told.
const MAX_DIFFERENCES: usize = 200;

/// Work of an earlier time that was not saved.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Lost {
    /// When it was edited last.
    pub when: SystemTime,
    /// How many edits can be taken back.
    pub steps: usize,
    /// What it changes in the file, in words.
    pub differences: Vec<String>,
    /// Whether the file has been changed since.
    pub changed_since: bool,
    /// Whether the end of its journal is damaged, so that the last edits may be missing.
    pub torn: bool,
}

impl Session {
    /// Keeps a journal of all edits from now on, asks about work of earlier times, and follows what other programs change.
    /// `wake` is called when there is something new to [`Session::poll`] for.
    pub fn keep(&mut self, journals: Journals, wake: impl Fn() + Send + 'static) {
        self.safety.journals = Some(journals);
        self.start_watch(wake);
        self.look_back();
    }

    /// Writes down that an edit was made, if one was.
    pub(super) fn made(&mut self, steps_before: usize) {
        if self.document.steps() != steps_before {
            let entry = self.document.last_edit().map(Entry::Made);
            self.record(entry);
        }
    }

    /// Writes down what has happened to the document.
    pub(super) fn record(&mut self, entry: Option<Entry>) {
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

    /// What the file is known to say from now on.
    pub(super) fn know(&mut self, saved: Option<String>) {
        if let Some(journal) = &self.safety.journal {
            journal.write(self.document.file_entry(saved.as_deref()));
        }
        self.saved = saved;
    }

    /// All is saved, or given up.
    pub(super) fn end_journal(&mut self) {
        if let Some(journal) = self.safety.journal.take() {
            journal.remove();
        }
    }

    /// Tells the person, once, when the journal cannot be written.
    pub(super) fn tell_trouble(&mut self) {
        let trouble = self.safety.trouble.lock().unwrap_or_else(PoisonError::into_inner).clone();
        if trouble != self.safety.told {
            if let Some(why) = &trouble {
                self.note(format!("the work is not kept against a crash: {why}; save it from time to time"), true);
            }
            self.safety.told = trouble;
        }
    }

    /// Looks for work of earlier times on what is open.
    pub(super) fn look_back(&mut self) {
        self.safety.found.clear();
        let Some(journals) = &self.safety.journals else { return };
        let left = journals.look(self.document.path());
        if left.in_use && self.path().is_some() {
            self.note(
                "another window is open on this file; neither writes over what the other saves without asking",
                true,
            );
        }
        for (path, error) in left.unread {
            self.note(format!("a journal of unsaved work, `{}`, is left as it is: {error}", path.display()), true);
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
            differences.push("only comments, white space, places on the canvas or frames".to_owned());
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

    /// Goes on with work of an earlier time.
    pub(super) fn take_up(&mut self) {
        let Some(found) = self.next_found() else { return };
        // The others wait for another time.
        self.safety.found.clear();
        let work: Document = found.recovered.document(self.path(), self.document.registry());
        self.unpacked = found.recovered.folder.as_deref().and_then(Unpacked::left);
        let (file, known) = (self.saved.take(), found.recovered.saved.clone());
        match found.take_up(self.safety.trouble.clone()) {
            Ok(journal) => self.safety.journal = Some(journal),
            Err(error) => self.note(format!("no journal is kept: {}", reason(&error)), true),
        }
        (self.document, self.saved) = (work, known);
        self.changed();
        self.watch_files();
        if let Some(theirs) = file.filter(|file| self.saved.as_ref() != Some(file)) {
            self.meet(theirs, false);
        }
    }

    /// Gives work of an earlier time up.
    pub(super) fn forget_found(&mut self) {
        if let Some(found) = self.next_found() {
            discard(found);
        }
        self.ask_found();
    }

    /// Leaves work of an earlier time for another day.
    pub(super) fn leave_found(&mut self) {
        drop(self.next_found());
        self.ask_found();
    }
}

/// Gives work of an earlier time up, with the files of the archive that it was of.
fn discard(found: Found) {
    drop(found.recovered.folder.as_deref().and_then(Unpacked::left));
    found.discard();
}

impl Drop for Session {
    /// The journal stays where work is not saved, with what it needs.
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
