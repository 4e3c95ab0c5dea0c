//! `orograph check`: the problems of graph files.

use std::path::PathBuf;

use crate::{
    cli::nodes,
    files::archive::Source,
    report::{
        failure::{Exit, Failure},
        problems,
        terminal::{self, Page, counted},
    },
};

/// Lists all problems of graph files at once, with their position and a fix
///
/// Builds nothing. Exits with 1 if a file has an error; warnings alone do not count.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Graph files
    #[arg(required = true, value_name = "GRAPH.ron")]
    files: Vec<PathBuf>,
    /// Print what a file without errors declares: its description, world, inputs, outputs and parameters
    #[arg(long)]
    describe: bool,
    /// Print the problems as JSON, one per line; with `--describe` also what each file declares
    #[arg(long)]
    json: bool,
}

impl Args {
    pub(super) fn run(self) -> Result<(), Failure> {
        let registry = orograph_nodes::registry();
        let mut worst = Exit::Done;
        for file in &self.files {
            let read = Source::open(file).and_then(|source| Ok((problems::load(&source.path, &registry)?, source)));
            let (document, source) = match read {
                Ok(read) => read,
                Err(failure) => {
                    worst = if worst == Exit::Unable { worst } else { failure.exit };
                    terminal::complain(&failure);
                    continue;
                }
            };
            if document.has_errors() && worst == Exit::Done {
                worst = Exit::Wrong;
            }
            if self.json {
                let lines: String =
                    problems::as_json(&document, &source.path).iter().map(|line| format!("{line}\n")).collect();
                terminal::print(&source.shown(&lines))?;
            } else {
                terminal::remark(&source.shown(&problems::report_all(&document, &source.path, Page::stderr())));
            }
            if self.describe && !document.has_errors() {
                terminal::print(&source.shown(&nodes::describe(&document, file, self.json)?))?;
            } else if !self.json && !document.has_errors() {
                let page = Page::stdout();
                let nodes = counted(document.nodes().len(), "node");
                let outputs = counted(document.outputs().len(), "output");
                let name = file.display();
                terminal::print(&format!(
                    "{} {name}  {}\n",
                    page.good("ok"),
                    page.dim(&format!("{nodes}, {outputs}"))
                ))?;
            }
        }
        if worst == Exit::Done { Ok(()) } else { Err(Failure::silent(worst)) }
    }
}
