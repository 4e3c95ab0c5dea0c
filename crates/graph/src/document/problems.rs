//! The problems of a file, collected while it is checked, so that each mistake is reported once.

use std::{collections::BTreeSet, ops::Range};

use super::{
    literal::{Literal, Misfit},
    syntax::{Expr, Group, Item},
};
use crate::{closest, diagnostic::Diagnostic};

/// The most problems that are kept.
const MAX_PROBLEMS: usize = 500;

/// The problems found so far.
pub(super) struct Problems {
    found: Vec<Diagnostic>,
    /// Where mistakes of notation begin, rising: what lies around one may lack something for that reason only.
    syntax: Vec<usize>,
    /// How many are not kept.
    dropped: usize,
}

impl Problems {
    pub(super) fn new(syntax: Vec<Diagnostic>) -> Self {
        let mut starts: Vec<usize> = syntax.iter().map(|problem| problem.span.start).collect();
        starts.sort_unstable();
        Self { found: syntax, syntax: starts, dropped: 0 }
    }

    pub(super) fn push(&mut self, problem: Diagnostic) {
        if self.found.len() < MAX_PROBLEMS {
            self.found.push(problem);
        } else {
            self.dropped += 1;
        }
    }

    /// All of them, sorted by place.
    pub(super) fn finish(mut self, source: &str) -> Vec<Diagnostic> {
        self.found.sort_by_key(|problem| (problem.span.start, problem.span.end));
        if self.dropped > 0 {
            let message = format!("{} more problems are not listed", self.dropped);
            self.found.push(Diagnostic::error("more", source.len()..source.len(), message));
        }
        self.found
    }

    pub(super) fn is_empty(&self) -> bool {
        self.found.is_empty()
    }

    /// Whether a mistake of notation lies in a range.
    pub(super) fn has_syntax_in(&self, span: &Range<usize>) -> bool {
        self.syntax.get(self.syntax.partition_point(|at| *at < span.start)).is_some_and(|at| *at <= span.end)
    }

    /// Uses a value that was read, or reports why it does not fit; says whether it was used.
    pub(super) fn take<T>(
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

    /// Reports a value that is not what a field takes.
    pub(super) fn misplaced(&mut self, value: &Expr, name: &str, takes: &str, source: &str) {
        let literal = Literal::read(value, source);
        if !literal.is_bad() {
            let message = format!("`{name}` is {}, but takes {takes}", literal.describe());
            self.push(Diagnostic::error("type", value.span.clone(), message));
        }
    }

    /// Reports things without a name, names given twice and names that are not known.
    pub(super) fn names(&mut self, group: &Group, owner: &str, known: &[&str]) {
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

    /// Reports things without a name and names given twice; gives what is left.
    pub(super) fn duplicates<'a>(&mut self, group: &'a Group, place: &str) -> Vec<(&'a str, &'a Item)> {
        let mut seen: BTreeSet<&str> = BTreeSet::new();
        let mut unique = Vec::new();
        for item in &group.items {
            match &item.key {
                None if self.has_syntax_in(&(group.open..item.value.span.end + 1)) => {}
                None => {
                    let problem = Diagnostic::error(
                        "unnamed",
                        item.value.span.clone(),
                        format!("a value without a name stands {place}"),
                    );
                    self.push(problem.hint("values are written `name: value`"));
                }
                Some(key) if !seen.insert(&key.text) => {
                    let message = format!("`{}` stands twice {place}", key.text);
                    let problem = Diagnostic::error("duplicate", key.span.clone(), message);
                    self.push(problem.label("again here").hint("remove or rename one of them"));
                }
                Some(key) => unique.push((key.text.as_str(), item)),
            }
        }
        unique
    }
}

/// Names for a message.
pub(super) fn list<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let names: Vec<String> = names.into_iter().map(|name| format!("`{name}`")).collect();
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}
