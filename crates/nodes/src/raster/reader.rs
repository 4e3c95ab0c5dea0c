//! Reads raster files row by row, in memory that does not grow with the raster.
//!
//! A [`Reader`] knows the [`Head`] of a file and hands its rows over in blocks of about a megabyte, north first.
//! Compressed data is unpacked as the rows are read. What cannot be read in this way is bounded: see [`Reader::bytes`].

use std::{
    io::{self, BufRead, BufReader, Read, Seek},
    path::Path,
    sync::Mutex,
};

use orograph_graph::{input, memory::zeroed};

use super::{
    Cell, Coding, GoOn, MAX_CELLS, Problem, Raster, RasterError, Scaling, Sidecar, VOID_FROM, Voids, ascii, exr,
    geotiff, hgt, png, prj, raw,
};

/// Samples of a block, of at least one row: a megabyte.
pub(super) const BLOCK: usize = 1 << 18;
/// Bytes that are read from a file at a time.
pub(super) const TURN: usize = 1 << 16;

/// What the header of a raster file says.
#[derive(Clone, Debug, PartialEq)]
pub struct Head {
    /// Number of columns.
    pub columns: usize,
    /// Number of rows.
    pub rows: usize,
    /// Conversion of codes to numbers; `None` if the samples are numbers.
    pub coding: Option<Coding>,
    /// Size of a cell, if the file gives it.
    pub cell: Option<Cell>,
    /// Easting or longitude, and northing or latitude, of the outer north-west corner, if the file gives them.
    pub origin: Option<[f64; 2]>,
    /// Metres in a unit of the origin, if it is in a projected reference system.
    pub unit_m: f64,
    /// EPSG code of the coordinate reference system, if the file gives it.
    pub epsg: Option<u32>,
    /// Conversion of stored samples to values, if the file gives one.
    pub scaling: Option<Scaling>,
    /// True if values that are customary for "no data" are voids: the file declares none of its own.
    pub assumes_voids: bool,
    /// What is assumed about the file, each a sentence without a full stop.
    pub notes: Vec<String>,
}

impl Head {
    /// Creates the head of a raster of numbers without a place.
    pub(super) const fn new(columns: usize, rows: usize) -> Self {
        Self {
            columns,
            rows,
            coding: None,
            cell: None,
            origin: None,
            unit_m: 1.0,
            epsg: None,
            scaling: None,
            assumes_voids: false,
            notes: Vec::new(),
        }
    }

    /// Returns the rows of a block.
    pub(super) fn block_rows(&self) -> usize {
        (BLOCK / self.columns).clamp(1, self.rows)
    }
}

/// The bytes of a file, or of memory.
pub(super) trait Bytes: BufRead + Seek + Send {}

impl<T: BufRead + Seek + Send> Bytes for T {}

/// The bytes of a file and their number.
pub(super) struct Source<'a> {
    pub(super) bytes: Box<dyn Bytes + 'a>,
    pub(super) length: u64,
}

/// Receives a block of whole rows and the number of the first one. It may change the samples.
pub type Each<'e> = dyn FnMut(usize, &mut [f32]) -> Result<(), Problem> + 'e;

/// The rows of a file that is open.
pub(super) trait Rows {
    /// Passes on all rows in blocks, from north to south.
    fn read(self: Box<Self>, go_on: GoOn<'_>, each: &mut Each<'_>) -> Result<(), Problem>;

    /// Returns the bytes that [`Self::read`] allocates.
    fn bytes(&self) -> u64;

    /// Returns about the number of rows of a block.
    fn block_rows(&self, head: &Head) -> usize {
        head.block_rows()
    }

    /// Returns false if every cell has a value, whatever the contents of the file.
    fn may_have_voids(&self) -> bool {
        true
    }
}

/// A raster file that is open: its header has been read, its rows have not.
pub struct Reader<'a> {
    /// What its header says.
    pub head: Head,
    pub(super) rows: Box<dyn Rows + 'a>,
}

impl Reader<'_> {
    /// Opens a raster file of any known format, which its first bytes identify, or else its extension.
    ///
    /// PNG, OpenEXR, raw files and ASCII grids are read together with their sidecar, if there is one
    /// ([`sidecar_path`](super::sidecar_path)).
    ///
    /// # Errors
    /// [`RasterError`] with the file, the [`Problem`] and its remedy. Never panics, whatever the bytes.
    pub fn open(path: &Path) -> Result<Self, RasterError> {
        let sidecar = Sidecar::beside(path)?;
        let source = file(path).map_err(|problem| problem.of(path))?;
        let mut reader = open(source, path, sidecar.as_ref()).map_err(|problem| problem.of(path))?;
        prj::apply(path, &mut reader.head)?;
        Ok(reader)
    }

    /// Returns about the number of bytes that [`Self::read`] allocates: a few megabytes, except for the rows of tiles
    /// of a GeoTIFF or OpenEXR file and for interlaced PNG, which are unpacked whole.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        // the buffers of the file and of one of its parts
        self.rows.bytes() + 2 * TURN as u64
    }

    /// Returns about the number of rows that are passed on at a time.
    #[must_use]
    pub fn block_rows(&self) -> usize {
        self.rows.block_rows(&self.head)
    }

    /// Returns false if every cell has a value, whatever the contents of the file.
    #[must_use]
    pub fn may_have_voids(&self) -> bool {
        self.rows.may_have_voids()
    }

    /// Passes on all rows in blocks, from north to south; voids are NaN. Returns the voids.
    ///
    /// # Errors
    /// The [`Problem`] of the file, [`Problem::Stopped`] soon after `go_on` returned false, or the error of `each`.
    pub fn read(self, go_on: GoOn<'_>, each: &mut Each<'_>) -> Result<Voids, Problem> {
        let Self { head: Head { columns, rows, scaling, assumes_voids, .. }, rows: source } = self;
        let mut voids = Voids::default();
        source.read(go_on, &mut |first, samples| {
            if !go_on() {
                return Err(Problem::Stopped);
            }
            if assumes_voids {
                voids.assume(samples);
            }
            let is_void = |v: f32| v.is_nan() | (v.abs() >= VOID_FROM);
            // most blocks have none, which is found out faster without a branch for each sample
            if samples.iter().fold(false, |any, v| any | is_void(*v)) {
                for v in samples.iter_mut().filter(|v| is_void(**v)) {
                    *v = f32::NAN;
                    voids.cells += 1;
                }
            }
            if let Some(scaling) = scaling {
                scaling.apply(samples);
            }
            each(first, samples)
        })?;
        if voids.cells < columns * rows { Ok(voids) } else { Err(Problem::AllVoid) }
    }

    /// Reads the whole raster.
    pub(super) fn raster(self, go_on: GoOn<'_>) -> Result<Raster, Problem> {
        let head = self.head.clone();
        let mut samples = zeroed(head.columns * head.rows)?;
        let voids = self.read(go_on, &mut |first, block| {
            samples[first * head.columns..][..block.len()].copy_from_slice(block);
            Ok(())
        })?;
        Ok(Raster { head, samples, voids })
    }
}

/// Opens a regular file.
fn file(path: &Path) -> Result<Source<'static>, Problem> {
    let (file, meta) = input::open(path).map_err(unreadable)?;
    if meta.len() / 16 > MAX_CELLS {
        return Err(Problem::Unsupported {
            what: format!("a file of {}", orograph_graph::bytes(meta.len())),
            remedy: "cut out the part that is needed, or average it to larger cells",
        });
    }
    Ok(Source { bytes: Box::new(BufReader::with_capacity(TURN, file)), length: meta.len() })
}

/// The problem of a file that cannot be opened or read.
pub(super) fn unreadable(error: io::Error) -> Problem {
    match error.kind() {
        io::ErrorKind::NotFound | io::ErrorKind::NotADirectory => Problem::Missing,
        io::ErrorKind::IsADirectory => Problem::Folder,
        _ if input::is_irregular(&error) => Problem::NotRegular,
        _ => Problem::Unreadable(error),
    }
}

/// Opens the bytes of a file; `path` is used only for its extension and its name.
pub(super) fn open<'a>(mut source: Source<'a>, path: &Path, sidecar: Option<&Sidecar>) -> Result<Reader<'a>, Problem> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    let mut first = Vec::with_capacity(4);
    source.bytes.by_ref().take(4).read_to_end(&mut first).map_err(Problem::Unreadable)?;
    source.bytes.rewind().map_err(Problem::Unreadable)?;
    match (&first[..], extension.as_str()) {
        ([b'I', b'I', 42 | 43, 0] | [b'M', b'M', 0, 42 | 43], _) => geotiff::open(source),
        ([0x89, b'P', b'N', b'G'], _) => png::open(source, sidecar),
        ([0x76, 0x2f, 0x31, 0x01], _) => exr::open(source, sidecar),
        (_, "asc") => ascii::open(source),
        (_, "hgt") => hgt::open(source, path.file_stem().and_then(|s| s.to_str()).unwrap_or_default()),
        (_, "r16" | "raw") => raw::open_r16(source, sidecar),
        (_, "r32") => raw::open_r32(source, sidecar),
        (_, "tif" | "tiff" | "png" | "exr") => {
            Err(Problem::damaged(format!("it does not begin like a .{extension} file")))
        }
        _ => Err(Problem::UnknownFormat),
    }
}

/// The bytes of a file that several readers use at a time, each at its own place.
pub(super) struct Shared<'a> {
    bytes: Mutex<Box<dyn Bytes + 'a>>,
    length: u64,
}

/// Reads a part of a file.
#[derive(Clone)]
pub(super) struct Section<'f, 'a> {
    shared: &'f Shared<'a>,
    at: u64,
    end: u64,
}

impl<'a> Shared<'a> {
    pub(super) fn new(source: Source<'a>) -> Self {
        Self { bytes: Mutex::new(source.bytes), length: source.length }
    }

    /// Returns the length of the file.
    pub(super) const fn length(&self) -> u64 {
        self.length
    }

    /// Returns a reader of `length` bytes. Returns None if the file ends before them.
    pub(super) fn section(&self, at: u64, length: u64) -> Option<Section<'_, 'a>> {
        at.checked_add(length).filter(|end| *end <= self.length).map(|end| Section { shared: self, at, end })
    }
}

impl Read for Section<'_, '_> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let left = usize::try_from(self.end - self.at).unwrap_or(usize::MAX);
        let count = out.len().min(left);
        if count == 0 {
            return Ok(0);
        }
        let mut bytes = self.shared.bytes.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        bytes.seek(io::SeekFrom::Start(self.at))?;
        let count = bytes.read(&mut out[..count])?;
        self.at += count as u64;
        Ok(count)
    }
}
