//! Problems of graph files, as text for people and as JSON for programs.

use std::{collections::BTreeSet, io, path::Path, sync::OnceLock};

use miette::{GraphicalReportHandler, GraphicalTheme, LabeledSpan, NamedSource};
use orograph_graph::{Diagnostic, Document, LoadError, Registry, Severity};
use orograph_nodes::raster::Reader;
use serde_json::{Value, json};

use super::{
    failure::{Exit, Failure, reason},
    terminal::{self, Page, counted},
};
use crate::files::archive::Source;

/// A problem at a longer line is printed by the plain report, which truncates the line.
const LONGEST_LINE: usize = 200;

/// The name of standard input on the command line; a file of that name is `./-`.
pub const STDIN: &str = "-";

/// Reads a graph file, whatever its content, or [`STDIN`], whose relative paths begin in the current folder.
///
/// # Errors
/// When it cannot be read as text.
pub fn load(path: &Path, registry: &Registry) -> Result<Document, Failure> {
    // it can be read only once
    static STANDARD_INPUT: OnceLock<String> = OnceLock::new();
    let document = if path != Path::new(STDIN) {
        Document::load(path, registry)
    } else if let Some(text) = STANDARD_INPUT.get() {
        Ok(Document::parse_at(text.as_str(), path, registry))
    } else {
        Document::load_from(io::stdin().lock(), path, registry)
            .inspect(|document| drop(STANDARD_INPUT.set(document.source().to_owned())))
    };
    document.map_err(|error| match &error {
        LoadError::Unreadable { source, .. } => {
            let failure = Failure::unable(format!("`{}` cannot be read: {}", path.display(), reason(source)));
            Failure { code: "missing-file", ..failure }
        }
        LoadError::Missing(_) => Failure { code: "missing-file", ..Failure::wrong(error.to_string()) },
        LoadError::NotText { .. } if Reader::open(path).is_ok() => {
            Failure::wrong(format!("`{}` is a raster and not a graph file", path.display()))
                .hint(format!("`orograph new {} -o graph.ron` makes a graph of it", path.display()))
        }
        _ => Failure::wrong(error.to_string()),
    })
}

/// Reads a graph file for use: prints its problems, and refuses it if one of them is an error.
///
/// # Errors
/// When it cannot be read or has errors, which are then printed.
pub fn load_sound(path: &Path, registry: &Registry, warnings: bool) -> Result<Document, Failure> {
    open_sound(&Source::file(path), registry, warnings)
}

/// The same for the graph file of an archive.
///
/// # Errors
/// When it cannot be read or has errors, which are then printed.
pub fn open_sound(source: &Source, registry: &Registry, warnings: bool) -> Result<Document, Failure> {
    let document = load(&source.path, registry)?;
    if document.has_errors() || warnings && !document.problems().is_empty() {
        let text = report_all(&document, &source.path, Page::stderr());
        terminal::remark(&source.shown(&text));
    }
    if document.has_errors() { Err(Failure::silent(Exit::Wrong)) } else { Ok(document) }
}

/// All problems of a source with their positions, and their number; empty if there are none.
#[must_use]
pub fn report(problems: &[Diagnostic], source: &str, path: &Path, page: Page) -> String {
    let file = path.display().to_string();
    if problems.is_empty() {
        return String::new();
    }
    let mut out = String::new();
    let (more, problems): (Vec<&Diagnostic>, Vec<&Diagnostic>) = problems.iter().partition(|p| p.code == "more");
    for problem in &problems {
        out.push_str(&excerpt(problem, source, &file, page));
        out.push('\n');
    }
    let errors = problems.iter().filter(|problem| problem.severity == Severity::Error).count();
    let what = match (errors, problems.len() - errors) {
        (0, warnings) => page.doubtful(&counted(warnings, "warning")),
        (errors, 0) => page.bad(&counted(errors, "problem")),
        (errors, warnings) => {
            format!("{} and {}", page.bad(&counted(errors, "problem")), page.doubtful(&counted(warnings, "warning")))
        }
    };
    let more: String = more.iter().map(|more| format!("; {}", more.message)).collect();
    out.push_str(&format!("{what} in {file}{more}\n"));
    out
}

/// Notes with their positions; empty if there are none.
#[must_use]
pub fn notes(notes: &[Diagnostic], document: &Document, path: &Path, page: Page) -> String {
    let file = path.display().to_string();
    notes.iter().map(|note| excerpt(note, document.source(), &file, page) + "\n").collect()
}

/// The problems of a document, after those of the unusable graph files that it uses, each file once.
#[must_use]
pub fn report_all(document: &Document, path: &Path, page: Page) -> String {
    let faulty = faulty(document);
    let inner = faulty.iter().map(|(path, document)| report(document.problems(), document.source(), path, page));
    inner.chain([report(document.problems(), document.source(), path, page)]).collect()
}

/// The graph files with errors that a document uses, innermost first, each once, however often it is used.
fn faulty(document: &Document) -> Vec<(&Path, &Document)> {
    let mut found = Vec::new();
    add_faulty(document, &mut found, &mut BTreeSet::new());
    found
}

/// Adds the graph files with errors that a document uses. `seen` holds those that were looked at.
fn add_faulty<'a>(
    document: &'a Document,
    found: &mut Vec<(&'a Path, &'a Document)>,
    seen: &mut BTreeSet<*const Document>,
) {
    for used in document.uses() {
        let Some(inner) = used.document.as_deref().filter(|inner| inner.has_errors()) else { continue };
        if seen.insert(std::ptr::from_ref(inner)) {
            add_faulty(inner, found, seen);
            found.push((&used.path, inner));
        }
    }
}

/// The problems as data, one object each, including those of graph files that it uses.
#[must_use]
pub fn as_json(document: &Document, path: &Path) -> Vec<Value> {
    let inner = faulty(document);
    inner.into_iter().chain([(path, document)]).flat_map(|(path, document)| of_file(document, path)).collect()
}

fn of_file(document: &Document, path: &Path) -> Vec<Value> {
    document.problems().iter().map(|problem| one_as_json(problem, document, path)).collect()
}

/// A problem or note of a file as data.
#[must_use]
pub fn one_as_json(problem: &Diagnostic, document: &Document, path: &Path) -> Value {
    let (line, column) = problem.line_column(document.source());
    json!({
        "event": "problem",
        "file": path.display().to_string(),
        "line": line,
        "column": column,
        "severity": problem.severity.to_string(),
        "code": problem.code,
        "message": problem.message,
        "help": problem.hint,
    })
}

/// One problem: drawn on a terminal, in plain lines elsewhere.
fn excerpt(problem: &Diagnostic, source: &str, file: &str, page: Page) -> String {
    let plain = || problem.render(source, file);
    if !page.terminal || longest_line(source, problem) > LONGEST_LINE {
        return plain();
    }
    let theme = if page.colour { GraphicalTheme::unicode() } else { GraphicalTheme::unicode_nocolor() };
    let handler = GraphicalReportHandler::new_themed(theme).with_width(page.width).with_links(false);
    // The text is copied up to the line after the mark.
    let after = source.get(problem.span.end..).and_then(|rest| rest.match_indices('\n').nth(1));
    let end = after.map_or(source.len(), |(at, _)| problem.span.end + at);
    let drawn = Drawn { problem, source: NamedSource::new(file, source[..end].to_owned()) };
    let mut out = String::new();
    match handler.render_report(&mut out, &drawn) {
        Ok(()) => out.lines().map(|line| line.trim_end().to_owned() + "\n").collect(),
        // A position beyond the text; the plain report moves it to the end.
        Err(_) => plain(),
    }
}

fn longest_line(source: &str, problem: &Diagnostic) -> usize {
    let (line, _) = problem.line_column(source);
    source.lines().skip(line.saturating_sub(2)).take(3).map(str::len).max().unwrap_or(0)
}

/// A problem as miette draws it.
#[derive(Debug)]
struct Drawn<'a> {
    problem: &'a Diagnostic,
    source: NamedSource<String>,
}

impl std::fmt::Display for Drawn<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.problem.message)
    }
}

impl std::error::Error for Drawn<'_> {}

impl miette::Diagnostic for Drawn<'_> {
    fn severity(&self) -> Option<miette::Severity> {
        Some(match self.problem.severity {
            Severity::Error => miette::Severity::Error,
            Severity::Warning => miette::Severity::Warning,
            Severity::Note => miette::Severity::Advice,
        })
    }

    fn help<'a>(&'a self) -> Option<Box<dyn std::fmt::Display + 'a>> {
        self.problem.hint.as_ref().map(|hint| Box::new(hint) as Box<dyn std::fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn miette::SourceCode> {
        Some(&self.source)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let span = &self.problem.span;
        let label = LabeledSpan::new(self.problem.label.clone(), span.start, span.len());
        Some(Box::new(std::iter::once(label)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGE: Page = Page { width: 80, colour: false, terminal: true };

    #[test]
    fn all_problems_are_shown_and_counted() {
        let document = Document::parse(
            "(\n  nodes: { \"a\": Constent(), \"b\": Constant(valeu: 3) },\n  outputs: { \"o\": \"c\" },\n)",
            &orograph_nodes::registry(),
        );
        let text = report(document.problems(), document.source(), Path::new("g.ron"), PAGE);
        assert!(text.ends_with("3 problems in g.ron\n"), "{text}");
        assert!(text.contains("did you mean `Constant`?") && text.contains("g.ron:2:17"), "{text}");
        let plain =
            report(document.problems(), document.source(), Path::new("g.ron"), Page { terminal: false, ..PAGE });
        assert!(plain.contains("--> g.ron:2:17") && plain.is_ascii(), "{plain}");
        assert_eq!(as_json(&document, Path::new("g.ron"))[0]["line"], 2);
    }

    /// The first hundred are shown, and all are counted.
    #[test]
    fn many_problems_are_counted() {
        let nodes: String = (0..150).map(|at| format!("\"n{at}\": Wrong(),\n")).collect();
        let source = format!("(nodes: {{ {nodes} \"a\": Constant }}, outputs: {{ \"o\": \"a\" }})");
        let document = Document::parse(source, &orograph_nodes::registry());
        let text = report(document.problems(), document.source(), Path::new("g.ron"), PAGE);
        assert!(text.ends_with("\n100 problems in g.ron; 50 more problems are not listed\n"), "{text}");
        assert_eq!(text.matches("unknown node `Wrong`").count(), 100);
    }

    #[test]
    fn one_endless_line_is_clipped() {
        let source = format!("({}", "x".repeat(1_000_000));
        let document = Document::parse(source, &orograph_nodes::registry());
        let text = report(document.problems(), document.source(), Path::new("g.ron"), PAGE);
        assert!(!text.is_empty() && text.len() < 4000, "{} bytes", text.len());
    }
}
