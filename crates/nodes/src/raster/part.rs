//! A file under a temporary name, which is renamed when it is complete.
//!
//! Readers never see an incomplete file, and a full disk leaves the previous file unchanged.

use std::{
    io::{self, BufRead, BufReader, BufWriter, Seek, SeekFrom, Write},
    path::Path,
};

use orograph_graph::files::{self, Access};

use super::{GoOn, Problem, RasterError};

/// A file that is being written. If it is dropped, the temporary file is removed.
pub(super) struct Part(BufWriter<files::Part>);

impl Part {
    /// Begins the temporary file for a path.
    pub(super) fn begin(path: &Path) -> Result<Self, RasterError> {
        let part = files::Part::begin(path, Access::Usual).map_err(|error| Problem::Unwritable(error).of(path))?;
        Ok(Self(BufWriter::with_capacity(1 << 18, part)))
    }

    /// Returns the reason of a failure: an operating system error, or cancellation.
    pub(super) fn fault(error: io::Error, path: &Path, go_on: GoOn<'_>) -> RasterError {
        if go_on() { Problem::Unwritable(error) } else { Problem::Stopped }.of(path)
    }

    /// Returns a reader of the bytes written so far.
    pub(super) fn reader(&mut self) -> io::Result<impl BufRead + Seek> {
        self.0.seek(SeekFrom::Start(0))?;
        Ok(BufReader::with_capacity(1 << 16, self.0.get_ref().file()))
    }

    /// Writes all buffered bytes; afterwards only the rename can fail.
    pub(super) fn complete(self, path: &Path) -> Result<Complete, RasterError> {
        let part = self.0.into_inner().map_err(|error| Problem::Unwritable(error.into_error()).of(path))?;
        Ok(Complete(part))
    }
}

impl Write for Part {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

impl Seek for Part {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.0.seek(to)
    }

    fn stream_position(&mut self) -> io::Result<u64> {
        self.0.stream_position()
    }
}

/// A complete file under its temporary name.
pub(super) struct Complete(files::Part);

impl Complete {
    /// Renames it to its final name.
    pub(super) fn persist(self, path: &Path) -> Result<(), RasterError> {
        self.0.persist().map(drop).map_err(|error| Problem::Unwritable(error).of(path))
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
