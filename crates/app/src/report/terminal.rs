//! The terminal: output streams, width and colours.
//!
//! Results go to standard output, everything about them (progress, problems) to standard error. Colours appear only on
//! a terminal and never when `NO_COLOR` is set.

use std::io::{self, Write as _};

use console::{Term, measure_text_width};

use super::failure::{Exit, Failure, reason, remedy};

/// Lines longer than this are hard to read, however wide the terminal.
const WIDEST: usize = 110;

/// A stream for text: its width, and whether it shows colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Page {
    /// Columns of text.
    pub width: usize,
    /// True if colours and weights are shown.
    pub colour: bool,
    /// True if it is interactive: bars may be redrawn.
    pub terminal: bool,
}

impl Page {
    /// Standard output.
    #[must_use]
    pub fn stdout() -> Self {
        Self::of(&Term::stdout())
    }

    /// Standard error.
    #[must_use]
    pub fn stderr() -> Self {
        Self::of(&Term::stderr())
    }

    fn of(term: &Term) -> Self {
        let terminal = term.is_term();
        let dull = std::env::var_os("NO_COLOR").is_some_and(|v| !v.is_empty())
            || std::env::var_os("TERM").is_some_and(|term| term == "dumb");
        let width = term.size_checked().map_or(100, |(_, columns)| usize::from(columns));
        Self { width: width.clamp(40, WIDEST), colour: terminal && !dull, terminal }
    }

    fn paint(self, code: &str, text: &str) -> String {
        if self.colour && !text.is_empty() { format!("\x1b[{code}m{text}\x1b[0m") } else { text.to_owned() }
    }

    /// Bold text.
    #[must_use]
    pub fn bold(self, text: &str) -> String {
        self.paint("1", text)
    }

    /// Dimmed text.
    #[must_use]
    pub fn dim(self, text: &str) -> String {
        self.paint("2", text)
    }

    /// A name: of a node, a port or a file.
    #[must_use]
    pub fn name(self, text: &str) -> String {
        self.paint("36", text)
    }

    /// Success.
    #[must_use]
    pub fn good(self, text: &str) -> String {
        self.paint("32", text)
    }

    /// Errors.
    #[must_use]
    pub fn bad(self, text: &str) -> String {
        self.paint("1;31", text)
    }

    /// Warnings.
    #[must_use]
    pub fn doubtful(self, text: &str) -> String {
        self.paint("1;33", text)
    }

    /// Shows Markdown's `**strong**` words in bold.
    fn weights(self, line: &str) -> String {
        let parts: Vec<&str> = line.split("**").collect();
        // Every other part is strong; a single pair of stars is not.
        let strong = |at: usize| at % 2 == 1 && at + 1 < parts.len();
        let drawn =
            parts.iter().enumerate().map(|(at, part)| if strong(at) { self.bold(part) } else { (*part).to_owned() });
        drawn.collect()
    }

    /// Paragraphs wrapped to the width, each line indented by `indent`. Consecutive lines of the source are joined;
    /// blank lines separate paragraphs; list items and indented lines stay separate lines.
    #[must_use]
    pub fn paragraphs(self, text: &str, indent: usize) -> String {
        let width = self.width.saturating_sub(indent).max(20);
        let margin = " ".repeat(indent);
        let mut out = String::new();
        for line in joined(text) {
            let item = line.starts_with("- ") || line.starts_with("* ");
            let hanging = " ".repeat(if item { 2 } else { line.len() - line.trim_start().len() });
            let line = self.weights(&line);
            for wrapped in textwrap::wrap(&line, textwrap::Options::new(width).subsequent_indent(&hanging)) {
                out.push_str(format!("{margin}{wrapped}").trim_end());
                out.push('\n');
            }
        }
        out
    }
}

/// Lines of a text in which a new line only ends a paragraph, an item of a list or an indented line.
fn joined(text: &str) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    let mut open = false;
    for line in text.lines() {
        let own = line.trim();
        let is_separate = line.starts_with("    ") || own.starts_with("- ") || own.starts_with("* ") || own.is_empty();
        match lines.last_mut() {
            Some(last) if open && !is_separate => {
                last.push(' ');
                last.push_str(own);
            }
            _ => lines.push(if line.starts_with("    ") { line.to_owned() } else { own.to_owned() }),
        }
        open = !own.is_empty() && !line.starts_with("    ");
    }
    lines
}

/// The alignment of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Align {
    /// Left, for words.
    Left,
    /// Right, for numbers.
    Right,
}

/// Rows of cells under headings; the last column is wrapped to the width.
#[derive(Clone, Debug)]
pub struct Table {
    head: Vec<(String, Align)>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// A table with these columns.
    #[must_use]
    pub fn new(head: &[(&str, Align)]) -> Self {
        Self { head: head.iter().map(|(name, align)| ((*name).to_owned(), *align)).collect(), rows: Vec::new() }
    }

    /// Adds a row, one cell per column. Cells may contain colours.
    pub fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        self.rows.push(cells.into_iter().collect());
    }

    /// Returns true if it has no rows.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// The table as text, ending with a line feed, indented by `indent`.
    #[must_use]
    pub fn render(&self, page: Page, indent: usize) -> String {
        let last = self.head.len().saturating_sub(1);
        let widths: Vec<usize> = (0..self.head.len())
            .map(|at| {
                let cells = self.rows.iter().filter_map(|row| row.get(at));
                cells
                    .map(|cell| measure_text_width(cell))
                    .chain([measure_text_width(&self.head[at].0)])
                    .max()
                    .unwrap_or(0)
            })
            .collect();
        let before: usize = indent + widths[..last].iter().map(|w| w + 2).sum::<usize>();
        let rest = page.width.saturating_sub(before).max(24);

        let mut out = String::new();
        if self.head.iter().any(|(name, _)| !name.is_empty()) {
            let head: Vec<String> = self.head.iter().map(|(name, _)| page.dim(name)).collect();
            self.line(&mut out, &head, &widths, indent);
        }
        for row in &self.rows {
            let mut row = row.clone();
            let wrapped: Vec<String> = match row.get(last) {
                Some(cell) if measure_text_width(cell) > rest && self.head[last].1 == Align::Left => {
                    textwrap::wrap(cell, rest).into_iter().map(|line| line.into_owned()).collect()
                }
                Some(cell) => vec![cell.clone()],
                None => vec![],
            };
            for (at, line) in wrapped.into_iter().enumerate() {
                if at > 0 {
                    row.iter_mut().for_each(String::clear);
                }
                row[last] = line;
                self.line(&mut out, &row, &widths, indent);
            }
        }
        out
    }

    fn line(&self, out: &mut String, cells: &[String], widths: &[usize], indent: usize) {
        let mut line = " ".repeat(indent);
        for (at, cell) in cells.iter().enumerate() {
            let pad = " ".repeat(widths[at].saturating_sub(measure_text_width(cell)));
            let (before, after) = match self.head[at].1 {
                Align::Left => ("", pad.as_str()),
                Align::Right => (pad.as_str(), ""),
            };
            line.push_str(&format!("{before}{cell}{after}"));
            if at + 1 < cells.len() {
                line.push_str("  ");
            }
        }
        out.push_str(line.trim_end());
        out.push('\n');
    }
}

/// Writes a result to standard output.
///
/// # Errors
/// When the reader has closed the pipe, which ends the program quietly, or it cannot be written.
pub fn print(text: &str) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    out.write_all(text.as_bytes()).and_then(|()| out.flush()).map_err(|error| match error.kind() {
        io::ErrorKind::BrokenPipe => Failure::silent(Exit::Done),
        _ => unprinted(&error),
    })
}

/// Why standard output cannot be written.
pub fn unprinted(error: &io::Error) -> Failure {
    Failure::unable(format!("cannot write to standard output: {}", reason(error)))
        .hint(format!("{}, or direct the output to another file with `>`", remedy(error)))
}

/// Writes a warning, a sentence without a full stop, to standard error.
pub fn warn(text: &str) {
    remark(&format!("{} {text}\n", Page::stderr().doubtful("warning:")));
}

/// Writes a remark to standard error. Errors are ignored: standard error may be closed.
pub fn remark(text: &str) {
    let _ = io::stderr().lock().write_all(text.as_bytes());
}

/// Prints why a command failed.
pub fn complain(failure: &Failure) {
    if !failure.message.is_empty() {
        remark(&complaint(failure, Page::stderr()));
    }
}

/// Why a command failed, as text: the message, the place and the remedy.
#[must_use]
pub fn complaint(failure: &Failure, page: Page) -> String {
    let mut text = format!("{} {}\n", page.bad("error:"), failure.message);
    if let Some(place) = &failure.place {
        text.push_str(&format!("{} {place}\n", page.name("   at:")));
    }
    if let Some(hint) = &failure.hint {
        text.push_str(&format!("{} {hint}\n", page.name(" hint:")));
    }
    text
}

/// A count with its noun: `1 problem`, `6 problems`.
#[must_use]
pub fn counted(count: usize, noun: &str) -> String {
    if count == 1 { format!("1 {noun}") } else { format!("{count} {noun}s") }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAIN: Page = Page { width: 40, colour: false, terminal: false };

    #[test]
    fn tables_align_and_wrap_the_last_column() {
        let mut table = Table::new(&[("name", Align::Left), ("n", Align::Right), ("what", Align::Left)]);
        table.row(["a".into(), "5".into(), "short".into()]);
        table.row(["longer".into(), "12".into(), "a text that is too long for one line".into()]);
        assert_eq!(
            table.render(PLAIN, 1),
            " name     n  what\n a        5  short\n longer  12  a text that is too long for\n             one line\n"
        );
    }

    #[test]
    fn paragraphs_are_joined_and_lists_stay() {
        let text = "One line\ngoes on.\n\n- an item that is so long that it must be broken\n- another";
        assert_eq!(
            PLAIN.paragraphs(text, 2),
            "  One line goes on.\n\n  - an item that is so long that it must\n    be broken\n  - another\n"
        );
    }

    #[test]
    fn strong_words_are_bold_on_a_terminal() {
        assert_eq!(PLAIN.paragraphs("**Scale.** A word", 0), "Scale. A word\n");
        let coloured = Page { colour: true, ..PLAIN };
        assert_eq!(coloured.paragraphs("**Scale.** A word", 0), "\x1b[1mScale.\x1b[0m A word\n");
    }

    #[test]
    fn colours_appear_only_on_a_terminal() {
        assert_eq!(PLAIN.bad("x"), "x");
        assert_eq!(Page { colour: true, ..PLAIN }.bad("x"), "\x1b[1;31mx\x1b[0m");
    }
}
