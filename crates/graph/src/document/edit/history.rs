//! Applying edits, undo and redo.

use std::{
    collections::{BTreeMap, VecDeque},
    sync::Arc,
};

use serde::{Deserialize, Serialize};

use super::{Edit, EditError, editor::Editor};
use crate::document::{
    Document,
    check::problems::MORE,
    read::{Parsed, Read},
    subgraph::{FILE, Loader},
    syntax::{
        lex::quote,
        splice::{Draft, Splice, redo, undo},
    },
};
use crate::{
    diagnostic::{Diagnostic, Severity},
    param::ParamValue,
};

/// Size limit of the undo history in bytes. A day's work takes a few of these megabytes; beyond the limit, the oldest
/// edits are forgotten.
const MAX_BYTES: usize = 256 << 20;

/// Edits that were applied and edits that were undone, each as the bytes it replaced.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct History {
    done: VecDeque<Vec<Splice>>,
    undone: Vec<Vec<Splice>>,
    /// Size of the applied edits in bytes.
    #[serde(skip)]
    bytes: usize,
    /// Number of edits that were forgotten.
    #[serde(skip)]
    forgotten: usize,
    /// Number of edits that were ever made.
    #[serde(skip)]
    made: usize,
}

impl History {
    /// Number of edits that can be undone.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.done.len()
    }

    /// Number of edits, with those that were forgotten: it grows with each new one.
    #[must_use]
    pub fn edits(&self) -> usize {
        self.forgotten + self.done.len()
    }

    /// Returns true if there is an edit to undo.
    #[must_use]
    pub fn can_undo(&self) -> bool {
        !self.done.is_empty()
    }

    pub(crate) const fn done(&self) -> &VecDeque<Vec<Splice>> {
        &self.done
    }

    pub(crate) fn undone(&self) -> &[Vec<Splice>] {
        &self.undone
    }

    pub(crate) fn last(&self) -> Option<&[Splice]> {
        self.done.back().map(Vec::as_slice)
    }

    /// Records a new edit; undone edits can no longer be redone.
    pub(crate) fn made(&mut self, step: Vec<Splice>) {
        self.undone.clear();
        self.made += 1;
        self.push(step);
    }

    fn push(&mut self, step: Vec<Splice>) {
        self.bytes += weight(&step);
        self.done.push_back(step);
        while self.bytes > MAX_BYTES
            && self.done.len() > 1
            && let Some(oldest) = self.done.pop_front()
        {
            self.bytes = self.bytes.saturating_sub(weight(&oldest));
            self.forgotten += 1;
        }
    }

    fn pop(&mut self) -> Option<Vec<Splice>> {
        let step = self.done.pop_back()?;
        self.bytes = self.bytes.saturating_sub(weight(&step));
        Some(step)
    }

    /// Reverts the last edit in a text and forgets it. Returns false when there is none, or it does not fit.
    pub(crate) fn take_last(&mut self, text: &mut String) -> bool {
        let Some(step) = self.pop() else { return false };
        let fits = undo(text, &step);
        if !fits {
            self.push(step);
        }
        fits
    }

    /// Reverts the last edit in a text. Returns false when there is none, or it does not fit.
    pub(crate) fn undo(&mut self, text: &mut String) -> bool {
        let step = self.last().map(<[Splice]>::to_vec);
        let undone = self.take_last(text);
        self.undone.extend(step.filter(|_| undone));
        undone
    }

    /// Reapplies the edit that was undone last. Returns false when there is none, or it does not fit.
    pub(crate) fn redo(&mut self, text: &mut String) -> bool {
        let fits = self.undone.last().is_some_and(|step| redo(text, step));
        if fits && let Some(step) = self.undone.pop() {
            self.push(step);
        }
        fits
    }
}

fn weight(step: &[Splice]) -> usize {
    size_of::<Vec<Splice>>() + step.iter().map(Splice::bytes).sum::<usize>()
}

impl Document {
    /// Applies an edit. Everything else in the text is preserved to the byte. An edit that changes nothing adds no step
    /// for [`Self::undo`].
    ///
    /// A file may have problems before and after the edit, but the edit must not add one, except that an input may lack
    /// its wire or a `Subgraph` its file while a graph is being made.
    ///
    /// # Errors
    /// [`EditError`] with the reason, when the file would become invalid; the document is then unchanged.
    pub fn apply(&mut self, edit: &Edit) -> Result<(), EditError> {
        let from = Arc::clone(&self.read);
        if let Some((read, step)) = self.edited(&from, edit)? {
            self.read = read;
            self.before = Some(from);
            self.history.made(step);
        }
        Ok(())
    }

    /// Applies an edit that replaces the last one, as while a slider is dragged: both are one step for [`Self::undo`].
    ///
    /// # Errors
    /// As [`Self::apply`], which is used when there is no last edit; the document is then unchanged.
    pub fn amend(&mut self, edit: &Edit) -> Result<(), EditError> {
        let Some(from) = self.before_last() else { return self.apply(edit) };
        let made = self.edited(&from, edit)?;
        self.history.pop();
        match made {
            Some((read, step)) => {
                self.read = read;
                self.before = Some(from);
                self.history.made(step);
            }
            None => {
                self.read = from;
                self.before = None;
            }
        }
        Ok(())
    }

    /// The text before the last edit. Returns None when there is no edit.
    fn before_last(&mut self) -> Option<Arc<Read>> {
        let last = self.history.last()?;
        if self.before.is_none() {
            let mut source = self.source().to_owned();
            // A step always fits the text that it led to.
            undo(&mut source, last);
            self.before = Some(Arc::new(self.read_text(source)));
        }
        self.before.clone()
    }

    /// Applies an edit to a text; returns the result and the replaced bytes, or None when nothing changes.
    fn edited(&mut self, from: &Read, edit: &Edit) -> Result<Option<Made>, EditError> {
        if let Some(problem) = from.checked.problems.iter().find(|problem| problem.code == "syntax") {
            return Err(EditError::Notation(problem.message.clone()));
        }
        let mut draft = Draft::of(&from.source, Some(&from.parsed));
        let carried_out = edit.carry_out(&mut draft, &self.registry, &self.home);
        let unchanged = carried_out.is_err() || draft.source == from.source;
        let parsed = if unchanged { Arc::clone(&from.parsed) } else { Arc::clone(draft.parsed()) };
        self.parsed += draft.parses();
        carried_out?;
        if unchanged {
            return Ok(None);
        }
        let read = self.check(draft.source, parsed, Some(&self.read));
        // Problems that come from changes in other files do not count. An edit of this text alone leaves those files
        // unchanged.
        let now = (!from.checked.uses.is_empty() && !from.reads_as(&read))
            .then(|| self.check(from.source.clone(), Arc::clone(&from.parsed), None));
        let before = now.as_ref().unwrap_or(from);
        if let Some(problem) = added(&before.checked.problems, &read.checked.problems, edit.renames()) {
            return Err(EditError::Refused { message: problem.message.clone(), hint: problem.hint.clone() });
        }
        Ok(Some((Arc::new(read), draft.splices)))
    }

    /// Number of edits that can be undone.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.history.steps()
    }

    /// Number of edits that are done, with those that are too old to be undone.
    #[must_use]
    pub fn edits(&self) -> usize {
        self.history.edits()
    }

    /// Number of edits that were ever made, undone or not: undo and redo leave it as it is. If it has grown by n, all steps
    /// but the last n are those of before or were undone and redone since.
    #[must_use]
    pub fn edits_made(&self) -> usize {
        self.history.made
    }

    /// Number of edits that are done or can be redone.
    #[must_use]
    pub fn all_steps(&self) -> usize {
        self.history.steps() + self.history.undone.len()
    }

    /// The text after this many of the known edits, whether they are done or undone. Returns None beyond the last.
    #[must_use]
    pub fn text_at(&self, steps: usize) -> Option<String> {
        let mut text = self.source().to_owned();
        let done = self.history.steps();
        let back = self.history.done.iter().skip(steps).rev();
        let forth = self.history.undone.iter().rev().take(steps.saturating_sub(done));
        let fits = steps <= self.all_steps() && back.into_iter().all(|step| undo(&mut text, step));
        (fits && forth.into_iter().all(|step| redo(&mut text, step))).then_some(text)
    }

    /// Sets a parameter or an input of a node from typed text, such as `2 km`, `0.3`, `max`, `(1, 2)` or a wire
    /// `base.height`.
    ///
    /// # Errors
    /// As [`Self::apply`].
    pub fn set_from_text(&mut self, node: &str, name: &str, text: &str) -> Result<(), EditError> {
        self.apply(&Edit::SetText { node: node.to_owned(), name: name.to_owned(), text: text.to_owned() })
    }

    /// The text with other file names, for a copy in another place. `rename` gets node, parameter and name.
    ///
    /// The result is not checked, since the files may not exist yet.
    ///
    /// # Errors
    /// [`EditError`] when the document has syntax errors.
    pub fn with_file_names(&self, rename: &dyn Fn(&str, &str, &str) -> Option<String>) -> Result<String, EditError> {
        let mut draft = Draft::of(self.source(), Some(&self.read.parsed));
        let mut renames = Vec::new();
        for index in self.graph().indices() {
            let instance = self.graph().instance(index);
            for (param, value) in instance.params.iter() {
                if let ParamValue::File(file) = value
                    && !file.is_empty()
                    && let Some(new) = rename(&instance.name, param, file)
                {
                    renames.push((instance.name.as_str(), param, new));
                }
            }
        }
        // Without its file a subgraph has no parameters, so the name of that file is changed last.
        renames.sort_by_key(|(_, param, _)| *param == FILE);
        for (node, param, new) in renames {
            Editor::new(&mut draft, &self.registry, &self.home).set(node, param, &quote(&new))?;
        }
        if let Some(new) = self.world_raster().and_then(|file| rename("world", "from", file)) {
            Editor::new(&mut draft, &self.registry, &self.home).set_world_raster(&new);
        }
        Ok(draft.source)
    }

    /// Replaces the text, for example after another program changed the file, as one step for [`Self::undo`]. Any text
    /// is accepted, even with problems. Returns true if it differs.
    pub fn replace(&mut self, source: &str) -> bool {
        let Some(splice) = Splice::between(self.source(), source) else { return false };
        self.history.made(vec![splice]);
        self.take(source.to_owned());
        true
    }

    /// Undoes the last edit. Returns false when there is none.
    pub fn undo(&mut self) -> bool {
        let mut source = self.source().to_owned();
        let undone = self.history.undo(&mut source);
        if undone {
            self.take(source);
        }
        undone
    }

    /// Redoes the last undone edit. Returns false when there is none.
    pub fn redo(&mut self) -> bool {
        let mut source = self.source().to_owned();
        let redone = self.history.redo(&mut source);
        if redone {
            self.take(source);
        }
        redone
    }

    /// Returns true if there is an edit to undo.
    #[must_use]
    pub fn can_undo(&self) -> bool {
        self.history.can_undo()
    }

    /// Returns true if there is an edit to redo.
    #[must_use]
    pub fn can_redo(&self) -> bool {
        !self.history.undone.is_empty()
    }

    /// Reads the text again after a change of its path or of the files that it names.
    pub(crate) fn read_again(&mut self) {
        let parsed = Arc::clone(&self.read.parsed);
        self.read = Arc::new(self.check(self.source().to_owned(), parsed, None));
        self.before = None;
    }

    /// Replaces the text.
    fn take(&mut self, source: String) {
        self.read = Arc::new(self.read_text(source));
        self.before = None;
    }

    fn read_text(&mut self, source: String) -> Read {
        self.parsed += 1;
        let parsed = Arc::new(Parsed::of(&source));
        self.check(source, parsed, Some(&self.read))
    }

    fn check(&self, source: String, parsed: Arc<Parsed>, like: Option<&Read>) -> Read {
        Read::new(source, parsed, &self.registry, &self.home, &mut Loader::new(&self.home), like)
    }
}

/// The text after an edit, with the replaced bytes.
type Made = (Arc<Read>, Vec<Splice>);

/// Problems that an edit may add, because a graph is built up edit by edit: a missing wire, a missing file name.
const UNFINISHED: [&str; 2] = ["unwired", "no-file"];

/// An error that an edit would add, other than an unfinished node. Returns None also when there were more errors than
/// are listed, because one of those is not new.
pub(crate) fn added<'a>(before: &[Diagnostic], after: &'a [Diagnostic], renames: bool) -> Option<&'a Diagnostic> {
    if before.iter().any(|problem| problem.severity == Severity::Error && problem.code == MORE) {
        return None;
    }
    let is_error = |problem: &&Diagnostic| problem.severity == Severity::Error && !UNFINISHED.contains(&problem.code);
    let key = |problem: &Diagnostic| (problem.code, if renames { String::new() } else { problem.message.clone() });
    let mut known: BTreeMap<(&str, String), usize> = BTreeMap::new();
    for problem in before.iter().filter(is_error) {
        *known.entry(key(problem)).or_default() += 1;
    }
    after.iter().filter(is_error).find(|problem| match known.get_mut(&key(problem)) {
        Some(count) if *count > 0 => {
            *count -= 1;
            false
        }
        _ => true,
    })
}
