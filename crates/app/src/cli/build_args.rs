//! The arguments that `run` and `watch` share: a graph file, its outputs, and the folder for the files.

use std::path::PathBuf;

use crate::{
    build::request::{Changes, Means, Request},
    export::outputs::OutputOptions,
    report::failure::Failure,
};

/// What to build, and how.
#[derive(Debug, clap::Args)]
pub struct BuildArgs {
    /// Graph file
    #[arg(value_name = "GRAPH.ron")]
    pub file: PathBuf,
    /// Folder for the files; created if it does not exist
    #[arg(short, long, value_name = "DIR", default_value = "out")]
    pub out: PathBuf,
    /// Build only this output; can be given several times
    #[arg(long, value_name = "NAME")]
    pub only: Vec<String>,
    #[command(flatten)]
    pub changes: Changes,
    #[command(flatten)]
    pub options: OutputOptions,
    #[command(flatten)]
    pub means: Means,
}

impl BuildArgs {
    /// Makes the request and prints the problems of the file; `warnings` decides whether warnings are printed too.
    ///
    /// # Errors
    /// As [`Request::new`], and when there is nothing to build.
    pub fn request(&self, warnings: bool) -> Result<Request, Failure> {
        let request = Request::new(&self.file, &self.changes, &orograph_nodes::registry(), warnings)?;
        let request = request.only(&self.only)?;
        if request.outputs.is_empty() {
            return Err(Failure::wrong(format!(
                "`{}` has no outputs, so there is nothing to build",
                self.file.display()
            ))
            .hint("add one, such as `outputs: { \"height\": \"NODE\" }`"));
        }
        Ok(request)
    }
}
