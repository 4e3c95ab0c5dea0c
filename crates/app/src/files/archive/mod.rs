//! Archives: a graph with every file that it reads, as one file.
//!
//! An archive is a tar file (POSIX.1-1988, "ustar") compressed with gzip, named `*.orograph`. Its first entry is the
//! graph; the others follow in the order of their names. It contains only plain files, with names of letters, digits
//! and a few signs, relative and without `..`; time, owner and permissions are constant, so that equal graphs give
//! equal archives.
//!
//! Archives are not trusted: [`unpack()`] refuses everything else before it writes, and limits what it writes.

mod pack;
mod unpack;

use std::path::{Path, PathBuf};

use orograph_graph::memory::Leftover;
use tempfile::TempDir;

pub use pack::{Packed, pack};
pub use unpack::{Unpacked, unpack, unpack_into};

use crate::report::failure::{Failure, reason};

/// The extension of archives.
pub const EXTENSION: &str = "orograph";

/// Returns true if a file is an archive, by its name.
#[must_use]
pub fn is_archive(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(EXTENSION))
}

/// Why a name is not allowed in an archive. Returns None for a name that is valid on every system.
fn fault_of(name: &str) -> Option<&'static str> {
    if name.is_empty() || name.len() > 200 {
        return Some("is empty or longer than 200 bytes");
    }
    if name.starts_with('/') {
        return Some("is absolute");
    }
    if name.chars().any(|c| c.is_control() || matches!(c, '\\' | ':' | '*' | '?' | '"' | '<' | '>' | '|')) {
        return Some("has a character that is not allowed in file names on some systems");
    }
    name.split('/').find_map(|part| {
        let stem = part.split('.').next().unwrap_or(part).to_ascii_lowercase();
        let device = ["con", "prn", "aux", "nul"].contains(&stem.as_str())
            || stem.len() == 4
                && (stem.starts_with("com") || stem.starts_with("lpt"))
                && stem.ends_with(|c: char| c.is_ascii_digit());
        match part {
            "" => Some("has an empty part"),
            "." | ".." => Some("leads out of the folder"),
            _ if part.ends_with(['.', ' ']) => Some("has a part that ends with a dot or a space"),
            _ if device => Some("has a part that is the name of a device on some systems"),
            _ => None,
        }
    })
}

/// A graph file: one on disk, or that of an archive, which stays unpacked while this lives.
#[derive(Debug)]
pub struct Source {
    /// The graph file.
    pub path: PathBuf,
    /// The path of the archive, and the folder of its files.
    unpacked: Option<(PathBuf, TempDir)>,
    /// Removes the files when the program ends for lack of memory.
    _leftover: Option<Leftover>,
}

impl Source {
    /// A graph file that is not in an archive.
    #[must_use]
    pub fn file(path: &Path) -> Self {
        Self { path: path.to_owned(), unpacked: None, _leftover: None }
    }

    /// The graph file at a path, which may be an archive.
    ///
    /// # Errors
    /// When it is an archive that cannot be read or is unsafe.
    pub fn open(path: &Path) -> Result<Self, Failure> {
        if !is_archive(path) {
            return Ok(Self::file(path));
        }
        let folder = tempfile::Builder::new().prefix("orograph-").tempdir().map_err(|error| {
            Failure::unable(format!("cannot make a folder to unpack `{}`: {}", path.display(), reason(&error)))
        })?;
        let leftover = Leftover::note(folder.path(), &[]);
        let graph = folder.path().join(unpack_into(path, folder.path())?.graph);
        let unpacked = Some((path.to_owned(), folder));
        Ok(Self { path: graph, unpacked, _leftover: Some(leftover) })
    }

    /// Replaces temporary paths of the archive's files in a text by the path of the archive.
    #[must_use]
    pub fn shown(&self, text: &str) -> String {
        match &self.unpacked {
            Some((archive, folder)) => {
                text.replace(&folder.path().display().to_string(), &archive.display().to_string())
            }
            None => text.to_owned(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unsafe_names_are_refused() {
        for name in [
            "",
            "/etc/passwd",
            "..",
            "../a",
            "a/../../b",
            "a//b",
            "./a",
            "a/.",
            "c:/a",
            "a\\b",
            "a\0b",
            "a\nb",
            "nul",
            "lib/COM1.ron",
            "a.",
            "a /b",
            "a?b",
        ] {
            assert!(fault_of(name).is_some(), "{name:?}");
        }
        for name in ["g.ron", "lib/ridge.ron", "data/Höhe 2.tif", ".hidden", "console.ron", "a..b"] {
            assert_eq!(fault_of(name), None, "{name:?}");
        }
    }
}
