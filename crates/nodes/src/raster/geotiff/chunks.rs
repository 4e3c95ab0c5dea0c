//! Strips and tiles: their location, decompression and sample types.

use std::{borrow::Cow, io::Read};

use orograph_graph::memory::{filled, zeroed};
use weezl::{BitOrder, LzwStatus};

use super::directory::{Directory, tag};
use crate::numerics::par;
use crate::raster::{GoOn, MAX_RATIO, Problem};

const CONVERT: &str = "convert it: `gdal_translate -co COMPRESS=DEFLATE in.tif out.tif`";

#[derive(Clone, Copy, PartialEq)]
enum Compression {
    None,
    Lzw,
    Deflate,
}

#[derive(Clone, Copy)]
enum Predictor {
    None,
    Horizontal,
    Float,
}

#[derive(Clone, Copy)]
enum Sample {
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    F32,
    F64,
}

/// The division of an image into chunks, and their compression.
pub(super) struct Layout {
    columns: u64,
    rows: u64,
    /// Width and height of a chunk, in cells. A strip is a chunk as wide as the image.
    chunk: [u64; 2],
    tiled: bool,
    offsets: Vec<u64>,
    counts: Vec<u64>,
    /// Samples per cell in a chunk; the first of them is read.
    bands: u64,
    compression: Compression,
    predictor: Predictor,
    sample: Sample,
    big_endian: bool,
}

impl Sample {
    const fn bytes(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Converts little-endian bytes to numbers; `nodata` becomes NaN. `stride` is in bytes.
    fn convert(self, bytes: &[u8], stride: usize, nodata: Option<f64>, out: &mut [f32]) {
        fn run<const N: usize, T: Copy + PartialEq>(
            bytes: &[u8],
            stride: usize,
            nodata: Option<T>,
            out: &mut [f32],
            load: impl Fn([u8; N]) -> T,
            real: impl Fn(T) -> f32,
        ) {
            for (out, cell) in out.iter_mut().zip(bytes.chunks_exact(stride)) {
                let mut raw = [0; N];
                raw.copy_from_slice(&cell[..N]);
                let value = load(raw);
                *out = if nodata == Some(value) { f32::NAN } else { real(value) };
            }
        }
        // a declared no-data value that the type cannot represent matches nothing
        let whole = |lo: f64, hi: f64| nodata.filter(|v| v.fract() == 0.0 && (lo..=hi).contains(v));
        match self {
            Self::U8 => {
                let nodata = whole(0.0, 255.0).map(|v| v as u8);
                run(bytes, stride, nodata, out, u8::from_le_bytes, f32::from);
            }
            Self::I8 => {
                let nodata = whole(-128.0, 127.0).map(|v| v as i8);
                run(bytes, stride, nodata, out, i8::from_le_bytes, f32::from);
            }
            Self::U16 => {
                let nodata = whole(0.0, 65_535.0).map(|v| v as u16);
                run(bytes, stride, nodata, out, u16::from_le_bytes, f32::from);
            }
            Self::I16 => {
                let nodata = whole(-32_768.0, 32_767.0).map(|v| v as i16);
                run(bytes, stride, nodata, out, i16::from_le_bytes, f32::from);
            }
            Self::U32 => {
                let nodata = whole(0.0, f64::from(u32::MAX)).map(|v| v as u32);
                run(bytes, stride, nodata, out, u32::from_le_bytes, |v| v as f32);
            }
            Self::I32 => {
                let nodata = whole(f64::from(i32::MIN), f64::from(i32::MAX)).map(|v| v as i32);
                run(bytes, stride, nodata, out, i32::from_le_bytes, |v| v as f32);
            }
            Self::F32 => run(bytes, stride, nodata.map(|v| v as f32), out, f32::from_le_bytes, |v| v),
            Self::F64 => run(bytes, stride, nodata, out, f64::from_le_bytes, |v| v as f32),
        }
    }
}

impl Layout {
    /// Reads the layout from the tags and checks that it is one we can decode.
    pub(super) fn new(directory: &Directory<'_>, columns: u64, rows: u64) -> Result<Self, Problem> {
        if columns == 0 || rows == 0 {
            return Err(Problem::Empty { columns, rows });
        }
        let number = |name, default| Ok::<u64, Problem>(directory.number(name)?.unwrap_or(default));
        if matches!(number(tag::PHOTOMETRIC, 1)?, 2..) {
            return Err(Problem::Unsupported {
                what: "a colour picture".into(),
                remedy: "name the file of the elevations, not its picture",
            });
        }
        let all_bands = number(tag::SAMPLES_PER_PIXEL, 1)?.max(1);
        let bands = if number(tag::PLANAR_CONFIGURATION, 1)? == 2 { 1 } else { all_bands };
        let offsets = directory.numbers(tag::TILE_OFFSETS)?;
        let tiled = !offsets.is_empty();
        let (offsets, counts, chunk) = if tiled {
            let chunk = [number(tag::TILE_WIDTH, 0)?, number(tag::TILE_LENGTH, 0)?];
            (offsets, directory.numbers(tag::TILE_BYTE_COUNTS)?, chunk)
        } else {
            let chunk = [columns, number(tag::ROWS_PER_STRIP, rows)?.min(rows)];
            (directory.numbers(tag::STRIP_OFFSETS)?, directory.numbers(tag::STRIP_BYTE_COUNTS)?, chunk)
        };
        if chunk.contains(&0) {
            return Err(Problem::damaged(format!("its tiles or strips are {} x {} cells", chunk[0], chunk[1])));
        }
        let wanted = u128::from(columns.div_ceil(chunk[0])) * u128::from(rows.div_ceil(chunk[1]));
        let listed = offsets.len().min(counts.len());
        if (listed as u128) < wanted {
            return Err(Problem::damaged(format!("it lists {listed} of the {wanted} tiles or strips it needs")));
        }
        let sample = sample(directory)?;
        Ok(Self {
            columns,
            rows,
            chunk,
            tiled,
            offsets,
            counts,
            bands,
            compression: compression(number(tag::COMPRESSION, 1)?)?,
            predictor: predictor(number(tag::PREDICTOR, 1)?, sample)?,
            sample,
            big_endian: directory.big_endian(),
        })
    }

    /// Returns true if the chunks are compressed.
    pub(super) fn is_compressed(&self) -> bool {
        self.compression != Compression::None
    }

    /// Returns the number of bytes of a sample.
    pub(super) const fn sample_bytes(&self) -> usize {
        self.sample.bytes()
    }

    /// Decodes the first band of the image, whose shape has been checked against the file's length.
    pub(super) fn decode(&self, file: &[u8], nodata: Option<f64>, go_on: GoOn<'_>) -> Result<Vec<f32>, Problem> {
        let columns = self.columns as usize;
        let across = self.columns.div_ceil(self.chunk[0]) as usize;
        let mut samples = filled(columns * self.rows as usize, f32::NAN)?;
        // a chunk is at most as high as the image here; a tile may be higher, and then there is a single row of tiles
        let band_rows = self.chunk[1].min(self.rows) as usize;
        par::each(samples.chunks_mut(columns * band_rows), |down, band| {
            for along in 0..across {
                if !go_on() {
                    return Err(Problem::Stopped);
                }
                let index = down * across + along;
                let chunk_rows = if self.tiled { self.chunk[1] } else { (band.len() / columns) as u64 };
                let Some(chunk) = self.unpack(file, index, chunk_rows)? else { continue };
                let x0 = along * self.chunk[0] as usize;
                let width = (columns - x0).min(self.chunk[0] as usize);
                let stride = self.sample.bytes() * self.bands as usize;
                let row_bytes = self.chunk[0] as usize * stride;
                for (row, bytes) in band.chunks_exact_mut(columns).zip(chunk.chunks_exact(row_bytes)) {
                    self.sample.convert(&bytes[..width * stride], stride, nodata, &mut row[x0..x0 + width]);
                }
            }
            Ok(())
        })?;
        Ok(samples)
    }

    /// Returns the bytes of a chunk, decompressed and in little-endian order. Returns None when the chunk was never
    /// written.
    fn unpack<'a>(&self, file: &'a [u8], index: usize, rows: u64) -> Result<Option<Cow<'a, [u8]>>, Problem> {
        let (offset, count) = (self.offsets[index], self.counts[index]);
        if count == 0 {
            return Ok(None);
        }
        let end = offset.checked_add(count).and_then(|end| usize::try_from(end).ok());
        let packed = end.and_then(|end| file.get(offset as usize..end)).ok_or_else(|| {
            Problem::truncated(format!(
                "chunk {index} of {count} bytes at {offset} is beyond its end at {}",
                file.len()
            ))
        })?;
        let stride = self.bands as u128 * self.sample.bytes() as u128;
        let size = u128::from(self.chunk[0]) * u128::from(rows) * stride;
        let ratio = if self.is_compressed() { MAX_RATIO } else { 1 };
        if size > packed.len() as u128 * u128::from(ratio) {
            return Err(Problem::truncated(format!("chunk {index} has {count} bytes for {size}")));
        }
        let size = size as usize;
        let mut bytes = match self.compression {
            Compression::None => Cow::Borrowed(&packed[..size]),
            Compression::Deflate => Cow::Owned(inflate(packed, size, index)?),
            Compression::Lzw => Cow::Owned(unpack_lzw(packed, size, index)?),
        };
        let row_samples = self.chunk[0] as usize * self.bands as usize;
        let width = self.sample.bytes();
        let needs_swap = self.big_endian && width > 1;
        match self.predictor {
            Predictor::None if !needs_swap => {}
            Predictor::None => swap(bytes.to_mut(), width),
            Predictor::Horizontal => {
                let bytes = bytes.to_mut();
                if needs_swap {
                    swap(bytes, width);
                }
                bytes.chunks_exact_mut(row_samples * width).for_each(|row| self.accumulate(row));
            }
            Predictor::Float => {
                let mut row_copy = zeroed(row_samples * width)?;
                for row in bytes.to_mut().chunks_exact_mut(row_samples * width) {
                    row_copy.copy_from_slice(row);
                    gather_float(&mut row_copy, row, width, self.bands as usize);
                }
            }
        }
        Ok(Some(bytes))
    }

    /// Undoes predictor 2: each sample is stored as its difference from the previous one of the same band, modulo its
    /// width.
    fn accumulate(&self, row: &mut [u8]) {
        fn run<const N: usize, T: Copy>(
            row: &mut [u8],
            bands: usize,
            load: impl Fn([u8; N]) -> T,
            add: impl Fn(T, T) -> T,
            store: impl Fn(T) -> [u8; N],
        ) {
            for at in (bands * N..row.len()).step_by(N) {
                let (mut before, mut here) = ([0; N], [0; N]);
                before.copy_from_slice(&row[at - bands * N..at - bands * N + N]);
                here.copy_from_slice(&row[at..at + N]);
                row[at..at + N].copy_from_slice(&store(add(load(before), load(here))));
            }
        }
        let bands = self.bands as usize;
        match self.sample.bytes() {
            1 => run(row, bands, u8::from_le_bytes, u8::wrapping_add, u8::to_le_bytes),
            2 => run(row, bands, u16::from_le_bytes, u16::wrapping_add, u16::to_le_bytes),
            4 => run(row, bands, u32::from_le_bytes, u32::wrapping_add, u32::to_le_bytes),
            _ => run(row, bands, u64::from_le_bytes, u64::wrapping_add, u64::to_le_bytes),
        }
    }
}

/// Undoes predictor 3: the bytes of a row are sorted by significance, highest first, and stored as differences.
fn gather_float(stored: &mut [u8], row: &mut [u8], width: usize, bands: usize) {
    for at in bands..stored.len() {
        stored[at] = stored[at].wrapping_add(stored[at - bands]);
    }
    let samples = stored.len() / width;
    for (significance, plane) in stored.chunks_exact(samples).enumerate() {
        for (sample, byte) in row.chunks_exact_mut(width).zip(plane) {
            sample[width - 1 - significance] = *byte;
        }
    }
}

fn swap(bytes: &mut [u8], width: usize) {
    bytes.chunks_exact_mut(width).for_each(<[u8]>::reverse);
}

fn inflate(packed: &[u8], size: usize, index: usize) -> Result<Vec<u8>, Problem> {
    let mut bytes = zeroed(size)?;
    flate2::read::ZlibDecoder::new(packed)
        .read_exact(&mut bytes)
        .map_err(|error| Problem::damaged(format!("chunk {index} does not inflate: {error}")))?;
    Ok(bytes)
}

/// Decodes until the chunk is full: some writers omit the end code or pad it away.
fn unpack_lzw(packed: &[u8], size: usize, index: usize) -> Result<Vec<u8>, Problem> {
    let mut bytes = zeroed(size)?;
    let mut decoder = weezl::decode::Decoder::with_tiff_size_switch(BitOrder::Msb, 8);
    let (mut read, mut written) = (0, 0);
    while written < size {
        let step = decoder.decode_bytes(&packed[read..], &mut bytes[written..]);
        read += step.consumed_in;
        written += step.consumed_out;
        match step.status {
            Ok(LzwStatus::Ok) => {}
            _ if written == size => {}
            Ok(LzwStatus::NoProgress | LzwStatus::Done) => {
                return Err(Problem::truncated(format!("chunk {index} unpacks to {written} of {size} bytes")));
            }
            Err(error) => return Err(Problem::damaged(format!("chunk {index} does not unpack: {error}"))),
        }
    }
    Ok(bytes)
}

fn compression(code: u64) -> Result<Compression, Problem> {
    let name = match code {
        1 => return Ok(Compression::None),
        5 => return Ok(Compression::Lzw),
        8 | 32_946 => return Ok(Compression::Deflate),
        6 | 7 => "JPEG",
        32_773 => "PackBits",
        34_887 => "LERC",
        34_925 => "LZMA",
        50_000 => "Zstandard",
        50_001 => "WebP",
        _ => "this",
    };
    Err(Problem::Unsupported { what: format!("{name} compression (TIFF code {code})"), remedy: CONVERT })
}

fn predictor(code: u64, sample: Sample) -> Result<Predictor, Problem> {
    match (code, sample) {
        (1, _) => Ok(Predictor::None),
        (2, _) => Ok(Predictor::Horizontal),
        (3, Sample::F32 | Sample::F64) => Ok(Predictor::Float),
        (3, _) => Err(Problem::damaged("it predicts whole numbers as if they were real ones")),
        _ => Err(Problem::Unsupported { what: format!("predictor {code}"), remedy: CONVERT }),
    }
}

fn sample(directory: &Directory<'_>) -> Result<Sample, Problem> {
    let bits = directory.numbers(tag::BITS_PER_SAMPLE)?;
    let formats = directory.numbers(tag::SAMPLE_FORMAT)?;
    let (bits_of, format) = (bits.first().copied().unwrap_or(1), formats.first().copied().unwrap_or(1));
    let even = bits.iter().all(|b| *b == bits_of) && formats.iter().all(|f| *f == format);
    match (format, bits_of) {
        (1, 8) if even => Ok(Sample::U8),
        (2, 8) if even => Ok(Sample::I8),
        (1, 16) if even => Ok(Sample::U16),
        (2, 16) if even => Ok(Sample::I16),
        (1, 32) if even => Ok(Sample::U32),
        (2, 32) if even => Ok(Sample::I32),
        (3, 32) if even => Ok(Sample::F32),
        (3, 64) if even => Ok(Sample::F64),
        _ => {
            let kind = match format {
                1 => "unsigned",
                2 => "signed",
                3 => "real",
                _ => "unknown",
            };
            Err(Problem::Unsupported {
                what: format!("a raster of {kind} {bits_of}-bit samples"),
                remedy: "convert it: `gdal_translate -ot Float32 in.tif out.tif`",
            })
        }
    }
}
