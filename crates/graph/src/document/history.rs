//! Applying edits, and taking them back.

use std::{
    collections::{BTreeMap, VecDeque},
    sync::Arc,
};

use serde::{Deserialize, Serialize};

use super::{
    Document,
    edit::{Edit, EditError},
    editor::Editor,
    lex::quote,
    read::{Parsed, Read},
    splice::{Draft, Splice, redo, undo},
    subgraph::{FILE, Loader},
};
use crate::{
    diagnostic::{Diagnostic, Severity},
    param::ParamValue,
};

/// Bytes of edits that are remembered. A day's work takes a few of these megabytes; the oldest edits beyond are forgotten.
const MAX_BYTES: usize = 256 << 20;

/// Edits that were made, and those that were taken back, each as the bytes it replaced.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct History {
    done: VecDeque<Vec<Splice>>,
    undone: Vec<Vec<Splice>>,
    /// Bytes of what was done.
    #[serde(skip)]
    bytes: usize,
}

impl History {
    /// How many edits can be taken back.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.done.len()
    }

    /// Whether there is an edit to take back.
    #[must_use]
    pub fn can_undo(&self) -> bool {
        !self.done.is_empty()
    }

    pub(super) const fn done(&self) -> &VecDeque<Vec<Splice>> {
        &self.done
    }

    pub(super) fn undone(&self) -> &[Vec<Splice>] {
        &self.undone
    }

    pub(super) fn last(&self) -> Option<&[Splice]> {
        self.done.back().map(Vec::as_slice)
    }

    /// A new edit; what was taken back cannot be made again.
    pub(super) fn made(&mut self, step: Vec<Splice>) {
        self.undone.clear();
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
        }
    }

    fn pop(&mut self) -> Option<Vec<Splice>> {
        let step = self.done.pop_back()?;
        self.bytes = self.bytes.saturating_sub(weight(&step));
        Some(step)
    }

    /// Takes the last edit out of a text and forgets it; says no when there is none, or it does not fit.
    pub(super) fn take_last(&mut self, text: &mut String) -> bool {
        let Some(step) = self.pop() else { return false };
        let fits = undo(text, &step);
        if !fits {
            self.push(step);
        }
        fits
    }

    /// Takes the last edit out of a text; says no when there is none, or it does not fit.
    pub(super) fn undo(&mut self, text: &mut String) -> bool {
        let step = self.last().map(<[Splice]>::to_vec);
        let undone = self.take_last(text);
        self.undone.extend(step.filter(|_| undone));
        undone
    }

    /// Makes the edit again that was taken out last; says no when there is none, or it does not fit.
    pub(super) fn redo(&mut self, text: &mut String) -> bool {
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
    /// Makes an edit. What it does not concern stays as it is in the text, to the byte; an edit that changes nothing is
    /// not kept for [`Self::undo`].
    ///
    /// A file may have problems before and after it, but the edit must not add one, save that an input lacks its wire or
    /// a `Subgraph` its file while a graph is being made.
    ///
    /// # Errors
    /// [`EditError`] when the file would be wrong, with the reason; the document is unchanged then.
    pub fn apply(&mut self, edit: &Edit) -> Result<(), EditError> {
        let from = Arc::clone(&self.read);
        if let Some((read, step)) = self.edited(&from, edit)? {
            self.read = read;
            self.before = Some(from);
            self.history.made(step);
        }
        Ok(())
    }

    /// Makes an edit in place of the last one, as while a slider is dragged: both are one step for [`Self::undo`].
    ///
    /// # Errors
    /// As [`Self::apply`], which this is when there is no last edit; the document is unchanged then.
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

    /// The text before the last edit; `None` when there is no edit.
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

    /// What an edit makes of a text, with the bytes that it replaces; `None` where it changes nothing.
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
        // What has changed in other files since is not the edit's fault. An edit of this text alone leaves them as they were.
        let now = (!from.checked.uses.is_empty() && !from.reads_as(&read))
            .then(|| self.check(from.source.clone(), Arc::clone(&from.parsed), None));
        let before = now.as_ref().unwrap_or(from);
        if let Some(problem) = added(&before.checked.problems, &read.checked.problems, edit.renames()) {
            return Err(EditError::Refused { message: problem.message.clone(), hint: problem.hint.clone() });
        }
        Ok(Some((Arc::new(read), draft.splices)))
    }

    /// How many edits can be taken back.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.history.steps()
    }

    /// Sets a parameter or an input of a node from what a person typed, such as `2 km`, `0.3`, `max`, `(1, 2)` or a
    /// wire `base.height`.
    ///
    /// # Errors
    /// As [`Self::apply`].
    pub fn set_from_text(&mut self, node: &str, name: &str, text: &str) -> Result<(), EditError> {
        self.apply(&Edit::SetText { node: node.to_owned(), name: name.to_owned(), text: text.to_owned() })
    }

    /// The text with other names of files, for a copy at another place. `rename` is given node, parameter and name.
    ///
    /// Nothing is checked, since the files may not be there yet.
    ///
    /// # Errors
    /// [`EditError`] when the document has mistakes of notation.
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
        // Without its file a subgraph has no parameters, so the name of that comes last.
        renames.sort_by_key(|(_, param, _)| *param == FILE);
        for (node, param, new) in renames {
            Editor::new(&mut draft, &self.registry, &self.home).set(node, param, &quote(&new))?;
        }
        Ok(draft.source)
    }

    /// Replaces the text. such as what another program made of the file, as one step for
    /// [`Self::undo`]. Nothing is refused: the text may have problems. Says whether it differs.
    pub fn replace(&mut self, source: &str) -> bool {
        let Some(splice) = Splice::between(self.source(), source) else { return false };
        self.history.made(vec![splice]);
        self.take(source.to_owned());
        true
    }

    /// Takes the last edit back; says whether there was one.
    pub fn undo(&mut self) -> bool {
        let mut source = self.source().to_owned();
        let undone = self.history.undo(&mut source);
        if undone {
            self.take(source);
        }
        undone
    }

    /// Makes the edit again that was taken back last; says whether there was one.
    pub fn redo(&mut self) -> bool {
        let mut source = self.source().to_owned();
        let redone = self.history.redo(&mut source);
        if redone {
            self.take(source);
        }
        redone
    }

    /// Whether there is an edit to take back.
    #[must_use]
    pub fn can_undo(&self) -> bool {
        self.history.can_undo()
    }

    /// Whether there is an edit to make again.
    #[must_use]
    pub fn can_redo(&self) -> bool {
        !self.history.undone.is_empty()
    }

    /// Reads the text again because of what it depends on: its place, or the files that it names.
    pub(super) fn read_again(&mut self) {
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

/// A text that an edit has made, with the bytes that it replaced.
type Made = (Arc<Read>, Vec<Splice>);

/// What a node may lack while a graph is being made: a wire, or the file that it stands for.
const UNFINISHED: [&str; 2] = ["unwired", "no-file"];

/// An error that an edit would add, other than what a node lacks yet.
pub(super) fn added<'a>(before: &[Diagnostic], after: &'a [Diagnostic], renames: bool) -> Option<&'a Diagnostic> {
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
