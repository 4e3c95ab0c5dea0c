//! Archives: a graph with every file that it reads, as one file.
//!
//! An archive is a tar file (POSIX.1-1988, "ustar") compressed with gzip, named `*.orograph`. Its first entry is the graph;
//! the others follow in the order of their names. There are only plain files in it, with names of letters, digits and a
//! few signs, relative and without `..`; time, owner and rights say nothing, so that equal graphs give equal archives.
//!
//! What is read is not trusted: [`unpack()`] refuses everything else before it writes, and bounds what it writes.

mod pack;
mod unpack;

use std::path::{Path, PathBuf};

use orograph_graph::memory::Leftover;
use tempfile::TempDir;

pub use pack::{Packed, pack};
pub use unpack::{Unpacked, unpack, unpack_into};

use crate::failure::{Failure, reason};

/// What the name of an archive ends with.
pub const EXTENSION: &str = "orograph";

/// Whether a file is an archive, by its name.
#[must_use]
pub fn is_archive(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(EXTENSION))
}

/// Why a name cannot stand in an archive; `None` for one that can, on every system.
fn fault_of(name: &str) -> Option<&'static str> {
    if name.is_empty() || name.len() > 200 {
        return Some("is empty or longer than 200 bytes");
    }
    if name.starts_with('/') {
        return Some("is absolute");
    }
    if name.chars().any(|c| c.is_control() || matches!(c, '\\' | ':' | '*' | '?' | '"' | '<' | '>' | '|')) {
        return Some("has a sign that names of files do not have everywhere");
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
            _ if part.ends_with(['.', ' ']) => Some("has a part that ends with a point or a space"),
            _ if device => Some("has a part that is the name of a device on some systems"),
            _ => None,
        }
    })
}

/// A graph file to read: one named as such, or that of an archive, unpacked for as long as this lives.
#[derive(Debug)]
pub struct Source {
    /// The graph file.
    pub path: PathBuf,
    /// The archive as it was named, and where its files are.
    unpacked: Option<(PathBuf, TempDir)>,
    /// Removes them when the program ends for lack of memory.
    _leftover: Option<Leftover>,
}

impl Source {
    /// A graph file that is in no archive.
    #[must_use]
    pub fn file(path: &Path) -> Self {
        Self { path: path.to_owned(), unpacked: None, _leftover: None }
    }

    /// The graph file at a path, which may be an archive.
    ///
    /// # Errors
    /// When it is an archive that cannot be read or trusted.
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

    /// A text for people, in which files of the archive are named by it and not by where they are unpacked.
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
    fn names_that_lead_astray_are_refused() {
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
