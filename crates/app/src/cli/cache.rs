//! `orograph cache`: the folder of stored results.

use orograph_graph::bytes;

use crate::{
    build::storage::{self, Storage},
    report::{
        failure::{Failure, reason},
        terminal::{self, counted},
    },
};

/// Shows or empties the folder that stores results between runs
///
/// You can delete it at any time: missing results are computed again. The variable OROGRAPH_CACHE sets another folder;
/// an empty value turns storing off.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    action: Option<Action>,
    /// Another folder of results, as in `run --cache`
    #[arg(long, value_name = "DIR", global = true)]
    cache: Option<std::path::PathBuf>,
}

#[derive(Debug, clap::Subcommand)]
enum Action {
    /// Delete all stored results
    Clear,
}

impl Args {
    pub(super) fn run(self) -> Result<(), Failure> {
        let storage = Storage { cache: self.cache, ..Storage::default() };
        let Some(place) = storage.folder()? else {
            return terminal::print(&format!("results are not stored: {} is empty\n", storage::VARIABLE));
        };
        let unable = |error: std::io::Error| {
            Failure::unable(format!("cannot read the folder `{}`: {}", place.folder.display(), reason(&error)))
                .hint(format!("name another folder with `--cache DIR` or the variable {}", storage::VARIABLE))
        };
        match self.action {
            None => {
                let usage = place.usage().map_err(unable)?;
                let refusal = place.refusal().map(|why| format!("unused  {why}\n")).unwrap_or_default();
                let text = format!(
                    "folder  {}\nsize    {} in {}\nlimit   {}\n{refusal}",
                    place.folder.display(),
                    bytes(usage.bytes),
                    counted(usage.files as usize, "result"),
                    bytes(place.budget)
                );
                terminal::print(&text)
            }
            Some(Action::Clear) => {
                let cleared = place.clear().map_err(unable)?;
                let count = counted(cleared.files as usize, "result");
                terminal::print(&format!("deleted {count}, {}\n", bytes(cleared.bytes)))
            }
        }
    }
}
