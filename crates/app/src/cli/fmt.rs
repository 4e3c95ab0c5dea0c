//! `orograph fmt`: the canonical form of graph files.

use std::path::{Path, PathBuf};

use orograph_graph::{Document, format_source};

use crate::report::{
    failure::{Exit, Failure, reason, remedy},
    problems,
    terminal::{self, Page, counted},
};

/// Formats graph files in canonical form; comments, order and meaning stay the same
///
/// With `-`, it reads standard input and writes standard output, as text editors expect of a formatter.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Graph files; `-` is standard input
    #[arg(required = true, value_name = "GRAPH.ron")]
    files: Vec<PathBuf>,
    /// Change nothing: list the files that are not in canonical form, and exit with 1 if there are any
    #[arg(long)]
    check: bool,
}

impl Args {
    pub(super) fn run(self) -> Result<(), Failure> {
        let mut worst = Exit::Done;
        let mut changed = Vec::new();
        for file in &self.files {
            match self.format(file) {
                Ok(true) => changed.push(file),
                Ok(false) => {}
                Err(failure) => {
                    worst = if worst == Exit::Unable { worst } else { failure.exit };
                    terminal::complain(&failure);
                }
            }
        }
        let (page, what) = (Page::stdout(), if self.check { "not canonical" } else { "formatted" });
        let lines: String =
            changed.iter().map(|file| format!("{what} {}\n", page.name(&file.display().to_string()))).collect();
        terminal::print(&lines)?;
        if self.check && !changed.is_empty() && worst == Exit::Done {
            return Err(Failure::wrong(format!("{} not in canonical form", counted(changed.len(), "file")))
                .hint("`orograph fmt` writes it"));
        }
        if worst == Exit::Done { Ok(()) } else { Err(Failure::silent(worst)) }
    }

    /// Formats one file, or standard input to standard output. Returns true if the file was not in canonical form.
    fn format(&self, file: &Path) -> Result<bool, Failure> {
        let is_filter = file == Path::new(problems::STDIN) && !self.check;
        let registry = orograph_nodes::registry();
        let document = problems::load(file, &registry)?;
        let canonical = format_source(document.source()).map_err(|mistakes| {
            terminal::remark(&problems::report(&mistakes, document.source(), file, Page::stderr()));
            Failure::silent(Exit::Wrong)
        })?;
        if is_filter {
            terminal::print(&canonical)?;
            return Ok(false);
        }
        if canonical == document.source() {
            return Ok(false);
        }
        if !self.check {
            Document::parse_at(canonical, file, &registry).save(file).map_err(|error| {
                Failure::unable(format!("cannot write `{}`: {}", file.display(), reason(&error)))
                    .hint(format!("the file is unchanged; {}", remedy(&error)))
            })?;
        }
        Ok(true)
    }
}
