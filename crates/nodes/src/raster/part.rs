//! A file under a temporary name, which is renamed when it is complete.
//!
//! Readers never see an incomplete file, and a full disk leaves the previous file unchanged.

use std::{
    io::{self, BufRead, BufReader, BufWriter, Seek, SeekFrom, Write},
    path::Path,
};

use orograph_graph::memory::Leftover;
use tempfile::NamedTempFile;

use super::{GoOn, Problem, RasterError};

/// A file that is being written. If it is dropped, the temporary file is removed.
pub(super) struct Part {
    to: BufWriter<NamedTempFile>,
    /// Removes the temporary file if the program ends for lack of memory.
    leftover: Leftover,
}

impl Part {
    /// Begins the temporary file for a path.
    pub(super) fn begin(path: &Path) -> Result<Self, RasterError> {
        let folder = match path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        let mut builder = tempfile::Builder::new();
        builder.prefix(".orograph-").suffix(".part");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            // temporary files are private by default; results get the permissions of ordinary files under the umask
            builder.permissions(std::fs::Permissions::from_mode(0o666));
        }
        let file = builder.tempfile_in(folder).map_err(|error| Problem::Unwritable(error).of(path))?;
        let leftover = Leftover::note(file.path(), &[]);
        Ok(Self { to: BufWriter::with_capacity(1 << 18, file), leftover })
    }

    /// Returns the reason of a failure: an operating system error, or cancellation.
    pub(super) fn fault(error: io::Error, path: &Path, go_on: GoOn<'_>) -> RasterError {
        if go_on() { Problem::Unwritable(error) } else { Problem::Stopped }.of(path)
    }

    /// Returns a reader of the bytes written so far.
    pub(super) fn reader(&mut self) -> io::Result<impl BufRead + Seek> {
        self.to.seek(SeekFrom::Start(0))?;
        Ok(BufReader::with_capacity(1 << 16, self.to.get_ref().as_file()))
    }

    /// Writes all buffered bytes; afterwards only the rename can fail.
    pub(super) fn complete(self, path: &Path) -> Result<Complete, RasterError> {
        let file = self.to.into_inner().map_err(|error| Problem::Unwritable(error.into_error()).of(path))?;
        Ok(Complete { file, _leftover: self.leftover })
    }
}

impl Write for Part {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.to.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.to.flush()
    }
}

impl Seek for Part {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.to.seek(to)
    }

    fn stream_position(&mut self) -> io::Result<u64> {
        self.to.stream_position()
    }
}

/// A complete file under its temporary name.
pub(super) struct Complete {
    file: NamedTempFile,
    _leftover: Leftover,
}

impl Complete {
    /// Renames it to its final name.
    pub(super) fn persist(self, path: &Path) -> Result<(), RasterError> {
        match self.file.persist(path) {
            Ok(_) => Ok(()),
            Err(error) => Err(Problem::Unwritable(error.error).of(path)),
        }
    }
}

/// Writes a whole file of any kind: `fill` writes under a temporary name, which is renamed at the end.
///
/// # Errors
/// [`Problem::Unwritable`]; an earlier file of this name is then unchanged.
pub fn replace(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), RasterError> {
    staged(path, fill)?.persist(path)
}

/// Writes a complete file under a temporary name by `fill`.
pub(super) fn staged(
    path: &Path,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<Complete, RasterError> {
    let mut part = Part::begin(path)?;
    fill(&mut part).map_err(|error| Problem::Unwritable(error).of(path))?;
    part.complete(path)
}
