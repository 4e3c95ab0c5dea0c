//! The problems of a file, collected during its check; each mistake is reported once.

use std::{collections::HashSet, fmt::Display, ops::Range};

use crate::document::syntax::{
    Expr, Group, Item,
    literal::{Literal, Misfit},
};
use crate::{
    closest,
    diagnostic::{Diagnostic, Severity},
};

/// The largest number of errors that are kept, and of warnings; the others are only counted.
const MOST_KEPT: usize = 100;

/// Names that are compared with each other faster than they are hashed.
const FEW: usize = 16;

/// The code of the problem that counts those that are not kept.
pub(crate) const MORE: &str = "more";

/// The largest number of names of a file that are compared to find those that were meant, so that the time of a check
/// grows with the size of the file and not with its square.
const MOST_COMPARED: usize = 50_000;

/// The problems found so far.
pub(crate) struct Problems {
    found: Vec<Diagnostic>,
    /// Offsets of syntax errors, ascending: items around one may be incomplete only because of it.
    syntax: Vec<usize>,
    errors: Tally,
    warnings: Tally,
    /// Number of names that were compared.
    compared: usize,
}

/// Numbers of problems of one severity.
#[derive(Default)]
struct Tally {
    kept: usize,
    dropped: usize,
}

impl Problems {
    pub(crate) fn new(syntax: Vec<Diagnostic>) -> Self {
        let mut starts: Vec<usize> = syntax.iter().map(|problem| problem.span.start).collect();
        starts.sort_unstable();
        Self { found: syntax, syntax: starts, errors: Tally::default(), warnings: Tally::default(), compared: 0 }
    }

    pub(crate) fn push(&mut self, problem: Diagnostic) {
        let tally = match problem.severity {
            Severity::Error => &mut self.errors,
            Severity::Warning | Severity::Note => &mut self.warnings,
        };
        if tally.kept < MOST_KEPT {
            tally.kept += 1;
            self.found.push(problem);
        } else {
            tally.dropped += 1;
        }
    }

    /// Returns true if further errors are only counted, so that their hints need not be found.
    pub(crate) const fn has_enough(&self) -> bool {
        self.errors.kept >= MOST_KEPT
    }

    /// The name of the file that was probably meant, as [`closest`]. Returns None also after many comparisons.
    pub(crate) fn meant<'a>(&mut self, word: &str, known: impl ExactSizeIterator<Item = &'a str>) -> Option<&'a str> {
        if self.has_enough() || self.compared >= MOST_COMPARED {
            return None;
        }
        self.compared += known.len();
        closest(word, known)
    }

    /// All problems, sorted by position.
    pub(crate) fn finish(mut self, source: &str) -> Vec<Diagnostic> {
        self.found.sort_by_key(|problem| (problem.span.start, problem.span.end));
        let dropped = self.errors.dropped + self.warnings.dropped;
        if dropped > 0 {
            let message = match dropped {
                1 => "one more problem is not listed".to_owned(),
                more => format!("{more} more problems are not listed"),
            };
            let place = source.len()..source.len();
            self.found.push(match self.errors.dropped {
                0 => Diagnostic::warning(MORE, place, message),
                _ => Diagnostic::error(MORE, place, message),
            });
        }
        self.found
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.found.is_empty()
    }

    /// Returns true if there is an error among the problems.
    pub(crate) fn has_errors(&self) -> bool {
        self.found.iter().any(|problem| problem.severity == Severity::Error)
    }

    /// Returns true if a problem begins in a range.
    pub(crate) fn has_any_in(&self, span: &Range<usize>) -> bool {
        self.found.iter().any(|problem| span.contains(&problem.span.start))
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
        self.duplicates(group, format_args!("in {owner}"));
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
    pub(crate) fn duplicates<'a>(&mut self, group: &'a Group, place: impl Display) -> Vec<(&'a str, &'a Item)> {
        let mut seen: HashSet<&str> = HashSet::new();
        let mut unique: Vec<(&str, &Item)> = Vec::with_capacity(group.items.len());
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
                // the few parameters of a node are compared one by one
                Some(key) if is_known(&mut seen, &unique, &key.text) => {
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

/// Whether a name is among those so far; `seen` has them too, once they are many.
fn is_known<'a>(seen: &mut HashSet<&'a str>, so_far: &[(&'a str, &Item)], name: &'a str) -> bool {
    if so_far.len() < FEW {
        return so_far.iter().any(|(other, _)| *other == name);
    }
    if seen.is_empty() {
        seen.extend(so_far.iter().map(|(other, _)| *other));
    }
    !seen.insert(name)
}

/// Joins names for a message.
pub(crate) fn list<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let names: Vec<String> = names.into_iter().map(|name| format!("`{name}`")).collect();
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}
