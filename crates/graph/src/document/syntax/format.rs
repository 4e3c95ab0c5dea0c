//! The canonical form of a graph file: indentation, one node per line, names padded so that kinds align, comments kept.

use std::ops::Range;

use super::{
    Expr, ExprKind, Group, Item,
    lex::{Bracket, Comment},
    parse,
};
use crate::diagnostic::Diagnostic;

/// The longest line that is written if it can be broken.
const WIDTH: usize = 120;

/// Names longer than this do not affect the alignment of kinds.
const MAX_PAD: usize = 32;

/// Writes a graph file in canonical form. Its meaning, its comments and the order of its items stay the same. The
/// canonical form is stable: formatting it again changes nothing.
///
/// # Errors
/// The syntax errors, if there are any. Other problems do not matter.
pub fn format_source(source: &str) -> Result<String, Vec<Diagnostic>> {
    let (tree, problems) = parse(source);
    if !problems.is_empty() {
        return Err(problems);
    }
    let mut printer = Printer { source, comments: &tree.comments, next: 0, out: String::new() };
    if let Some(root) = &tree.root {
        let commented = printer.comments_before(root.span.start, 0, false);
        printer.keep_blank(root.span.start, commented);
        printer.expr(root, 0, true);
        printer.trailing(root.span.end);
        printer.newline();
        printer.comments_before(source.len(), 0, true);
    } else {
        printer.comments_before(source.len(), 0, false);
    }
    let text = printer.out.trim_end().to_owned();
    Ok(if text.is_empty() { text } else { text + "\n" })
}

/// A value on one line, without comments.
pub(crate) fn inline(value: &Expr, source: &str) -> String {
    Printer { source, comments: &[], next: 0, out: String::new() }.inline(value)
}

struct Printer<'a> {
    source: &'a str,
    comments: &'a [Comment],
    /// The first comment that is not printed yet.
    next: usize,
    out: String,
}

impl Printer<'_> {
    /// The next comment, if it begins before an offset.
    fn comment_before(&self, end: usize) -> Option<&Comment> {
        self.comments.get(self.next).filter(|comment| comment.span.start < end)
    }

    fn has_comments(&self, range: Range<usize>) -> bool {
        let first = self.comments.partition_point(|comment| comment.span.start < range.start);
        self.comments.get(first).is_some_and(|comment| comment.span.start < range.end)
    }

    fn newline(&mut self) {
        self.out.push('\n');
    }

    fn indent(&mut self, level: usize) {
        self.out.push_str(&"    ".repeat(level));
    }

    /// Returns true if the source has an empty line before an offset.
    fn blank_before(&self, at: usize) -> bool {
        let before = &self.source[..at];
        before[before.trim_end().len()..].matches('\n').count() > 1
    }

    /// Keeps one empty line where the source has some; `after` is true if something is above it.
    fn keep_blank(&mut self, at: usize, after: bool) {
        if after && self.blank_before(at) {
            self.newline();
        }
    }

    /// Prints comments on separate lines; returns true if something is above the next item.
    fn comments_before(&mut self, end: usize, level: usize, mut after: bool) -> bool {
        while let Some(span) = self.comment_before(end).map(|comment| comment.span.clone()) {
            self.keep_blank(span.start, after);
            self.indent(level);
            self.out.push_str(&self.source[span]);
            self.newline();
            self.next += 1;
            after = true;
        }
        after
    }

    /// Prints comments that follow something on its line, but not those before another item on that line.
    fn trailing(&mut self, mut from: usize) {
        while let Some(comment) = self.comments.get(self.next) {
            let span = comment.span.clone();
            let between = self.source.get(from..span.start).unwrap_or("");
            let rest = self.source[span.end..].trim_start_matches([' ', '\t']);
            let ends_line = rest.is_empty() || rest.starts_with(['\n', '\r', ',', ')', ']', '}', '/']);
            if between.contains('\n') || !between.trim_matches([' ', '\t', ',', '\r']).is_empty() || !ends_line {
                return;
            }
            self.out.push(' ');
            self.out.push_str(&self.source[span.clone()]);
            self.next += 1;
            from = span.end;
        }
    }

    /// A value. Brackets are broken into lines if necessary, or if they are too long for one line.
    fn expr(&mut self, expr: &Expr, level: usize, broken: bool) {
        match &expr.kind {
            ExprKind::Group(group) => {
                let line_start = self.out.rfind('\n').map_or(0, |at| at + 1);
                let column = self.out[line_start..].chars().count();
                let commented = self.has_comments(expr.span.clone());
                // A comma follows.
                let fits = |text: &str| column + text.chars().count() < WIDTH;
                if !broken && !commented {
                    let line = self.inline(expr);
                    if fits(&line) {
                        self.out.push_str(&line);
                        return;
                    }
                }
                self.broken(group, level);
            }
            _ => {
                let text = self.inline(expr);
                self.out.push_str(&text);
            }
        }
    }

    /// A value on one line, without comments.
    fn inline(&self, expr: &Expr) -> String {
        match &expr.kind {
            ExprKind::Number => number(&self.source[expr.span.clone()]),
            ExprKind::Group(group) => {
                let items: Vec<String> = group.items.iter().map(|item| self.inline_item(item)).collect();
                let name = group.name.clone().map_or("", |name| &self.source[name]);
                let (open, close) = (group.bracket.open(), group.bracket.close());
                let space = if group.bracket == Bracket::Curly && !items.is_empty() { " " } else { "" };
                format!("{name}{open}{space}{}{space}{close}", items.join(", "))
            }
            _ => self.source[expr.span.clone()].to_owned(),
        }
    }

    fn inline_item(&self, item: &Item) -> String {
        match &item.key {
            Some(key) => format!("{}: {}", &self.source[key.span.clone()], self.inline(&item.value)),
            None => self.inline(&item.value),
        }
    }

    /// Items in brackets, one per line.
    fn broken(&mut self, group: &Group, level: usize) {
        if let Some(name) = &group.name {
            self.out.push_str(&self.source[name.clone()]);
        }
        self.out.push(group.bracket.open());
        let close = group.close.unwrap_or(self.source.len());
        if group.items.is_empty() && !self.has_comments(group.open..close) {
            self.out.push(group.bracket.close());
            return;
        }
        self.trailing(group.open + 1);
        self.newline();
        // Names in curly brackets are padded so that their values align.
        let width = |item: &Item| item.key.as_ref().map_or(0, |key| self.source[key.span.clone()].chars().count() + 1);
        let pad = match group.bracket {
            Bracket::Curly => group.items.iter().map(width).filter(|w| *w <= MAX_PAD).max().unwrap_or(0),
            _ => 0,
        };
        let mut after = false;
        for item in &group.items {
            let start = item.span().start;
            after = self.comments_before(start, level + 1, after);
            self.keep_blank(start, after);
            // Comments between a name and its value go above both.
            self.comments_before(item.value.span.start, level + 1, false);
            self.indent(level + 1);
            if let Some(key) = &item.key {
                let name = format!("{}:", &self.source[key.span.clone()]);
                self.out.push_str(&format!("{name:<pad$} "));
            }
            let is_nodes = level == 0 && item.key.as_ref().is_some_and(|key| key.text == "nodes");
            let broken = is_nodes && item.value.as_group().is_some_and(|group| !group.items.is_empty());
            self.expr(&item.value, level + 1, broken);
            self.out.push(',');
            self.trailing(item.value.span.end);
            self.newline();
            after = true;
        }
        self.comments_before(close, level + 1, after);
        self.indent(level);
        self.out.push(group.bracket.close());
    }
}

/// A number without redundant characters: `+`, `_`, and zeros at the end of a fraction or before a number.
fn number(text: &str) -> String {
    let plain: String = text.chars().filter(|c| *c != '_').collect();
    let Ok(value) = plain.parse::<f64>() else { return text.to_owned() };
    // Beyond 2^53 a fraction shows that a number is not meant to be an integer.
    if value.abs() >= 9e15 {
        return text.to_owned();
    }
    let lower = plain.trim_start_matches('+').to_ascii_lowercase();
    let (mantissa, exponent) = match lower.split_once('e') {
        Some((mantissa, exponent)) => (mantissa, Some(exponent)),
        None => (lower.as_str(), None),
    };
    let (sign, digits) = mantissa.strip_prefix('-').map_or(("", mantissa), |digits| ("-", digits));
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let whole = whole.trim_start_matches('0');
    let whole = if whole.is_empty() { "0" } else { whole };
    let fraction = fraction.trim_end_matches('0');
    let mut out = format!("{sign}{whole}");
    if !fraction.is_empty() {
        out.push('.');
        out.push_str(fraction);
    }
    if let Some(exponent) = exponent {
        let exponent = exponent.trim_start_matches('+');
        let (sign, digits) = exponent.strip_prefix('-').map_or(("", exponent), |digits| ("-", digits));
        let digits = digits.trim_start_matches('0');
        if !digits.is_empty() {
            out.push_str(&format!("e{sign}{digits}"));
        }
    }
    // Exactly the same number, otherwise as it was typed.
    if out.parse::<f64>().is_ok_and(|new| new.to_bits() == value.to_bits()) { out } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_lose_redundant_characters() {
        for (typed, expected) in [
            ("6000.0", "6000"),
            ("+0.50", "0.5"),
            (".5", "0.5"),
            ("1_000", "1000"),
            ("2E+06", "2e6"),
            ("1.50e-06", "1.5e-6"),
            ("-0.0", "-0"),
            ("007", "7"),
            ("0x1F", "0x1F"),
            ("9223372036854775807", "9223372036854775807"),
            ("1e0", "1"),
        ] {
            assert_eq!(number(typed), expected);
        }
    }
}
