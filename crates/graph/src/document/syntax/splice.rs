//! Changes of a text at a syntax tree's offsets: every byte outside a change is preserved.

use std::{
    cell::{Cell, OnceCell},
    ops::Range,
    sync::Arc,
};

use serde::{Deserialize, Serialize};

use super::{
    Group,
    lex::{Bracket, Comment},
};
use crate::document::read::Parsed;

/// A replacement of some bytes of a text.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Splice {
    at: usize,
    removed: String,
    inserted: String,
}

impl Splice {
    /// The difference between two texts. Returns None when they are equal.
    pub(crate) fn between(from: &str, to: &str) -> Option<Self> {
        if from == to {
            return None;
        }
        let same = |(a, b): &(char, char)| a == b;
        let at: usize = from.chars().zip(to.chars()).take_while(same).map(|(c, _)| c.len_utf8()).sum();
        let (old, new) = (&from[at..], &to[at..]);
        let end: usize = old.chars().rev().zip(new.chars().rev()).take_while(same).map(|(c, _)| c.len_utf8()).sum();
        let (removed, inserted) = (old[..old.len() - end].to_owned(), new[..new.len() - end].to_owned());
        Some(Self { at, removed, inserted })
    }

    /// Applies the change. Returns false, with the text unchanged, when it does not fit.
    pub(crate) fn forth(&self, text: &mut String) -> bool {
        replace(text, self.at, &self.removed, &self.inserted)
    }

    /// Reverts the change. Returns false, with the text unchanged, when it does not fit.
    fn back(&self, text: &mut String) -> bool {
        replace(text, self.at, &self.inserted, &self.removed)
    }

    /// Size in bytes.
    pub(crate) fn bytes(&self) -> usize {
        size_of::<Self>() + self.removed.len() + self.inserted.len()
    }
}

fn replace(text: &mut String, at: usize, old: &str, new: &str) -> bool {
    let fits = at.checked_add(old.len()).is_some_and(|end| text.get(at..end) == Some(old));
    if fits {
        text.replace_range(at..at + old.len(), new);
    }
    fits
}

/// Reapplies the changes of an edit. Returns false, with the text unchanged, when one does not fit.
pub(crate) fn redo(text: &mut String, splices: &[Splice]) -> bool {
    let made = splices.iter().take_while(|splice| splice.forth(text)).count();
    if made < splices.len() {
        splices[..made].iter().rev().for_each(|splice| {
            splice.back(text);
        });
    }
    made == splices.len()
}

/// Reverts the changes of an edit. Returns false, with the text unchanged, when one does not fit.
pub(crate) fn undo(text: &mut String, splices: &[Splice]) -> bool {
    let undone = splices.iter().rev().take_while(|splice| splice.back(text)).count();
    if undone < splices.len() {
        splices[splices.len() - undone..].iter().for_each(|splice| {
            splice.forth(text);
        });
    }
    undone == splices.len()
}

/// A text replacement: a range of bytes, and their new contents.
pub(crate) type Change = (Range<usize>, String);

/// A text being edited. Its tree, which must be free of syntax errors, is parsed on demand.
pub(crate) struct Draft {
    pub(crate) source: String,
    pub(crate) splices: Vec<Splice>,
    parsed: OnceCell<Arc<Parsed>>,
    parses: Cell<u64>,
}

impl Draft {
    pub(crate) fn new(source: &str) -> Self {
        Self::of(source, None)
    }

    /// A draft of a text whose tree may already be known.
    pub(crate) fn of(source: &str, parsed: Option<&Arc<Parsed>>) -> Self {
        let known = parsed.map_or_else(OnceCell::new, |parsed| OnceCell::from(Arc::clone(parsed)));
        Self { source: source.to_owned(), splices: Vec::new(), parsed: known, parses: Cell::new(0) }
    }

    /// The current text, parsed.
    pub(crate) fn parsed(&self) -> &Arc<Parsed> {
        self.parsed.get_or_init(|| {
            self.parses.set(self.parses.get() + 1);
            Arc::new(Parsed::of(&self.source))
        })
    }

    /// How often the text was parsed.
    pub(crate) const fn parses(&self) -> u64 {
        self.parses.get()
    }

    /// Applies changes that do not overlap.
    pub(crate) fn change(&mut self, mut changes: Vec<Change>) {
        changes.retain(|(range, text)| self.source[range.clone()] != **text);
        if changes.is_empty() {
            return;
        }
        changes.sort_by_key(|(range, _)| std::cmp::Reverse((range.start, range.end)));
        for (range, inserted) in changes {
            // what both have in common is not kept: a long value of which a part changes is one of many steps
            let Some(splice) = Splice::between(&self.source[range.clone()], &inserted) else { continue };
            let splice = Splice { at: range.start + splice.at, ..splice };
            splice.forth(&mut self.source);
            self.splices.push(splice);
        }
        self.parsed = OnceCell::new();
    }

    /// The outermost brackets.
    pub(crate) fn root(&self) -> Option<&Group> {
        self.parsed().tree.root.as_ref()?.as_group()
    }

    /// The brackets of a field of the file, such as `nodes`.
    pub(crate) fn field(&self, name: &str) -> Option<&Group> {
        self.root()?.get(name)?.value.as_group()
    }

    /// The changes that add an item at the end of brackets; `own_line` decides its layout in empty ones.
    pub(crate) fn insertion(&self, group: &Group, text: &str, own_line: bool) -> Vec<Change> {
        self.insertions(group, &[text.to_owned()], own_line)
    }

    /// The changes that add items at the end of brackets, with the same result as one after the other; `own_line`
    /// decides their layout in empty ones.
    pub(crate) fn insertions(&self, group: &Group, texts: &[String], own_line: bool) -> Vec<Change> {
        let source = self.source.as_str();
        let newline = if source.contains("\r\n") { "\r\n" } else { "\n" };
        let Some(close) = group.close else { return Vec::new() };
        let closing_indent = indent(source, close);
        let lines = |indent: &str| texts.iter().map(|text| format!("{indent}{text},{newline}")).collect::<String>();
        let row = || texts.join(", ");
        let Some(last) = group.items.last() else {
            let start = group.open + 1 + source[group.open + 1..close].trim_end().len();
            let inner = &source[group.open + 1..close];
            let inner_indent = format!("{closing_indent}    ");
            if first_on_line(source, close) && inner.contains('\n') {
                let line = line_start(source, close);
                return vec![(line..line, lines(&inner_indent))];
            }
            let new = if own_line {
                format!("{newline}{}{closing_indent}", lines(&inner_indent))
            } else if group.bracket == Bracket::Curly {
                format!(" {} ", row())
            } else if inner.trim().is_empty() {
                row()
            } else {
                format!(" {}", row())
            };
            return vec![(start..close, new)];
        };
        let end = last.span().end;
        let after = last.comma.map_or(end, |comma| comma + 1);
        match line_end(source, &self.parsed().tree.comments, after).filter(|at| *at < close) {
            Some(line_feed) => {
                let indent = if first_on_line(source, last.span().start) {
                    indent(source, last.span().start).to_owned()
                } else {
                    format!("{closing_indent}    ")
                };
                let mut changes = vec![(line_feed + 1..line_feed + 1, lines(&indent))];
                if last.comma.is_none() {
                    changes.push((end..end, ",".to_owned()));
                }
                changes
            }
            None if last.comma.is_some() => vec![(after..after, format!(" {},", row()))],
            None => vec![(end..end, format!(", {}", row()))],
        }
    }

    /// The changes that remove an item, given by its span, from the brackets within a value that contain it.
    pub(crate) fn removal_within(&self, value: Range<usize>, gone: &Range<usize>) -> Vec<Change> {
        let mut open: Vec<&Group> = self.root().into_iter().collect();
        while let Some(group) = open.pop() {
            if let Some(position) = group.items.iter().position(|item| item.span() == *gone) {
                return self.removal(group, position);
            }
            let around = group.items.iter().filter(|item| {
                let span = &item.value.span;
                span.start <= value.start && value.end <= span.end || value.start <= span.start && span.end <= value.end
            });
            open.extend(around.filter_map(|item| item.value.as_group()));
        }
        Vec::new()
    }

    /// The changes that remove an item with its comma. Comments around it are kept.
    pub(crate) fn removal(&self, group: &Group, position: usize) -> Vec<Change> {
        let source = self.source.as_str();
        let item = &group.items[position];
        let span = item.span();
        let gone = |range: Range<usize>| (range, String::new());
        let Some(close) = group.close else { return Vec::new() };
        if let Some(comma) = item.comma
            && !source[span.end..comma].trim().is_empty()
        {
            // A comment precedes the comma.
            let spaced = source[..span.start].ends_with(' ') && source[span.end..].starts_with(' ');
            let start = span.start - usize::from(spaced && !first_on_line(source, span.start));
            return vec![gone(start..span.end), gone(comma..comma + 1)];
        }
        let end = item.comma.map_or(span.end, |comma| comma + 1);
        let blank_to = end + source[end..].find(|c: char| c != ' ' && c != '\t').unwrap_or(0);
        if first_on_line(source, span.start) {
            let rest = &source[blank_to..];
            let line = line_start(source, span.start);
            return match rest.strip_prefix('\r').unwrap_or(rest).starts_with('\n') {
                true => vec![gone(line..blank_to + rest.find('\n').map_or(0, |at| at + 1))],
                false => vec![gone(span.start..blank_to)],
            };
        }
        if group.items.len() == 1 && source[group.open + 1..span.start].trim().is_empty() {
            let all_blank = source[end..close].trim().is_empty();
            return vec![gone(group.open + 1..if all_blank { close } else { blank_to })];
        }
        let is_last = position + 1 == group.items.len();
        if is_last && source[end..close].trim().is_empty() {
            // Without a following item, the preceding comma goes too, unless there is one after the item.
            let before = position.checked_sub(1).and_then(|at| group.items[at].comma);
            let start = source[..span.start].trim_end().len();
            return match before {
                Some(comma) if item.comma.is_none() && start == comma + 1 => vec![gone(comma..end)],
                _ if source[..start].ends_with("*/") || start > group.open + 1 => vec![gone(start..end)],
                _ => vec![gone(span.start..end)],
            };
        }
        vec![gone(span.start..blank_to)]
    }
}

/// The next line feed outside comments.
fn line_end(source: &str, comments: &[Comment], from: usize) -> Option<usize> {
    let mut at = from;
    loop {
        at += source[at..].find('\n')?;
        let before = comments.partition_point(|comment| comment.span.start <= at);
        match before.checked_sub(1).map(|i| &comments[i]) {
            Some(comment) if comment.span.end > at => at = comment.span.end,
            _ => return Some(at),
        }
    }
}

fn line_start(source: &str, at: usize) -> usize {
    source[..at].rfind('\n').map_or(0, |feed| feed + 1)
}

fn first_on_line(source: &str, at: usize) -> bool {
    source[line_start(source, at)..at].trim().is_empty()
}

/// The white space at the beginning of a line.
fn indent(source: &str, at: usize) -> &str {
    let line = &source[line_start(source, at)..];
    &line[..line.find(|c: char| c != ' ' && c != '\t').unwrap_or(line.len())]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A brush writes all its strokes again with each new one: a step of that keeps the new one alone.
    #[test]
    fn a_change_keeps_only_what_differs() {
        let text = "(strokes: [äöü, two, three], more: 1)";
        let mut draft = Draft::new(text);
        let value = text.find('[').expect("there")..text.find(']').expect("there") + 1;
        draft.change(vec![(value, "[äöü, two, three, four]".to_owned())]);
        assert_eq!(draft.source, "(strokes: [äöü, two, three, four], more: 1)");
        let kept: Vec<_> = draft.splices.iter().map(|splice| (&*splice.removed, &*splice.inserted)).collect();
        assert_eq!(kept, [("", ", four")]);
        assert!(undo(&mut draft.source, &draft.splices));
        assert_eq!(draft.source, text);
    }
}
