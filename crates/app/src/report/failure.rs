//! Why a command failed, and its exit code.

use std::{fmt, io, process::ExitCode};

use orograph_graph::{Document, line_column};
use serde::Serialize;

/// How a command ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// Success.
    Done = 0,
    /// The file or the request is wrong.
    Wrong = 1,
    /// The command could not be carried out: disk, memory, device.
    Unable = 2,
    /// Stopped (Ctrl-C or SIGTERM): 128 plus the number of SIGINT, as shells do.
    Stopped = 130,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}

/// Why a command failed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// The exit code.
    pub exit: Exit,
    /// The error, in one line; empty if it has already been printed.
    pub message: String,
    /// The remedy.
    pub hint: Option<String>,
    /// The kind of failure in kebab case, such as `node-failed`; for programs that read the output.
    pub code: &'static str,
    /// The place in a graph file, if it is known.
    pub place: Option<Box<Spot>>,
}

/// A place in a graph file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Spot {
    /// The node.
    pub node: String,
    /// The file.
    pub file: String,
    /// The line, from 1.
    pub line: usize,
    /// The column in characters, from 1.
    pub column: usize,
}

impl Spot {
    /// The place of a node in its file. For a node of a graph file that the document uses, such as `north/rivers`, it is
    /// the place of the use. Returns None when the document has no such node.
    #[must_use]
    pub fn of_node(document: &Document, node: &str) -> Option<Self> {
        let entry = document.node(node.split('/').next()?)?;
        let (line, column) = line_column(document.source(), entry.span.start);
        let file = document.path().map_or_else(String::new, |path| path.display().to_string());
        Some(Self { node: node.to_owned(), file, line, column })
    }
}

impl fmt::Display for Spot {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { file, line, column, .. } = self;
        if file.is_empty() { write!(f, "line {line}, column {column}") } else { write!(f, "{file}:{line}:{column}") }
    }
}

impl Failure {
    const fn new(exit: Exit, code: &'static str, message: String) -> Self {
        Self { exit, message, hint: None, code, place: None }
    }

    /// The file or the request is wrong.
    pub fn wrong(message: impl Into<String>) -> Self {
        Self::new(Exit::Wrong, "request", message.into())
    }

    /// The command could not be carried out.
    pub fn unable(message: impl Into<String>) -> Self {
        Self::new(Exit::Unable, "unable", message.into())
    }

    /// The program was stopped.
    #[must_use]
    pub fn stopped() -> Self {
        Self::new(Exit::Stopped, "stopped", "stopped; nothing was written".to_owned())
    }

    /// A failure that has already been reported.
    #[must_use]
    pub const fn silent(exit: Exit) -> Self {
        Self::new(exit, "problems", String::new())
    }

    /// Adds a hint.
    #[must_use]
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Failure {}

/// The reason of an input or output error as plain text.
#[must_use]
pub fn reason(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "there is no such file or folder".to_owned(),
        io::ErrorKind::PermissionDenied => "it is not permitted".to_owned(),
        io::ErrorKind::IsADirectory => "it is a folder, not a file".to_owned(),
        io::ErrorKind::NotADirectory => "a part of its path is a file, not a folder".to_owned(),
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => "the disk is full".to_owned(),
        io::ErrorKind::FileTooLarge => "the system does not allow a file of that size".to_owned(),
        io::ErrorKind::ReadOnlyFilesystem => "the disk cannot be written to".to_owned(),
        io::ErrorKind::InvalidData => "it is not text in UTF-8".to_owned(),
        _ => error.to_string(),
    }
}

/// The remedy when something cannot be written.
#[must_use]
pub fn remedy(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => "free some space",
        io::ErrorKind::FileTooLarge => "raise the limit on the size of files (`ulimit -f`)",
        io::ErrorKind::PermissionDenied => "allow writing to the folder",
        io::ErrorKind::ReadOnlyFilesystem => "make the disk writable",
        _ => "check the folder and the disk",
    }
}
