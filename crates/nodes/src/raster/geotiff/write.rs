//! Writes GeoTIFF: one band of f32, uncompressed strips, cell size and position as GDAL writes and reads them.
//!
//! Uncompressed, because deflate hardly shrinks the noise-like mantissas of terrain and takes far longer than writing
//! them.

use std::{
    io::{self, Seek, SeekFrom, Write},
    ops::Range,
};

use orograph_graph::Window;
use tiff::{
    TiffError, TiffResult,
    encoder::{TiffEncoder, TiffKind, TiffKindBig, TiffKindStandard, colortype::Gray32Float},
    tags::Tag,
};

use super::place::Place;

/// Above this many bytes, offsets need 64 bits.
pub(super) const CLASSIC_MOST: u64 = 0xF000_0000;

/// The bytes before and after the samples of a file.
pub(in crate::raster) struct Frame {
    /// From the beginning of the file to the samples.
    pub(in crate::raster) head: Vec<u8>,
    /// From the end of the samples to the end of the file.
    pub(in crate::raster) tail: Vec<u8>,
}

impl Frame {
    /// Returns the frame of a raster of a window; `has_voids` is true if any of its samples is NaN, and changes only
    /// the tail.
    pub(in crate::raster) fn of(window: &Window, has_voids: bool) -> io::Result<Self> {
        let bytes = 4 * window.len() as u64;
        let head = encode(window, has_voids, None)?.0;
        let (_, outline) = encode(window, has_voids, Some(head..head + bytes))?;
        Ok(Self { head: outline.head, tail: outline.tail })
    }
}

/// Lets the `tiff` crate write a file of zeros and keeps only its frame. Returns the offset of the samples. Without
/// `samples`, they are omitted.
fn encode(window: &Window, has_voids: bool, samples: Option<Range<u64>>) -> io::Result<(u64, Outline)> {
    let zeros = samples.is_some();
    let mut to = Outline { at: 0, samples: samples.unwrap_or(u64::MAX..u64::MAX), head: Vec::new(), tail: Vec::new() };
    let encoded = if 4 * window.len() as u64 > CLASSIC_MOST {
        TiffEncoder::new_big(&mut to).and_then(|to| image::<_, TiffKindBig>(to, window, has_voids, zeros))
    } else {
        TiffEncoder::new(&mut to).and_then(|to| image::<_, TiffKindStandard>(to, window, has_voids, zeros))
    };
    match encoded {
        Ok(head) => Ok((head, to)),
        Err(TiffError::IoError(error)) => Err(error),
        Err(other) => Err(io::Error::other(other)),
    }
}

fn image<W: Write + Seek, K: TiffKind>(
    mut encoder: TiffEncoder<W, K>,
    window: &Window,
    has_voids: bool,
    zeros: bool,
) -> TiffResult<u64> {
    let Place { scale, tiepoint, keys, citation } = Place::of(window);
    let mut image = encoder.new_image::<Gray32Float>(window.cells[0], window.cells[1])?;
    let tags = image.encoder();
    tags.write_tag(Tag::ModelPixelScaleTag, scale.as_slice())?;
    tags.write_tag(Tag::ModelTiepointTag, tiepoint.as_slice())?;
    tags.write_tag(Tag::GeoKeyDirectoryTag, keys.as_slice())?;
    if let Some(citation) = citation {
        tags.write_tag(Tag::GeoAsciiParamsTag, citation)?;
    }
    if has_voids {
        tags.write_tag(Tag::GdalNodata, "nan")?;
    }
    let head = tags.write_data([0_u8; 0].as_slice())?;
    let mut strip = Vec::new();
    while zeros && image.next_strip_sample_count() > 0 {
        strip.resize(image.next_strip_sample_count() as usize, 0.0);
        image.write_strip(&strip)?;
    }
    image.finish()?;
    Ok(head)
}

/// Keeps the bytes written before and after a range, and discards those inside.
struct Outline {
    at: u64,
    samples: Range<u64>,
    head: Vec<u8>,
    tail: Vec<u8>,
}

impl Write for Outline {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let Range { start, end } = self.samples;
        let (part, from, most) = if self.at < start {
            (Some(&mut self.head), 0, start - self.at)
        } else if self.at < end {
            (None, start, end - self.at)
        } else {
            (Some(&mut self.tail), end, u64::MAX)
        };
        let count = most.min(bytes.len() as u64) as usize;
        if let Some(part) = part {
            let at = (self.at - from) as usize;
            part.resize(part.len().max(at + count), 0);
            part[at..at + count].copy_from_slice(&bytes[..count]);
        }
        self.at += count as u64;
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for Outline {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let SeekFrom::Start(at) = to else { return Err(io::ErrorKind::Unsupported.into()) };
        self.at = at;
        Ok(at)
    }
}
