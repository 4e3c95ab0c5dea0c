//! Writing GeoTIFF: one band of f32, uncompressed strips, cell size and place as GDAL writes and reads them.
//!
//! Uncompressed, because deflate hardly shrinks the noise-like mantissas of terrain, and takes far longer than writing them.

use std::io::{self, Seek, Write};

use orograph_graph::Window;
use tiff::{
    TiffError, TiffResult,
    encoder::{TiffEncoder, TiffKind, TiffKindBig, TiffKindStandard, colortype::Gray32Float},
    tags::Tag,
};

/// Beyond this many bytes of samples, offsets need 64 bits.
const CLASSIC_MOST: usize = 0xF000_0000;

/// Writes a plane of `window.len()` samples. The reference system is a local one in metres, x east and y north from the
/// world's south-west corner, so that tiles of a world fit together.
pub(in crate::raster) fn write(to: impl Write + Seek, window: &Window, samples: &[f32]) -> io::Result<()> {
    let written = if size_of_val(samples) > CLASSIC_MOST {
        TiffEncoder::new_big(to).and_then(|to| encode::<_, TiffKindBig>(to, window, samples))
    } else {
        TiffEncoder::new(to).and_then(|to| encode::<_, TiffKindStandard>(to, window, samples))
    };
    written.map_err(|error| match error {
        TiffError::IoError(error) => error,
        other => io::Error::other(other),
    })
}

fn encode<W: Write + Seek, K: TiffKind>(
    mut encoder: TiffEncoder<W, K>,
    window: &Window,
    samples: &[f32],
) -> TiffResult<()> {
    let d = window.cell_m();
    let west = f64::from(window.origin[0]) * d;
    let north = (f64::from(window.world.cells[1]) - f64::from(window.origin[1])) * d;
    let mut image = encoder.new_image::<Gray32Float>(window.cells[0], window.cells[1])?;
    let tags = image.encoder();
    tags.write_tag(Tag::ModelPixelScaleTag, [d, d, 0.0].as_slice())?;
    tags.write_tag(Tag::ModelTiepointTag, [0.0, 0.0, 0.0, west, north, 0.0].as_slice())?;
    // Version 1.1.0 and four keys: a local system, cells are areas, its name, metres.
    let citation = "Orograph world|";
    let keys: [u16; 20] = [
        1,
        1,
        0,
        4, // header
        1024,
        0,
        1,
        32_767, // GTModelType: user-defined
        1025,
        0,
        1,
        1, // GTRasterType: pixel is area
        1026,
        34_737,
        citation.len() as u16,
        0, // GTCitation: in the text tag
        3076,
        0,
        1,
        9001, // ProjLinearUnits: metre
    ];
    tags.write_tag(Tag::GeoKeyDirectoryTag, keys.as_slice())?;
    tags.write_tag(Tag::GeoAsciiParamsTag, citation)?;
    if samples.iter().any(|v| v.is_nan()) {
        tags.write_tag(Tag::GdalNodata, "nan")?;
    }
    image.write_data(samples)
}
