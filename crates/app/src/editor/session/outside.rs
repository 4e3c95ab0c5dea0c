//! Changes of the file by other programs: they are loaded, merged with the work, or asked about, and never overwritten
//! unnoticed.

use std::{path::Path, time::Duration};

use super::{
    Session,
    files::{Question, read},
};
use crate::files::{read_by, watch::Watch};

impl Session {
    /// Starts to watch the file and the files that the graph reads.
    pub(super) fn watch_files(&mut self) {
        let Some(watch) = &mut self.safety.watch else { return };
        let mut files = read_by(&self.document);
        files.extend(self.document.path().map(Path::to_owned));
        let failed = files.difference(&self.safety.watched).find_map(|file| watch.add(file).err());
        self.safety.watched = files;
        if let Some(failure) = failed {
            self.unwatched(&failure.message);
        }
    }

    pub(super) fn start_watch(&mut self, wake: impl Fn() + Send + 'static) {
        match Watch::new(wake) {
            Ok(watch) => self.safety.watch = Some(watch),
            Err(failure) => self.unwatched(&failure.message),
        }
        self.watch_files();
    }

    fn unwatched(&mut self, why: &str) {
        self.safety.watch = None;
        self.note(format!("{why}; changes by other programs are noticed only when you save"), false);
    }

    /// Handles changes by other programs.
    pub(super) fn look_outside(&mut self) {
        let mut broken = None;
        let own = self.path().map(Path::to_owned);
        if let Some(watch) = &mut self.safety.watch {
            let changed = &mut self.safety.changed;
            loop {
                match watch.poll(Duration::ZERO) {
                    Ok(files) if files.is_empty() => break,
                    Ok(files) => files.iter().for_each(|file| changed[usize::from(Some(file) != own.as_ref())] = true),
                    Err(failure) => {
                        broken = Some(failure.message);
                        break;
                    }
                }
            }
        }
        if let Some(why) = broken {
            self.unwatched(&why);
        }
        // Not during a drag, and not while a question is open.
        if self.gesture.is_some() || self.question.is_some() {
            return;
        }
        let [own, read_by_graph] = std::mem::take(&mut self.safety.changed);
        if read_by_graph {
            // The problems of these files may have changed, and so have the results.
            self.document.look_again();
            self.changed();
        }
        if own && let Some(path) = self.path().map(Path::to_owned) {
            match read(&path, &self.document) {
                Ok(Some(theirs)) if self.saved.as_ref() != Some(&theirs) => {
                    self.meet(theirs, false);
                }
                Ok(Some(_)) => {}
                // Some programs remove the file before they save it.
                Ok(None) => {}
                Err(error) => self.note(error.to_string(), true),
            }
        }
    }

    /// Merges the work with the new text of the file. Returns false if there are conflicts that you must resolve.
    pub(super) fn meet(&mut self, theirs: String, saving: bool) -> bool {
        let name = self.path().and_then(Path::file_name).unwrap_or_default().to_string_lossy().into_owned();
        if theirs == self.source() {
            self.know(Some(theirs));
        } else if !self.is_dirty() {
            self.take(theirs);
            self.note(format!("`{name}` changed on disk and was reloaded"), false);
        } else {
            let merged = match &self.saved {
                Some(base) => self.document.merge(base, &theirs),
                None => Err(Vec::new()),
            };
            match merged {
                Ok(merged) => {
                    self.replace(&merged);
                    self.know(Some(theirs));
                    self.note(format!("`{name}` changed on disk; its changes were merged with yours"), false);
                }
                Err(conflicts) => {
                    self.question = Some(Question::Changed { theirs, conflicts, saving });
                    return false;
                }
            }
        }
        true
    }
}
