//! Where results are stored between runs of the program, and the limits of memory and disk.

use std::{path::PathBuf, sync::Arc, time::Duration};

use directories::ProjectDirs;
use orograph_graph::{Store, StoreFolder, Trust, machine};

use crate::report::failure::Failure;

/// The variable that sets another folder; an empty value turns storing off.
pub const VARIABLE: &str = "OROGRAPH_CACHE";
/// Maximum size of the folder in bytes.
const DISK_BUDGET: u64 = 10 << 30;
/// Results that took less time are written only while the editor is idle.
const WORTH: Duration = Duration::from_millis(300);

/// Whether and where results are stored.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct Storage {
    /// Folder that stores all results between runs, so that only what has changed is computed; up to 10 GiB
    ///
    /// Without it, results that took 0.3 s and more are stored in the cache folder of the system (`orograph cache`
    /// shows it), or in the folder of the variable OROGRAPH_CACHE.
    #[arg(long, value_name = "DIR", conflicts_with = "no_cache")]
    pub cache: Option<PathBuf>,
    /// Store nothing, and compute everything
    #[arg(long)]
    pub no_cache: bool,
    /// Also read results that other users stored, and use a folder into which everyone may write
    ///
    /// Whoever can write to the folder can then change your results.
    #[arg(long, conflicts_with = "no_cache")]
    pub cache_trust: bool,
}

impl Storage {
    /// The folder. Returns None when storing is off.
    ///
    /// # Errors
    /// When the requested folder is a file.
    pub fn folder(&self) -> Result<Option<StoreFolder>, Failure> {
        if let Some(cache) = self.cache.as_ref().filter(|cache| cache.exists() && !cache.is_dir()) {
            return Err(Failure::wrong(format!("`{}` is a file; `--cache` takes a folder", cache.display())));
        }
        let folder = match &self.cache {
            Some(folder) => Some(folder.clone()),
            None if self.no_cache => None,
            None => standard_folder(),
        };
        // A folder that was requested stores everything.
        let worth = if self.cache.is_some() { Duration::ZERO } else { WORTH };
        let trust = if self.cache_trust { Trust::Anyone } else { Trust::Own };
        Ok(folder.map(|folder| StoreFolder { folder, budget: DISK_BUDGET, worth, trust }))
    }

    /// A store that keeps this many bytes in memory.
    ///
    /// # Errors
    /// As [`Self::folder`].
    pub fn store(&self, memory: usize) -> Result<Arc<Store>, Failure> {
        Ok(Arc::new(Store::new(memory, self.folder()?)))
    }
}

/// The folder of [`VARIABLE`], or that of the system. Returns None when there is neither.
fn standard_folder() -> Option<PathBuf> {
    match std::env::var_os(VARIABLE) {
        Some(folder) if folder.is_empty() => None,
        Some(folder) => std::path::absolute(folder).ok(),
        None => Some(ProjectDirs::from("", "", "orograph")?.cache_dir().to_owned()),
    }
}

/// A store without a folder: it keeps results as long as the program runs.
#[must_use]
pub fn in_memory() -> Arc<Store> {
    Arc::new(Store::new(memory_budget(), None))
}

/// Bytes of results that a session keeps in memory: a quarter of the machine's.
#[must_use]
pub fn memory_budget() -> usize {
    const LEAST: u64 = 256 << 20;
    let total = machine::total().unwrap_or(8 << 30);
    usize::try_from((total / 4).max(LEAST)).unwrap_or(usize::MAX)
}
