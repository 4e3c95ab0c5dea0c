//! Writes PNG row by row.
//!
//! Rows are compressed by `fdeflate`, the fastest compressor for such data, which runs on one thread. The work before
//! it, a third of the total, runs on the other threads at the same time: one band of rows is encoded and filtered while
//! the previous band is compressed and written. Bands begin at fixed rows, however many rows arrive at a time, so the
//! file's bytes depend only on the picture. About three bands are in memory.

use std::{
    io::{self, Cursor, Read, Write},
    path::Path,
    sync::mpsc::{Receiver, Sender, channel},
};

use ::png::{BitDepth, ColorType, Compression, Decoder, Encoder, SrgbRenderingIntent, Transformations};
use fdeflate::Compressor;

use super::{
    super::{GoOn, RasterError, filter::filter, part::Part},
    idat::{Idat, store},
};

/// Bytes of a band, whose rows are compressed at once: few enough for the caches.
const BAND: usize = 1 << 20;
/// Maximum number of bytes of a compressed chunk and of a stored one: the format's limit is 2^31.
const MOST_OF_CHUNK: [usize; 2] = [1 << 30, (u32::MAX >> 1) as usize];

/// Size and sample format of a PNG.
#[derive(Clone, Copy)]
pub(in crate::raster) struct Picture {
    pub(in crate::raster) cells: [u32; 2],
    pub(in crate::raster) colour: ColorType,
    pub(in crate::raster) depth: BitDepth,
    /// True for a picture with the sRGB curve, false for numbers.
    pub(in crate::raster) srgb: bool,
}

impl Picture {
    /// Returns the number of bytes of a cell.
    pub(in crate::raster) fn step(&self) -> usize {
        self.colour.samples() * (self.depth as usize / 8)
    }

    /// Returns the number of bytes of a row.
    fn length(&self) -> usize {
        self.cells[0] as usize * self.step()
    }

    /// Returns the bytes of the file before its rows.
    fn header(&self) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes, self.cells[0], self.cells[1]);
        encoder.set_color(self.colour);
        encoder.set_depth(self.depth);
        encoder.set_compression(Compression::NoCompression);
        if self.srgb {
            encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
        }
        // when dropped, it appends the end chunk of 12 bytes
        drop(encoder.write_header().map_err(io::Error::other)?);
        bytes.truncate(bytes.len() - 12);
        Ok(bytes)
    }
}

/// Sends the compressor's output in parts. It never fails, because the compressor panics if its writer fails.
struct Parts {
    part: Vec<u8>,
    to: Sender<Vec<u8>>,
}

/// Bytes of a part.
const PART: usize = 1 << 17;

impl Write for Parts {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.part.extend_from_slice(bytes);
        if self.part.len() >= PART {
            self.flush()?;
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        let part = std::mem::replace(&mut self.part, Vec::with_capacity(PART + 8));
        // the receiver is dropped if writing has failed
        let _ = self.to.send(part);
        Ok(())
    }
}

/// A PNG file that is being written.
pub(in crate::raster) struct Stream {
    picture: Picture,
    /// Rows of a full band.
    band: usize,
    /// The first row of the open band, and the number of its rows that are encoded.
    first: usize,
    encoded: usize,
    /// The row before the open band, then the rows of the band.
    bytes: Vec<u8>,
    /// The filtered rows of the previous band, to be compressed next.
    ready: Vec<u8>,
    filtered: Vec<u8>,
    compressor: Compressor<Parts>,
    parts: Receiver<Vec<u8>>,
    idat: Idat,
}

impl Stream {
    pub(in crate::raster) fn begin(to: &mut Part, picture: Picture) -> io::Result<Self> {
        to.write_all(&picture.header()?)?;
        let band = (BAND / picture.length()).clamp(1, picture.cells[1] as usize);
        let (sender, parts) = channel();
        Ok(Self {
            picture,
            band,
            first: 0,
            encoded: 0,
            bytes: vec![0; (band + 1) * picture.length()],
            ready: Vec::new(),
            filtered: Vec::new(),
            compressor: Compressor::new(Parts { part: Vec::with_capacity(PART + 8), to: sender })?,
            parts,
            idat: Idat::new(MOST_OF_CHUNK[0]),
        })
    }

    /// Returns the number of rows of the open band.
    fn height(&self) -> usize {
        self.band.min(self.picture.cells[1] as usize - self.first)
    }

    /// Returns the number of rows missing in the open band.
    pub(in crate::raster) fn wanted(&self) -> usize {
        self.height() - self.encoded
    }

    /// Appends rows, at most [`Self::wanted`], whose bytes `fill` writes, with 16-bit numbers big-endian.
    pub(in crate::raster) fn rows(
        &mut self,
        to: &mut Part,
        count: usize,
        fill: impl FnOnce(&mut [u8]) + Send,
    ) -> io::Result<()> {
        let (length, height) = (self.picture.length(), self.height());
        let Self { bytes, ready, filtered, compressor, parts, idat, encoded, picture, .. } = self;
        let make = || {
            fill(&mut bytes[(1 + *encoded) * length..][..count * length]);
            *encoded += count;
            if *encoded < height {
                return false;
            }
            filtered.resize(height * (length + 1), 0);
            filter(filtered, &bytes[..(height + 1) * length], length, picture.step());
            bytes.copy_within(height * length..(height + 1) * length, 0);
            true
        };
        let compress = move || {
            if ready.is_empty() {
                return Ok(());
            }
            compressor.write_data(ready)?;
            ready.clear();
            parts.try_iter().try_for_each(|part| idat.write(to, &part))
        };
        let (done, is_complete) = rayon::join(compress, make);
        done?;
        if !is_complete {
            return Ok(());
        }
        std::mem::swap(&mut self.ready, &mut self.filtered);
        self.first += height;
        self.encoded = 0;
        Ok(())
    }

    /// Completes the file. Returns true if compression made it smaller than its cells.
    pub(in crate::raster) fn finish(mut self, to: &mut Part) -> io::Result<bool> {
        self.compressor.write_data(&self.ready)?;
        self.compressor.finish()?.flush()?;
        self.parts.try_iter().try_for_each(|part| self.idat.write(to, &part))?;
        let cells = self.picture.length() as u64 * u64::from(self.picture.cells[1]);
        let is_smaller = self.idat.total() < cells;
        self.idat.finish(to)?;
        Ok(is_smaller)
    }
}

/// Rewrites the rows of a complete file without compression: `fdeflate` is tuned for small residuals and lengthens
/// noise. Reads one row at a time.
pub(in crate::raster) fn stored(
    mut from: Part,
    picture: Picture,
    path: &Path,
    go_on: GoOn<'_>,
) -> Result<Part, RasterError> {
    let unwritable = |error: io::Error| Part::fault(error, path, go_on);
    let mut to = Part::begin(path)?;
    let mut again = |to: &mut Part| {
        let mut decoder = Decoder::new(from.reader()?);
        decoder.set_transformations(Transformations::IDENTITY);
        let mut reader = decoder.read_info().map_err(io::Error::other)?;
        to.write_all(&picture.header()?)?;
        let mut idat = Idat::new(MOST_OF_CHUNK[1]);
        let length = 1 + picture.length();
        let mut row = Cursor::new(vec![0; length]);
        row.set_position(length as u64);
        let rows = Rows(|out: &mut [u8]| {
            if row.position() == length as u64 {
                if !go_on() {
                    return Err(io::Error::other("stopped"));
                }
                reader.read_row(&mut row.get_mut()[1..]).map_err(io::Error::other)?;
                row.set_position(0);
            }
            row.read(out)
        });
        store(&mut idat, to, rows, length as u64 * u64::from(picture.cells[1]))?;
        idat.finish(to)
    };
    again(&mut to).map_err(unwritable)?;
    Ok(to)
}

/// A reader of the bytes that a function supplies.
struct Rows<F>(F);

impl<F: FnMut(&mut [u8]) -> io::Result<usize>> Read for Rows<F> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        (self.0)(out)
    }
}
