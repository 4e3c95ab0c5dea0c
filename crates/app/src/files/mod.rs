//! Input files: archives, height files, and file watching.

pub mod archive;
pub mod heightfile;
pub(crate) mod watch;

use std::{collections::BTreeSet, path::PathBuf};

use orograph_graph::Document;
use orograph_nodes::raster;

/// The files that a graph reads, each with its side file, whether they exist or not. Includes the files of a graph with
/// problems: they may be the cause.
pub(crate) fn read_by(document: &Document) -> BTreeSet<PathBuf> {
    document.files().into_iter().flat_map(|file| [raster::sidecar_path(&file), file]).collect()
}

/// Returns true if Windows keeps a name for a device, with any ending and in any case.
pub(crate) fn is_device(name: &str) -> bool {
    let stem = name.split('.').next().unwrap_or(name).trim_end().to_ascii_lowercase();
    let is_port = ["com", "lpt"].iter().any(|port| {
        stem.strip_prefix(port).is_some_and(|number| number.len() == 1 && number.chars().all(|c| c.is_ascii_digit()))
    });
    is_port || ["con", "prn", "aux", "nul"].contains(&stem.as_str())
}
