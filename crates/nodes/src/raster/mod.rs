//! Raster files: reading elevation models, writing results.
//!
//! Read: GeoTIFF, grey PNG, OpenEXR, ESRI ASCII grids, SRTM tiles, raw 16-bit and 32-bit samples ([`read`]). Written:
//! OpenEXR, GeoTIFF, grey PNG, raw samples, colour PNG, textures for engines ([`Content`]). One [`Writer`] accepts rows
//! as they arrive, always under a temporary name that is renamed at the end, with a JSON [`Sidecar`] for metadata that
//! a format cannot store.
//!
//! Files are untrusted input. A [`Reader`] unpacks them row by row, so that the memory does not grow with the raster;
//! what has to be unpacked whole is limited or counted ([`Reader::bytes`]). The number of cells in a header is compared
//! with the available bytes and the strongest compression of the format (`claimed_cells`) before anything of that size
//! is allocated. Every offset is checked against the length of the file.

mod ascii;
mod cells;
mod codes;
mod error;
mod exr;
mod extent;
mod fill;
mod filter;
mod format;
mod geotiff;
mod hgt;
mod metric;
mod mosaic;
mod part;
mod png;
mod prj;
mod projection;
mod raw;
mod reader;
mod recognise;
mod remarks;
mod resample;
mod sidecar;
mod srgb;
mod texture;
mod warp;
mod whole;
mod writer;

use std::path::Path;

pub use error::{Problem, RasterError};
pub use extent::{extent, extent_of};
pub use fill::{Coarse, fill_voids, filling_bytes, filling_rows};
pub use format::{Content, Format, Meta, Writing};
pub use metric::{Heights, height_field};
pub use mosaic::join;
pub use part::replace;
pub use projection::{Projection, SystemError, well_known_text};
pub use reader::{Each, Head, Reader};
pub use recognise::recognise;
pub use remarks::{Voids, presence};
pub use resample::{GridAxis, Resampler, resample};
pub use sidecar::{Sidecar, other_quantity, sea_level, sidecar_path};
pub use srgb::srgb_bytes;
pub use texture::apportioned;
pub use warp::{Warp, WarpError};
pub use whole::{write, write_colour};
pub use writer::{Finished, Writer};

/// Maximum number of cells of a file: 4 GiB of samples, 32768 cells per side.
pub const MAX_CELLS: u64 = 1 << 30;

/// Maximum number of columns of a file: some rows are in memory at a time.
pub const MAX_COLUMNS: u64 = 1 << 20;

/// Maximum number of bytes that one compressed byte can represent. Deflate reaches 1032 (a 258-byte match in two bits),
/// 12-bit LZW 1302 (codes that each grow by one byte until the table is full); twice that leaves room for OpenEXR's own
/// schemes.
const MAX_RATIO: u64 = 2600;

/// Samples from this magnitude on are voids: some programs write the lowest `f32` for "no data" without declaring it.
const VOID_FROM: f32 = 1e30;

/// A raster as stored in a file: row-major from the north-west corner, voids as NaN.
#[derive(Clone, Debug, PartialEq)]
pub struct Raster {
    /// What the file's header says.
    pub head: Head,
    /// Samples row by row, north first; NaN where there is no data.
    pub samples: Vec<f32>,
    /// The cells without data.
    pub voids: Voids,
}

/// Size of a raster's cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cell {
    /// Width and height in metres.
    Metres([f64; 2]),
    /// Width in degrees of longitude and height in degrees of latitude.
    Degrees([f64; 2]),
    /// Width and height in metres of Web Mercator (EPSG:3857), which are longer than metres on the ground.
    Mercator([f64; 2]),
}

/// Integer codes over a range: 0 for its low end, `full` for its high end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coding {
    /// The largest code: 255 or 65535.
    pub full: u32,
    /// Values of the lowest and largest code, if a sidecar gives them.
    pub range: Option<[f64; 2]>,
}

/// Conversion of stored samples to values: `value = scale * sample + offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scaling {
    /// Value of a step of the samples.
    pub scale: f64,
    /// Value of the sample 0.
    pub offset: f64,
}

impl Scaling {
    fn apply(self, samples: &mut [f32]) {
        for v in samples {
            *v = (self.scale * f64::from(*v) + self.offset) as f32;
        }
    }
}

impl Raster {
    /// Converts codes to numbers by the range of the file, or else by `range`. Numbers are unchanged.
    #[must_use]
    pub fn decoded(mut self, range: [f64; 2]) -> Self {
        if let Some(coding) = self.head.coding.take() {
            coding.decode(range, &mut self.samples);
        }
        self
    }
}

impl Coding {
    /// Converts codes to numbers by the range of the file, or else by `range`.
    pub fn decode(&self, range: [f64; 2], codes: &mut [f32]) {
        let [lo, hi] = self.range.unwrap_or(range);
        let full = f64::from(self.full);
        for v in codes {
            // the ends are exact: a weighted mean, not a multiple of a step
            let t = f64::from(*v) / full;
            *v = (lo * (1.0 - t) + hi * t) as f32;
        }
    }
}

/// Reads a raster file of any known format, which its first bytes identify, or else its extension.
///
/// PNG, OpenEXR and raw files are read together with their sidecar, if there is one ([`sidecar_path`]).
///
/// # Errors
/// [`RasterError`] with the file, the [`Problem`] and its remedy. Never panics, whatever the bytes.
pub fn read(path: &Path) -> Result<Raster, RasterError> {
    read_while(path, &|| true)
}

/// As [`read`], but cancelled soon after `go_on` returns false.
fn read_while(path: &Path, go_on: GoOn<'_>) -> Result<Raster, RasterError> {
    Reader::open(path)?.raster(go_on).map_err(|problem| problem.of(path))
}

/// Called repeatedly; returns true to continue.
pub type GoOn<'a> = &'a (dyn Fn() -> bool + Sync);

/// Checks the size in a header before anything of that size is allocated: not empty, not beyond [`MAX_CELLS`] and
/// [`MAX_COLUMNS`], and not more than `held` bytes can represent if one byte represents at most `ratio`. Returns the
/// number of cells.
fn claimed_cells(columns: u64, rows: u64, bytes_per_cell: u64, held: u64, ratio: u64) -> Result<usize, Problem> {
    if columns == 0 || rows == 0 {
        return Err(Problem::Empty { columns, rows });
    }
    let cells = u128::from(columns) * u128::from(rows);
    if cells * u128::from(bytes_per_cell) > u128::from(held) * u128::from(ratio) {
        return Err(Problem::Lying { columns, rows, held });
    }
    match usize::try_from(cells) {
        Ok(count) if cells <= u128::from(MAX_CELLS) && columns <= MAX_COLUMNS => Ok(count),
        _ => Err(Problem::TooLarge { columns, rows }),
    }
}

/// The note on a file of [`looks_geographic`].
const ASSUMED_DEGREES: &str =
    "the file names no coordinate system; its coordinates are taken as longitude and latitude in degrees";

/// The note on a file with larger cells that lies on the globe too.
const ASSUMED_METRES: &str = "the file names no coordinate system; its coordinates are taken as metres, but could be degrees: \
                              then put a .prj file beside it";

/// Returns true if a note of a head says what its coordinates are taken for.
#[must_use]
pub fn is_about_units(note: &str) -> bool {
    [ASSUMED_DEGREES, ASSUMED_METRES].contains(&note)
}

/// Returns true if a grid of unknown reference system appears to be in longitude and latitude: its cells are at most a
/// tenth of a degree, and all of it lies on the globe. A survey in metres with its origin at zero and a width of a few
/// dozen metres looks the same; in that case, set the cell size in the graph.
fn looks_geographic(origin: [f64; 2], cell: [f64; 2], columns: usize, rows: usize) -> bool {
    cell[0] <= 0.1 && cell[1] <= 0.1 && is_on_globe(origin, cell, columns, rows)
}

/// Returns true if all of a grid would lie on the globe if its coordinates were longitude and latitude.
fn is_on_globe(origin: [f64; 2], cell: [f64; 2], columns: usize, rows: usize) -> bool {
    let east = origin[0] + cell[0] * columns as f64;
    let south = origin[1] - cell[1] * rows as f64;
    origin[0] >= -180.0 && east <= 360.0 && origin[1] <= 90.0 && south >= -90.0
}

#[cfg(test)]
mod bands;
#[cfg(test)]
mod tests;
