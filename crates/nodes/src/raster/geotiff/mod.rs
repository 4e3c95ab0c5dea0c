//! GeoTIFF: one band of integers or floats in strips or tiles, with its georeference.
//!
//! Sources: Adobe, "TIFF Revision 6.0" (1992); Adobe Photoshop, "TIFF Technical Note 3" (2005; predictor 3); AWare
//! Systems, "The BigTIFF file format" (2007); OGC 19-008r4, "GeoTIFF Standard" (2019); GDAL's tag 42113 for no data.
//!
//! Read: classic and BigTIFF of either byte order; integers of 8, 16 and 32 bits, floats of 32 and 64; no compression,
//! deflate, LZW; predictors 1, 2 and 3; the first band of several; the first image of the file. Written: f32 in
//! uncompressed strips.
//!
//! This module reads the container itself instead of using the `tiff` crate, which fails on some valid LZW tiles
//! (image-tiff issue 395) and calculates with the sizes in a header before it has checked them. The decompressors are
//! `weezl` and `flate2`.

mod chunks;
mod directory;
mod georeference;
mod write;

use chunks::Layout;
use directory::{Directory, tag};
pub(super) use write::Frame;

use super::{GoOn, MAX_RATIO, Problem, Raster, claimed_cells};

/// Decodes the first image of a file.
pub(super) fn read(bytes: &[u8], go_on: GoOn<'_>) -> Result<Raster, Problem> {
    let directory = Directory::parse(bytes)?;
    let columns = directory.number(tag::IMAGE_WIDTH)?.unwrap_or(0);
    let rows = directory.number(tag::IMAGE_LENGTH)?.unwrap_or(0);
    let layout = Layout::new(&directory, columns, rows)?;
    let ratio = if layout.is_compressed() { MAX_RATIO } else { 1 };
    claimed_cells(columns, rows, layout.sample_bytes() as u64, bytes.len() as u64, ratio)?;
    let nodata = directory.text(tag::GDAL_NODATA).and_then(|text| text.trim().parse::<f64>().ok());
    let samples = layout.decode(bytes, nodata, go_on)?;
    let mut raster = Raster::new(columns as usize, rows as usize, samples);
    georeference::read(&directory, &mut raster)?;
    Ok(raster)
}

#[cfg(test)]
mod tests;
