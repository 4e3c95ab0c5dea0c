//! What `run` and `watch` are asked for: a graph file, the outputs of it, and where they go.

use std::path::PathBuf;

use crate::{
    failure::Failure,
    outputs::Form,
    request::{Changes, Means, Request},
};

/// What is to be built, and how.
#[derive(Debug, clap::Args)]
pub struct Asked {
    /// Graph file
    #[arg(value_name = "GRAPH.ron")]
    pub file: PathBuf,
    /// Folder for the files; made if it does not exist
    #[arg(short, long, value_name = "DIR", default_value = "out")]
    pub out: PathBuf,
    /// Build only this output; may be given several times
    #[arg(long, value_name = "NAME")]
    pub only: Vec<String>,
    #[command(flatten)]
    pub changes: Changes,
    #[command(flatten)]
    pub form: Form,
    #[command(flatten)]
    pub means: Means,
}

impl Asked {
    /// The request, with the problems of the file shown; `warnings` says whether those that are no errors are.
    ///
    /// # Errors
    /// As [`Request::new`], and when there is nothing to build.
    pub fn request(&self, warnings: bool) -> Result<Request, Failure> {
        self.means.backend.check()?;
        let request = Request::new(&self.file, &self.changes, &orograph_nodes::registry(), warnings)?;
        let request = request.only(&self.only)?;
        if request.outputs.is_empty() {
            return Err(Failure::wrong(format!(
                "`{}` has no outputs, so there is nothing to build",
                self.file.display()
            ))
            .hint("name one, such as `outputs: { \"height\": \"NODE\" }`"));
        }
        Ok(request)
    }
}
