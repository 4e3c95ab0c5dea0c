//! The problems of a file, collected during its check; each mistake is reported once.

use std::{collections::BTreeSet, ops::Range};

use crate::document::syntax::{
    Expr, Group, Item,
    literal::{Literal, Misfit},
};
use crate::{closest, diagnostic::Diagnostic};

/// The largest number of problems that are kept.
const MAX_PROBLEMS: usize = 500;

/// The problems found so far.
pub(crate) struct Problems {
    found: Vec<Diagnostic>,
    /// Offsets of syntax errors, ascending: items around one may be incomplete only because of it.
    syntax: Vec<usize>,
    /// Number of problems beyond the limit.
    dropped: usize,
}

impl Problems {
    pub(crate) fn new(syntax: Vec<Diagnostic>) -> Self {
        let mut starts: Vec<usize> = syntax.iter().map(|problem| problem.span.start).collect();
        starts.sort_unstable();
        Self { found: syntax, syntax: starts, dropped: 0 }
    }

    pub(crate) fn push(&mut self, problem: Diagnostic) {
        if self.found.len() < MAX_PROBLEMS {
            self.found.push(problem);
        } else {
            self.dropped += 1;
        }
    }

    /// All problems, sorted by position.
    pub(crate) fn finish(mut self, source: &str) -> Vec<Diagnostic> {
        self.found.sort_by_key(|problem| (problem.span.start, problem.span.end));
        if self.dropped > 0 {
            let message = format!("{} more problems are not listed", self.dropped);
            self.found.push(Diagnostic::error("more", source.len()..source.len(), message));
        }
        self.found
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.found.is_empty()
    }

    /// Returns true if a syntax error lies in a range.
    pub(crate) fn has_syntax_in(&self, span: &Range<usize>) -> bool {
        self.syntax.get(self.syntax.partition_point(|at| *at < span.start)).is_some_and(|at| *at <= span.end)
    }

    /// Uses a value that was read, or reports why it does not fit; returns true if it was used.
    pub(crate) fn take<T>(
        &mut self,
        result: Result<T, Misfit>,
        literal: &Literal,
        span: &Range<usize>,
        set: impl FnOnce(T),
    ) -> bool {
        match result {
            Ok(value) => {
                set(value);
                true
            }
            Err(misfit) => {
                if !literal.is_bad() {
                    let mut problem = Diagnostic::error(misfit.code, span.clone(), misfit.message);
                    problem.hint = misfit.hint;
                    self.push(problem);
                }
                false
            }
        }
    }

    /// Reports a value that a field does not accept.
    pub(crate) fn misplaced(&mut self, value: &Expr, name: &str, takes: &str, source: &str) {
        let literal = Literal::read(value, source);
        if !literal.is_bad() {
            let message = format!("`{name}` is {}, but takes {takes}", literal.describe());
            self.push(Diagnostic::error("type", value.span.clone(), message));
        }
    }

    /// Reports items without a name, duplicate names and unknown names.
    pub(crate) fn names(&mut self, group: &Group, owner: &str, known: &[&str]) {
        self.duplicates(group, &format!("in {owner}"));
        for key in group.items.iter().filter_map(|item| item.key.as_ref()) {
            if !known.contains(&key.text.as_str()) {
                let message = format!("{owner} has no field `{}`", key.text);
                let problem = Diagnostic::error("unknown-field", key.span.clone(), message);
                self.push(match closest(&key.text, known.iter().copied()) {
                    Some(near) => problem.hint(format!("did you mean `{near}`?")),
                    None => problem.hint(format!("it has {}", list(known.iter().copied()))),
                });
            }
        }
    }

    /// Reports items without a name and duplicate names; returns the rest.
    pub(crate) fn duplicates<'a>(&mut self, group: &'a Group, place: &str) -> Vec<(&'a str, &'a Item)> {
        let mut seen: BTreeSet<&str> = BTreeSet::new();
        let mut unique = Vec::new();
        for item in &group.items {
            match &item.key {
                None if self.has_syntax_in(&(group.open..item.value.span.end + 1)) => {}
                None => {
                    let problem = Diagnostic::error(
                        "unnamed",
                        item.value.span.clone(),
                        format!("found a value without a name {place}"),
                    );
                    self.push(problem.hint("values are written `name: value`"));
                }
                Some(key) if !seen.insert(&key.text) => {
                    let message = format!("`{}` appears twice {place}", key.text);
                    let problem = Diagnostic::error("duplicate", key.span.clone(), message);
                    self.push(problem.label("again here").hint("remove or rename one of them"));
                }
                Some(key) => unique.push((key.text.as_str(), item)),
            }
        }
        unique
    }
}

/// Joins names for a message.
pub(crate) fn list<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let names: Vec<String> = names.into_iter().map(|name| format!("`{name}`")).collect();
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}
