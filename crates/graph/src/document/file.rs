//! A document on disk: read whole, written to a temporary file and renamed into place.

use std::{
    io::{self, Read, Write as _},
    path::{Path, PathBuf},
};

use super::Document;
use crate::{
    files::{Access, Part},
    input,
    registry::Registry,
    world::bytes,
};

/// The largest file that is read, in bytes. A graph of ten thousand nodes takes about 3 MB.
const MAX_BYTES: u64 = 16 << 20;

/// Why a file could not be read as text.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// There is no such file.
    #[error("there is no file `{}`; check the name", .0.display())]
    Missing(PathBuf),
    /// The path is a folder.
    #[error("`{}` is a folder; name a graph file in it", .0.display())]
    Folder(PathBuf),
    /// The path is a pipe, a device or a socket.
    #[error("`{}` is not a regular file but a pipe, a device or a socket; copy its contents into a file", .0.display())]
    Irregular(PathBuf),
    /// The file is too large to be a graph file.
    #[error("`{}` has more than {most}; a graph file is a short text that refers to its rasters by name", .0.display(), most = bytes(MAX_BYTES))]
    TooLarge(PathBuf),
    /// The file is not text.
    #[error("`{}` is not UTF-8 text (byte {} is not valid); save it as UTF-8, or name a graph file", .path.display(), .at)]
    NotText {
        /// The file.
        path: PathBuf,
        /// The first invalid byte.
        at: usize,
    },
    /// The system failed to read it.
    #[error("`{}` cannot be read: {source}", .path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The error of the system.
        source: io::Error,
    },
}

impl Document {
    /// Reads a file. Problems of its contents are in [`Document::problems`].
    ///
    /// # Errors
    /// [`LoadError`] when it cannot be read as text of at most 16 MiB.
    pub fn load(path: impl AsRef<Path>, registry: &Registry) -> Result<Self, LoadError> {
        Ok(Self::parse_at(read(path.as_ref())?, path, registry))
    }

    /// Reads a graph file from a stream, such as standard input, as if it were at `path`.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn load_from(stream: impl Read, path: impl AsRef<Path>, registry: &Registry) -> Result<Self, LoadError> {
        Ok(Self::parse_at(text_of(stream, path.as_ref())?, path, registry))
    }

    /// Writes the file: first a temporary file in the same folder, flushed to disk, then renamed into place. A reader
    /// never sees half of it, and a failure leaves the earlier file unchanged.
    ///
    /// # Errors
    /// The error of the system, when the folder cannot be written or the disk is full.
    pub fn save(&self, path: impl AsRef<Path>) -> io::Result<()> {
        // Follow a link, so that it remains a link.
        let path = path.as_ref();
        let target = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        let mut part = Part::begin(&target, Access::Usual)?;
        part.write_all(self.source().as_bytes())?;
        if let Ok(earlier) = std::fs::metadata(&target) {
            part.file().set_permissions(earlier.permissions())?;
        }
        part.persist().map(drop)
    }
}

pub(super) fn read(path: &Path) -> Result<String, LoadError> {
    let unreadable = |source| LoadError::Unreadable { path: path.to_owned(), source };
    let (file, _) = input::open(path).map_err(|error| match error.kind() {
        io::ErrorKind::NotFound => LoadError::Missing(path.to_owned()),
        io::ErrorKind::IsADirectory => LoadError::Folder(path.to_owned()),
        _ if input::is_irregular(&error) => LoadError::Irregular(path.to_owned()),
        _ => unreadable(error),
    })?;
    text_of(file, path)
}

/// Reads the text of a graph file to its end. `path` is its name in errors.
fn text_of(file: impl Read, path: &Path) -> Result<String, LoadError> {
    let unreadable = |source| LoadError::Unreadable { path: path.to_owned(), source };
    let mut text = Vec::new();
    file.take(MAX_BYTES + 1).read_to_end(&mut text).map_err(unreadable)?;
    if text.len() as u64 > MAX_BYTES {
        return Err(LoadError::TooLarge(path.to_owned()));
    }
    String::from_utf8(text)
        .map_err(|error| LoadError::NotText { path: path.to_owned(), at: error.utf8_error().valid_up_to() })
}
