//! `orograph edit`: the editor.

use std::path::PathBuf;

use crate::report::failure::Failure;

/// Opens the editor on a file or on an empty graph
#[derive(Debug, Default, clap::Args)]
pub struct Args {
    /// Graph file or packed graph
    #[arg(value_name = "GRAPH.ron")]
    file: Option<PathBuf>,
}

impl Args {
    #[cfg(feature = "editor")]
    pub(super) fn run(self) -> Result<(), Failure> {
        crate::editor::open(self.file)
    }

    #[cfg(not(feature = "editor"))]
    pub(super) fn run(self) -> Result<(), Failure> {
        Err(Failure::wrong("this build has no editor").hint("build it with `--features editor`, or use `orograph run`"))
    }
}
