//! GeoTIFF: one band of integers or floats in strips or tiles, with its georeference.
//!
//! Sources: Adobe, "TIFF Revision 6.0" (1992); Adobe Photoshop, "TIFF Technical Note 3" (2005; predictor 3); AWare
//! Systems, "The BigTIFF file format" (2007); OGC 19-008r4, "GeoTIFF Standard" (2019); GDAL's tag 42113 for no data.
//!
//! Read: classic and BigTIFF of either byte order; integers of 8, 16 and 32 bits, floats of 32 and 64; no compression,
//! deflate, LZW; predictors 1, 2 and 3; the first band of several; the first image of the file. Written: f32 in
//! uncompressed strips, or cloud-optimised in compressed tiles with overviews.
//!
//! This module reads the container itself instead of using the `tiff` crate, which fails on some valid LZW tiles
//! (image-tiff issue 395) and calculates with the sizes in a header before it has checked them. The decompressors are
//! `weezl`, `libdeflater` and, for large chunks, `flate2`.

mod chunks;
mod cog;
mod directory;
mod georeference;
mod metadata;
mod place;
mod unpack;
mod write;

use chunks::{Layout, Tiff};
pub(super) use cog::Cog;
use directory::{Directory, tag};
use metadata::Items;
pub(super) use write::Frame;

use super::{
    Problem,
    reader::{Head, Reader, Shared, Source},
};

/// Opens the first image of a file.
pub(super) fn open(source: Source<'_>) -> Result<Reader<'_>, Problem> {
    let file = Shared::new(source);
    let directory = Directory::parse(&file)?;
    let columns = directory.number(tag::IMAGE_WIDTH)?.unwrap_or(0);
    let rows = directory.number(tag::IMAGE_LENGTH)?.unwrap_or(0);
    let layout = Layout::new(&directory, columns, rows, file.length())?;
    let nodata = directory.text(tag::GDAL_NODATA)?.and_then(|text| text.trim().parse::<f64>().ok());
    let mut head = Head::new(columns as usize, rows as usize);
    head.assumes_voids = nodata.is_none();
    let bands = directory.number(tag::SAMPLES_PER_PIXEL)?.unwrap_or(1);
    if bands > 1 {
        head.notes.push(format!("the file has {bands} bands; the first is read"));
    }
    match directory.further_images() {
        0 => {}
        more => head.notes.push(format!("the file has {} images; the first is read", more + 1)),
    }
    let items = directory.text(tag::GDAL_METADATA)?.map(|xml| Items::parse(&xml)).transpose()?.unwrap_or_default();
    let is_south_up = georeference::read(&directory, &items, &mut head)?;
    let tiff = Tiff::new(file, layout, nodata, is_south_up)?;
    Ok(Reader { head, rows: Box::new(tiff) })
}

#[cfg(test)]
mod tests;
