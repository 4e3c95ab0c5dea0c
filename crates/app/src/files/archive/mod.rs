//! Archives: a graph with every file that it reads, as one file.
//!
//! An archive is a tar file (POSIX.1-1988, "ustar") compressed with gzip, named `*.orograph`. Its first entry is the
//! graph; the others follow in the order of their names. It contains only plain files, with names of letters, digits
//! and a few signs, relative and without `..`; time, owner and permissions are constant, so that equal graphs give
//! equal archives.
//!
//! Archives are not trusted: [`unpack()`] refuses everything else before it writes, and limits what it writes. Neither
//! are graphs of others: [`pack()`] takes only graphs and rasters, and files outside the graph's folder only on
//! request.

#[cfg(test)]
mod hostile;
mod pack;
mod unpack;

use std::path::{Path, PathBuf};

use orograph_graph::files::Staging;

pub use pack::{Packed, pack};
pub use unpack::{Unpacked, unpack, unpack_into};

use super::is_device;
use crate::report::failure::{Failure, reason, remedy};

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
    if name.chars().any(turns) {
        return Some("has a character that turns the direction of writing");
    }
    let mut parts = name.split('/');
    let fault = parts.find_map(|part| match part {
        "" => Some("has an empty part"),
        "." | ".." => Some("leads out of the folder"),
        _ if part.starts_with('.') => Some("has a part that begins with a dot, which programs take for their settings"),
        _ if part.ends_with(['.', ' ']) => Some("has a part that ends with a dot or a space"),
        _ if is_device(part) => Some("has a part that is the name of a device on some systems"),
        _ if part.len() > 100 => Some("has a part longer than 100 bytes"),
        _ => None,
    });
    fault.or_else(|| tar::Header::new_ustar().set_path(name).is_err().then_some("has parts that are too long together"))
}

/// Returns true for characters that turn the direction of writing, with which a name can show another.
const fn turns(c: char) -> bool {
    matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// A graph file: one on disk, or that of an archive, which stays unpacked while this lives.
#[derive(Debug)]
pub struct Source {
    /// The graph file.
    pub path: PathBuf,
    /// The path of the archive, and the folder of its files.
    unpacked: Option<(PathBuf, Staging)>,
}

impl Source {
    /// A graph file that is not in an archive.
    #[must_use]
    pub fn file(path: &Path) -> Self {
        Self { path: path.to_owned(), unpacked: None }
    }

    /// The graph file at a path, which may be an archive.
    ///
    /// # Errors
    /// When it is an archive that cannot be read or is unsafe.
    pub fn open(path: &Path) -> Result<Self, Failure> {
        if !is_archive(path) {
            return Ok(Self::file(path));
        }
        let temporary = std::env::temp_dir();
        let staging = Staging::begin(&temporary, &[]).map_err(|error| {
            Failure::unable(format!("cannot make a folder to unpack `{}`: {}", path.display(), reason(&error))).hint(
                format!("{} of `{}`, or name another with the variable TMPDIR", remedy(&error), temporary.display()),
            )
        })?;
        let graph = staging.files().join(unpack_into(path, &staging.files())?.graph);
        Ok(Self { path: graph, unpacked: Some((path.to_owned(), staging)) })
    }

    /// Replaces temporary paths of the archive's files in a text by the path of the archive.
    #[must_use]
    pub fn shown(&self, text: &str) -> String {
        match &self.unpacked {
            Some((archive, staging)) => {
                text.replace(&staging.files().display().to_string(), &archive.display().to_string())
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
            ".hidden",
            "a/.git/config",
            "a\u{202e}nor.b",
            "lib/\u{2066}a",
        ] {
            assert!(fault_of(name).is_some(), "{name:?}");
        }
        for long in [vec![101], vec![97, 61, 40], vec![80; 3]] {
            let parts: Vec<String> = long.iter().map(|bytes| "a".repeat(*bytes)).collect();
            assert!(fault_of(&parts.join("/")).is_some(), "{long:?}");
        }
        let long = format!("{}/{}", "a".repeat(99), "b".repeat(100));
        for name in ["g.ron", "lib/ridge.ron", "data/Höhe 2.tif", "console.ron", "a..b", &long] {
            assert_eq!(fault_of(name), None, "{name:?}");
        }
    }
}
