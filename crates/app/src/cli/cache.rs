//! `orograph cache`: the folder of stored results.

use orograph_graph::bytes;
use serde_json::json;

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
    /// Print one JSON object: `folder`, `bytes`, `results`, `limit_bytes`, `unused` (the reason, or null); of `clear`,
    /// `deleted` and `bytes`
    #[arg(long, global = true)]
    json: bool,
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
            let why = format!("results are not stored: {} is empty", storage::VARIABLE);
            let nothing = json!({"folder": null, "bytes": 0, "results": 0, "limit_bytes": 0, "unused": why});
            return terminal::print(&if self.json { format!("{nothing}\n") } else { format!("{why}\n") });
        };
        let unable = |error: std::io::Error| {
            Failure::unable(format!("cannot read the folder `{}`: {}", place.folder.display(), reason(&error)))
                .hint(format!("name another folder with `--cache DIR` or the variable {}", storage::VARIABLE))
        };
        match self.action {
            None => {
                let usage = place.usage().map_err(unable)?;
                if self.json {
                    let facts = json!({
                        "folder": place.folder.display().to_string(), "bytes": usage.bytes, "results": usage.files,
                        "limit_bytes": place.budget, "unused": place.refusal(),
                    });
                    return terminal::print(&format!("{facts}\n"));
                }
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
                if self.json {
                    let facts = json!({"deleted": cleared.files, "bytes": cleared.bytes});
                    return terminal::print(&format!("{facts}\n"));
                }
                let count = counted(cleared.files as usize, "result");
                terminal::print(&format!("deleted {count}, {}\n", bytes(cleared.bytes)))
            }
        }
    }
}
