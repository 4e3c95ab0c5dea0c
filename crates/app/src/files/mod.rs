//! Input files: archives, height files, and file watching.

pub mod archive;
pub mod heightfile;
pub(crate) mod watch;

use std::{
    collections::BTreeSet,
    io,
    path::{Path, PathBuf},
};

use orograph_graph::{Document, input};
use orograph_nodes::raster;

use crate::report::failure::Failure;

/// The files that a graph reads, each with its side file, whether they exist or not. Includes the files of a graph with
/// problems: they may be the cause.
pub(crate) fn read_by(document: &Document) -> BTreeSet<PathBuf> {
    document.files().into_iter().flat_map(|file| [raster::sidecar_path(&file), file]).collect()
}

/// The hash of a file's contents; that of nothing for a file that is not there.
///
/// # Errors
/// When the file cannot be read.
pub(crate) fn contents(path: &Path) -> io::Result<blake3::Hash> {
    let mut hash = blake3::Hasher::new();
    if let Ok((file, _)) = input::open(path) {
        hash.update_reader(file)?;
    }
    Ok(hash.finalize())
}

/// Refuses to write a file over one that is read.
///
/// # Errors
/// When the file that would be written is one of those.
pub(crate) fn refuse_over(out: &Path, read: impl IntoIterator<Item = PathBuf>) -> Result<(), Failure> {
    let place = out.canonicalize().ok();
    if place.is_some() && read.into_iter().any(|file| file.canonicalize().ok() == place) {
        let what = format!("`{}` would be written over, but it is read", out.display());
        return Err(Failure::wrong(what).hint("choose another file with `-o`"));
    }
    Ok(())
}

/// Returns true if Windows keeps a name for a device, with any ending and in any case.
pub(crate) fn is_device(name: &str) -> bool {
    let stem = name.split('.').next().unwrap_or(name).trim_end().to_ascii_lowercase();
    let is_port = ["com", "lpt"].iter().any(|port| {
        stem.strip_prefix(port).is_some_and(|number| number.len() == 1 && number.chars().all(|c| c.is_ascii_digit()))
    });
    is_port || ["con", "prn", "aux", "nul"].contains(&stem.as_str())
}
