//! `orograph check`: the problems of graph files.

use std::path::PathBuf;

use crate::{
    cli::nodes,
    files::archive::Source,
    memory,
    report::{
        failure::{Exit, Failure},
        problems,
        progress::JsonLines,
        terminal::{self, Page, counted},
    },
};

/// Lists all problems of graph files at once, with their position and a fix
///
/// Builds nothing. Exits with 1 if a file has an error, and with `--strict` also if it has a warning. What depends on the
/// terrain or the world, such as a lake without an outlet, is found by a run.
///
/// Notes name what changes no output: parameters that other settings switch off, and nodes that no output needs. They
/// never count as errors.
#[derive(Debug, clap::Args)]
#[command(after_long_help = HELP)]
pub struct Args {
    /// Graph files; `-` is standard input
    #[arg(required = true, value_name = "GRAPH.ron")]
    files: Vec<PathBuf>,
    /// Exit with 1 for warnings too, for builds that run unattended
    #[arg(long)]
    strict: bool,
    /// Print what a file without errors declares: its description, world, inputs, outputs and parameters
    #[arg(long)]
    describe: bool,
    /// Print events as lines of JSON: each problem and note, then a summary of the file, then with `--describe` what it
    /// declares
    #[arg(long)]
    json: bool,
}

/// The lines of `--json`.
const HELP: &str = r#"With --json, standard output has one JSON object per line:
  {"event":"problem","file":PATH,"line":L,"column":C,"severity":"error"|"warning"|"note","code":CODE,"message":TEXT,"help":TEXT|null}
  {"event":"checked","file":PATH,"nodes":N,"outputs":N,"errors":N,"warnings":N,"notes":N}
  {"event":"described","file":PATH,...} with `--describe`, for a file without errors
  {"event":"error","exit":N,"code":CODE,"message":TEXT,"help":TEXT|null} for a file that cannot be read"#;

impl Args {
    pub(super) fn run(self) -> Result<(), Failure> {
        if !self.json {
            return self.check();
        }
        memory::writes_json_lines();
        self.check().and_then(|()| JsonLines::complete())
    }

    fn check(self) -> Result<(), Failure> {
        let registry = orograph_nodes::registry();
        let mut worst = Exit::Done;
        for file in &self.files {
            let read = Source::open(file).and_then(|source| Ok((problems::load(&source.path, &registry)?, source)));
            let (document, source) = match read {
                Ok(read) => read,
                Err(failure) => {
                    worst = if worst == Exit::Unable { worst } else { failure.exit };
                    if self.json {
                        JsonLines::refused(&failure, file);
                    }
                    terminal::complain(&failure);
                    continue;
                }
            };
            let is_wrong = document.has_errors() || self.strict && !document.problems().is_empty();
            if is_wrong && worst == Exit::Done {
                worst = Exit::Wrong;
            }
            let notes = document.without_effect();
            if self.json {
                JsonLines::checked(&document, &notes, &source, file);
            } else {
                let page = Page::stderr();
                let text = problems::report_all(&document, &source.path, page);
                terminal::remark(&source.shown(&(text + &problems::notes(&notes, &document, &source.path, page))));
            }
            if self.describe && !document.has_errors() {
                terminal::print(&source.shown(&nodes::describe(&document, file, self.json)?))?;
            } else if !self.json && !document.has_errors() {
                let page = Page::stdout();
                let nodes = counted(document.nodes().len(), "node");
                let outputs = counted(document.outputs().len(), "output");
                let notes = match notes.len() {
                    0 => String::new(),
                    count => format!(", {}", counted(count, "note")),
                };
                let (ok, name) = (page.good("ok"), file.display());
                terminal::print(&format!("{ok} {name}  {}\n", page.dim(&format!("{nodes}, {outputs}{notes}"))))?;
            }
        }
        if worst == Exit::Done { Ok(()) } else { Err(Failure::silent(worst)) }
    }
}
