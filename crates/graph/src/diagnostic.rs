//! Problems of a file, with their positions, as readable text.

use std::{fmt, fmt::Write as _, ops::Range};

/// The severity of a problem.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Severity {
    /// The file cannot be built.
    Error,
    /// The file can be built, but probably does not mean what the author intended.
    Warning,
    /// A part of the file has no effect, which may be intended.
    Note,
}

impl fmt::Display for Severity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Error => "error",
            Self::Warning => "warning",
            Self::Note => "note",
        })
    }
}

/// A problem of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// Its severity.
    pub severity: Severity,
    /// The kind of problem in kebab case, such as `unknown-node`; for programs that read the output.
    pub code: &'static str,
    /// The bytes of the source that it concerns; may be empty.
    pub span: Range<usize>,
    /// The problem, in one line.
    pub message: String,
    /// Text below the marked bytes.
    pub label: Option<String>,
    /// Advice on what to do.
    pub hint: Option<String>,
}

impl Diagnostic {
    /// An error.
    #[must_use]
    pub fn error(code: &'static str, span: Range<usize>, message: impl Into<String>) -> Self {
        Self { severity: Severity::Error, code, span, message: message.into(), label: None, hint: None }
    }

    /// A warning.
    #[must_use]
    pub fn warning(code: &'static str, span: Range<usize>, message: impl Into<String>) -> Self {
        Self { severity: Severity::Warning, ..Self::error(code, span, message) }
    }

    /// A note.
    #[must_use]
    pub fn note(code: &'static str, span: Range<usize>, message: impl Into<String>) -> Self {
        Self { severity: Severity::Note, ..Self::error(code, span, message) }
    }

    /// Adds a text below the marked bytes.
    #[must_use]
    pub fn label(mut self, label: impl Into<String>) -> Self {
        self.label = Some(label.into());
        self
    }

    /// Adds advice.
    #[must_use]
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }

    /// Adds `did you mean` if there is a similar name.
    #[must_use]
    pub fn suggest(self, name: Option<&str>) -> Self {
        match name {
            Some(name) => self.hint(format!("did you mean `{name}`?")),
            None => self,
        }
    }

    /// Line and column of its start, both from 1; the column counts characters.
    #[must_use]
    pub fn line_column(&self, source: &str) -> (usize, usize) {
        line_column(source, self.span.start)
    }

    /// The problem as text of a few lines: message, position, the line with the bytes marked, advice.
    ///
    /// `file` is the name to print. The text ends with a line feed.
    #[must_use]
    pub fn render(&self, source: &str, file: &str) -> String {
        let (line, column) = self.line_column(source);
        let start = floor_char(source, self.span.start);
        let line_start = source[..start].rfind('\n').map_or(0, |at| at + 1);
        let text = source[line_start..].split('\n').next().unwrap_or("");
        let marked = source[start..floor_char(source, self.span.end.max(start))].split('\n').next().unwrap_or("");

        // An excerpt of the line around the mark, so that a file with one very long line prints as well.
        let skipped = if column > EXCERPT / 2 + 20 { column - EXCERPT / 2 } else { 0 };
        let excerpt: String =
            text.chars().skip(skipped).take(EXCERPT).map(|c| if c.is_control() { ' ' } else { c }).collect();
        let before = column - 1 - skipped;
        let carets = marked.chars().count().min(EXCERPT.saturating_sub(before)).max(1);

        let number = line.to_string();
        let margin = " ".repeat(number.len());
        let mut out = format!("{}: {}\n", self.severity, self.message);
        // Writing to a string cannot fail.
        let _ = writeln!(out, "{margin}--> {file}:{line}:{column}");
        let _ = writeln!(out, "{margin} |\n{number} | {}\n", excerpt.trim_end());
        out.pop();
        let label = self.label.as_ref().map_or_else(String::new, |label| format!(" {label}"));
        let _ = writeln!(out, "{margin} | {}{}{label}", " ".repeat(before), "^".repeat(carets));
        if let Some(hint) = &self.hint {
            let _ = writeln!(out, "{margin} = hint: {hint}");
        }
        out
    }
}

/// The largest number of characters shown of a line.
const EXCERPT: usize = 120;

/// The offset, or the start of the character that it lies in.
fn floor_char(source: &str, at: usize) -> usize {
    let mut at = at.min(source.len());
    while !source.is_char_boundary(at) {
        at -= 1;
    }
    at
}

/// Line and column of a byte offset, both from 1; the column counts characters.
#[must_use]
pub fn line_column(source: &str, at: usize) -> (usize, usize) {
    let before = &source[..floor_char(source, at)];
    let line = before.matches('\n').count() + 1;
    let column = before.rsplit('\n').next().unwrap_or("").chars().count() + 1;
    (line, column)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_problem_shows_its_line_with_a_mark() {
        let source = "(\n    nodes: { \"é\": Streampower() },\n)\n";
        let at = source.find("Streampower").expect("is there");
        let problem = Diagnostic::error("unknown-node", at..at + 11, "unknown node `Streampower`")
            .label("no such kind")
            .suggest(Some("StreamPower"));
        assert_eq!(problem.line_column(source), (2, 19));
        assert_eq!(
            problem.render(source, "g.ron"),
            "error: unknown node `Streampower`\n --> g.ron:2:19\n  |\n2 |     nodes: { \"é\": Streampower() },\n  |                   \
             ^^^^^^^^^^^ no such kind\n  = hint: did you mean `StreamPower`?\n"
        );
    }

    #[test]
    fn places_at_the_end_and_on_endless_lines_print() {
        let source = format!("{}x", " ".repeat(100_000));
        let text = Diagnostic::warning("w", 100_000..100_001, "m").render(&source, "f");
        assert!(text.len() < 600 && text.contains("x\n") && text.contains('^'), "{text}");
        let end = Diagnostic::error("e", 3..9, "m").render("a\né", "f");
        assert!(end.contains("f:2:1"), "{end}");
        assert!(Diagnostic::error("e", 0..0, "m").render("", "f").contains("f:1:1"));
    }
}
