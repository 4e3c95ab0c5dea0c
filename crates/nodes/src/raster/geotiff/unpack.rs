//! The bytes of a chunk of a TIFF, unpacked as they are read.

use std::io::{self, BufRead, BufReader, Read};

use flate2::bufread::ZlibDecoder;
use weezl::{BitOrder, LzwStatus, decode::Decoder};

use crate::raster::{
    Problem,
    reader::{Section, TURN},
};

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
    read: u64,
}

type Buffer<'f, 'a> = BufReader<Section<'f, 'a>>;

enum Packed<'f, 'a> {
    None(Buffer<'f, 'a>),
    Deflate(Box<ZlibDecoder<Buffer<'f, 'a>>>),
    Lzw(Box<Lzw<Buffer<'f, 'a>>>),
}

impl<'f, 'a> Unpacked<'f, 'a> {
    /// Begins to unpack a chunk of `length` bytes.
    pub(super) fn new(section: Section<'f, 'a>, length: u64, compression: Compression, index: usize) -> Self {
        let buffer = BufReader::with_capacity((length as usize).clamp(16, TURN), section);
        let bytes = match compression {
            Compression::None => Packed::None(buffer),
            Compression::Deflate => Packed::Deflate(Box::new(ZlibDecoder::new(buffer))),
            Compression::Lzw => Packed::Lzw(Box::new(Lzw::new(buffer))),
        };
        Self { bytes, index, read: 0 }
    }

    /// Reads the next bytes, of `size` in all.
    pub(super) fn read(&mut self, out: &mut [u8], size: u64) -> Result<(), Problem> {
        let Self { index, .. } = *self;
        let done = match &mut self.bytes {
            Packed::None(from) => from.read_exact(out),
            Packed::Deflate(from) => from.read_exact(out),
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
            Packed::Deflate(_) => Problem::damaged(format!("chunk {index} does not inflate: {error}")),
            Packed::Lzw(_) => Problem::damaged(format!("chunk {index} does not unpack: {error}")),
        })
    }
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
