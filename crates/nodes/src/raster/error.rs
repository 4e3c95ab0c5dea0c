//! Problems with raster files, and their remedies.

use std::{
    io,
    path::{Path, PathBuf},
};

use orograph_graph::{
    NodeError,
    memory::{OutOfMemory, REMEDY},
};

/// A raster file that could not be read or written: the file and its [`Problem`].
#[derive(Debug, thiserror::Error)]
#[error("`{}`: {problem}", path.display())]
pub struct RasterError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong.
    #[source]
    pub problem: Problem,
}

/// A problem with a raster file. [`Problem::remedy`] returns its remedy.
#[derive(Debug, thiserror::Error)]
pub enum Problem {
    /// The file does not exist.
    #[error("there is no such file")]
    Missing,
    /// The path is a folder.
    #[error("this is a folder, not a file")]
    Folder,
    /// The path is a device, a pipe or a socket.
    #[error("this is not a regular file")]
    NotRegular,
    /// The operating system failed to read the file.
    #[error("it cannot be read: {0}")]
    Unreadable(#[source] io::Error),
    /// Neither its first bytes nor its extension are recognised.
    #[error("its format is not known")]
    UnknownFormat,
    /// It has no cells.
    #[error("a raster of {columns} x {rows} cells has nothing in it")]
    Empty {
        /// Columns it claims.
        columns: u64,
        /// Rows it claims.
        rows: u64,
    },
    /// It has more cells than this program reads.
    #[error("a raster of {columns} x {rows} cells is more than can be read; the most is {cells} cells and {wide} columns", cells = super::MAX_CELLS, wide = super::MAX_COLUMNS)]
    TooLarge {
        /// Columns it claims.
        columns: u64,
        /// Rows it claims.
        rows: u64,
    },
    /// Its header claims more than the file can hold under any compression.
    #[error("its header or sidecar claims {columns} x {rows} cells, which its {held} bytes cannot hold")]
    Lying {
        /// Columns it claims.
        columns: u64,
        /// Rows it claims.
        rows: u64,
        /// Length of the file in bytes.
        held: u64,
    },
    /// It ends too early.
    #[error("it is cut off: {0}")]
    Truncated(String),
    /// It contradicts itself or its format.
    #[error("it is damaged: {0}")]
    Damaged(String),
    /// It is valid, but of an unsupported variant.
    #[error("{what} is not supported")]
    Unsupported {
        /// The variant.
        what: String,
        /// Advice for a supported variant.
        remedy: &'static str,
    },
    /// A raw file whose number of columns is not known.
    #[error("it has no header, no sidecar, and its {bytes} bytes are not a square of {per_cell}-byte cells")]
    NoShape {
        /// Length of the file.
        bytes: u64,
        /// Bytes per cell.
        per_cell: u64,
    },
    /// Its sidecar is invalid.
    #[error("its sidecar `{}` is wrong: {what}", path.display())]
    Sidecar {
        /// The sidecar.
        path: PathBuf,
        /// The fault of the sidecar.
        what: String,
    },
    /// No cell has a value.
    #[error("every cell is void")]
    AllVoid,
    /// Its cells are in degrees and its latitude is not known, or is beyond the poles.
    #[error("its cells are in degrees, but it does not say at which latitude")]
    NoLatitude,
    /// Its cell size is not known.
    #[error("it does not say how large its cells are")]
    NoCellSize,
    /// It cannot be joined with others.
    #[error("it is not on the grid of the others: {0}")]
    OffGrid(String),
    /// It was cancelled.
    #[error("it was stopped before its end")]
    Stopped,
    /// There was not enough memory.
    #[error(transparent)]
    OutOfMemory(#[from] OutOfMemory),
    /// The operating system failed to write it.
    #[error("it cannot be written: {0}")]
    Unwritable(#[source] io::Error),
    /// Rows that a writer cannot accept: a caller's mistake, never a file's.
    #[error("its rows do not fit: {0}")]
    Misfit(String),
    /// A 16-bit format cannot hold samples that are not numbers.
    #[error("{count} cells are not finite, which a 16-bit format cannot hold")]
    NotFinite {
        /// The number of these cells.
        count: usize,
    },
}

impl Problem {
    /// Returns the remedy, as one clause without a full stop.
    #[must_use]
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::Missing => "check the name; it is relative to the graph file's folder",
            Self::Folder => "name a file inside it",
            Self::NotRegular => "copy its contents into a file first",
            Self::Unreadable(_) => "check that the file may be read and the disk is sound",
            Self::UnknownFormat => {
                "readable are GeoTIFF, grey PNG, OpenEXR, ESRI ASCII grids (.asc), SRTM (.hgt) and raw .r16 and .r32"
            }
            Self::Empty { .. } => "export it again with at least one row and one column",
            Self::TooLarge { .. } => "cut out the part that is needed, or average it to larger cells",
            Self::Lying { .. } | Self::Truncated(_) | Self::Damaged(_) => {
                "fetch or export the file again; it may not have been copied whole"
            }
            Self::Unsupported { remedy, .. } => remedy,
            Self::NoShape { .. } => {
                "write a sidecar beside it, named like it with `.json` at the end: {\"columns\": 1024, \"rows\": 512}"
            }
            Self::Sidecar { .. } => {
                "correct the sidecar, or remove it and say the range and the cell size in the graph"
            }
            Self::AllVoid => "choose a file that has data, or check the value it declares as no data",
            Self::NoLatitude => {
                "say the size of a cell in metres, or give the file its place (N40W106.hgt, a GeoTIFF with tags)"
            }
            Self::OffGrid(_) => {
                "join tiles of one product, or make one file of them: `gdalwarp a.tif b.tif joined.tif`"
            }
            Self::Stopped => "try again",
            Self::OutOfMemory(_) => REMEDY,
            Self::NoCellSize => "say the size of a cell in metres",
            Self::Unwritable(_) => "choose a folder that may be written to, and check that the disk has room",
            Self::Misfit(_) => "this is a mistake of the program; write the outputs one by one with `--only`",
            Self::NotFinite { .. } => "find the node that gives them, or write exr, tiff or r32",
        }
    }

    /// Returns the problem as the error of a file.
    #[must_use]
    pub fn of(self, path: &Path) -> RasterError {
        RasterError { path: path.to_owned(), problem: self }
    }

    pub(super) fn damaged(what: impl Into<String>) -> Self {
        Self::Damaged(what.into())
    }

    pub(super) fn truncated(what: impl Into<String>) -> Self {
        Self::Truncated(what.into())
    }
}

impl RasterError {
    /// Returns the remedy, as one clause without a full stop.
    #[must_use]
    pub fn remedy(&self) -> &'static str {
        self.problem.remedy()
    }
}

impl From<RasterError> for NodeError {
    fn from(error: RasterError) -> Self {
        match error.problem {
            Problem::OutOfMemory(refused) => Self::OutOfMemory(refused),
            _ => Self::failed_with_hint(error.to_string(), error.remedy()),
        }
    }
}
