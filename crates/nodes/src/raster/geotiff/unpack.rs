//! The bytes of a chunk of a TIFF, unpacked as they are read.

use std::io::{self, BufRead, BufReader, Read};

use flate2::bufread::ZlibDecoder;
use libdeflater::Decompressor;
use orograph_graph::memory::zeroed;
use weezl::{BitOrder, LzwStatus, decode::Decoder};

use crate::raster::{
    Problem,
    reader::{Section, TURN},
};

/// Largest size of a chunk that is unpacked at once, in bytes. It takes half as long as row by row.
const AT_ONCE: u64 = 4 << 20;

/// The compression of chunks.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Compression {
    None,
    Lzw,
    Deflate,
}

/// A chunk that is being unpacked.
pub(super) struct Unpacked<'f, 'a> {
    bytes: Packed<'f, 'a>,
    /// The number of the chunk, for messages.
    index: usize,
    /// Its bytes when unpacked.
    size: u64,
    read: u64,
}

type Buffer<'f, 'a> = BufReader<Section<'f, 'a>>;

enum Packed<'f, 'a> {
    None(Buffer<'f, 'a>),
    Deflate(Box<ZlibDecoder<Buffer<'f, 'a>>>),
    /// All bytes, unpacked.
    Whole(Vec<u8>),
    Lzw(Box<Lzw<Buffer<'f, 'a>>>),
}

impl<'f, 'a> Unpacked<'f, 'a> {
    /// Begins to unpack a chunk of `length` bytes to `size` bytes.
    pub(super) fn new(
        section: Section<'f, 'a>,
        length: u64,
        compression: Compression,
        index: usize,
        size: u64,
    ) -> Result<Self, Problem> {
        let whole = if compression == Compression::Deflate { at_once(section.clone(), length, size)? } else { None };
        let buffer = || BufReader::with_capacity((length as usize).clamp(16, TURN), section);
        let bytes = match (whole, compression) {
            (Some(bytes), _) => Packed::Whole(bytes),
            (None, Compression::None) => Packed::None(buffer()),
            (None, Compression::Deflate) => Packed::Deflate(Box::new(ZlibDecoder::new(buffer()))),
            (None, Compression::Lzw) => Packed::Lzw(Box::new(Lzw::new(buffer()))),
        };
        Ok(Self { bytes, index, size, read: 0 })
    }

    /// Reads the next bytes.
    pub(super) fn read(&mut self, out: &mut [u8]) -> Result<(), Problem> {
        let Self { index, size, .. } = *self;
        let done = match &mut self.bytes {
            Packed::None(from) => from.read_exact(out),
            Packed::Deflate(from) => from.read_exact(out),
            Packed::Whole(bytes) => bytes.get(self.read as usize..).unwrap_or_default().read_exact(out),
            Packed::Lzw(from) => match from.fill(out) {
                Ok(count) if count < out.len() => {
                    let count = self.read + count as u64;
                    return Err(Problem::truncated(format!("chunk {index} unpacks to {count} of {size} bytes")));
                }
                other => other.map(|_| ()),
            },
        };
        self.read += out.len() as u64;
        done.map_err(|error| match self.bytes {
            Packed::None(_) => Problem::truncated(format!("chunk {index}: {error}")),
            Packed::Deflate(_) | Packed::Whole(_) => {
                Problem::damaged(format!("chunk {index} does not inflate: {error}"))
            }
            Packed::Lzw(_) => Problem::damaged(format!("chunk {index} does not unpack: {error}")),
        })
    }
}

/// Bytes of memory for unpacking a chunk of `size` bytes at once; 0 if it is unpacked row by row.
pub(super) const fn memory(compression: Compression, size: u64) -> u64 {
    if matches!(compression, Compression::Deflate) && size <= AT_ONCE { 2 * size } else { 0 }
}

/// Inflates a chunk of moderate size. Returns None if it is larger, or is not all there: row by row, what there is can
/// be read.
fn at_once(mut section: Section<'_, '_>, length: u64, size: u64) -> Result<Option<Vec<u8>>, Problem> {
    // deflate makes nothing much longer
    if size > AT_ONCE || length > size + size / 64 + 64 {
        return Ok(None);
    }
    let (mut packed, mut bytes) = (zeroed(length as usize)?, zeroed(size as usize)?);
    let is_read = section.read_exact(&mut packed).is_ok();
    let mut inflated =
        || Decompressor::new().zlib_decompress(&packed, &mut bytes).is_ok_and(|count| count as u64 == size);
    Ok((is_read && inflated()).then_some(bytes))
}

/// LZW as TIFF has it. Reads until the chunk is full: some writers omit the end code or pad it away.
struct Lzw<R> {
    from: R,
    decoder: Decoder,
}

impl<R: BufRead> Lzw<R> {
    fn new(from: R) -> Self {
        Self { from, decoder: Decoder::with_tiff_size_switch(BitOrder::Msb, 8) }
    }

    /// Returns the number of bytes, which is less than that of `out` only at the end.
    fn fill(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let mut written = 0;
        while written < out.len() {
            let packed = self.from.fill_buf()?;
            let step = self.decoder.decode_bytes(packed, &mut out[written..]);
            self.from.consume(step.consumed_in);
            written += step.consumed_out;
            match step.status {
                Ok(LzwStatus::Ok) => {}
                _ if written == out.len() => {}
                Ok(LzwStatus::NoProgress | LzwStatus::Done) => break,
                Err(error) => return Err(io::Error::other(error)),
            }
        }
        Ok(written)
    }
}
