//! `orograph diff`: what changed between two graph files.

use std::path::PathBuf;

use crate::{
    files::archive::Source,
    report::{failure::Failure, problems, terminal},
};

/// Lists what changed from one graph file to another
///
/// Comments, order, layout and the notation of values do not count: two files without a difference build the same
/// terrain.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The earlier file
    #[arg(value_name = "A.ron")]
    a: PathBuf,
    /// The later file
    #[arg(value_name = "B.ron")]
    b: PathBuf,
    /// Exit with 1 if there is a difference
    #[arg(long)]
    exit_code: bool,
    /// Print the changes as JSON: `{"changes":[TEXT,...]}`
    #[arg(long)]
    json: bool,
}

impl Args {
    pub(super) fn run(self) -> Result<(), Failure> {
        let registry = orograph_nodes::registry();
        let (a, b) = (Source::open(&self.a)?, Source::open(&self.b)?);
        let a = problems::open_sound(&a, &registry, false)?;
        let b = problems::open_sound(&b, &registry, false)?;
        let changes = orograph_graph::diff(&a, &b);
        let text = match changes.is_empty() {
            _ if self.json => format!("{}\n", serde_json::json!({"changes": changes})),
            true => "no difference in what they build\n".to_owned(),
            false => changes.iter().map(|change| format!("{change}\n")).collect(),
        };
        terminal::print(&text)?;
        if self.exit_code && !changes.is_empty() { Err(Failure::silent(crate::Exit::Wrong)) } else { Ok(()) }
    }
}
