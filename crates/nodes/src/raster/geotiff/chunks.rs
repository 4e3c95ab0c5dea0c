//! Strips and tiles: their location, decompression and sample types.

use orograph_graph::memory::{filled, zeroed};

use super::{
    directory::{Directory, tag},
    unpack::{Compression, Unpacked, memory},
};
use crate::{
    numerics::par,
    raster::{
        GoOn, MAX_RATIO, Problem, claimed_cells,
        reader::{BLOCK, Each, Head, Rows, Shared},
    },
};

const CONVERT: &str = "convert it: `gdal_translate -co COMPRESS=DEFLATE in.tif out.tif`";
const TILE: &str = "convert it: `gdal_translate -co TILED=YES -co BLOCKYSIZE=256 in.tif out.tif`";

/// Cells that are unpacked at a time, by several threads: 16 MiB.
const GROUP: usize = 1 << 22;
/// Maximum number of cells that are unpacked at a time where they cannot be fewer: 64 MiB.
const MOST_CELLS: usize = 1 << 24;
/// Maximum number of bytes of a row of a chunk.
const MOST_BYTES: u128 = 1 << 24;

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
    /// Maximum number of bytes that one byte of a chunk represents.
    ratio: u64,
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
            let number = |raw: [u8; N]| {
                let value = load(raw);
                if nodata == Some(value) { f32::NAN } else { real(value) }
            };
            if stride == N {
                for (out, raw) in out.iter_mut().zip(bytes.as_chunks::<N>().0) {
                    *out = number(*raw);
                }
                return;
            }
            for (out, cell) in out.iter_mut().zip(bytes.chunks_exact(stride)) {
                let mut raw = [0; N];
                raw.copy_from_slice(&cell[..N]);
                *out = number(raw);
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
    pub(super) fn new(directory: &Directory<'_, '_>, columns: u64, rows: u64, held: u64) -> Result<Self, Problem> {
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
        let sample = sample(directory)?;
        let compression = compression(number(tag::COMPRESSION, 1)?)?;
        let ratio = if compression == Compression::None { 1 } else { MAX_RATIO };
        let tiled = directory.has(tag::TILE_OFFSETS);
        let chunk = match tiled {
            true => [number(tag::TILE_WIDTH, 0)?, number(tag::TILE_LENGTH, 0)?],
            false => [columns, number(tag::ROWS_PER_STRIP, rows)?.min(rows)],
        };
        if chunk.contains(&0) {
            return Err(Problem::damaged(format!("its tiles or strips are {} x {} cells", chunk[0], chunk[1])));
        }
        claimed_cells(columns, rows, sample.bytes() as u64, held, ratio)?;
        let wanted = columns.div_ceil(chunk[0]) * rows.div_ceil(chunk[1]);
        let [offsets, counts] = match tiled {
            true => [tag::TILE_OFFSETS, tag::TILE_BYTE_COUNTS],
            false => [tag::STRIP_OFFSETS, tag::STRIP_BYTE_COUNTS],
        };
        let (offsets, counts) =
            (directory.first_numbers(offsets, wanted as usize)?, directory.first_numbers(counts, wanted as usize)?);
        let listed = offsets.len().min(counts.len()) as u64;
        if listed < wanted {
            return Err(Problem::damaged(format!("it lists {listed} of the {wanted} tiles or strips it needs")));
        }
        let predictor = predictor(number(tag::PREDICTOR, 1)?, sample)?;
        let big_endian = directory.big_endian();
        Ok(Self {
            columns,
            rows,
            chunk,
            tiled,
            offsets,
            counts,
            bands,
            compression,
            ratio,
            predictor,
            sample,
            big_endian,
        })
    }

    /// Returns true for one band of 32-bit floating-point numbers, which are most files.
    const fn is_plain_float(&self) -> bool {
        matches!(self.sample, Sample::F32) && self.bands == 1
    }

    /// Returns the rows of a chunk. A tile may be higher than the image, and then there is a single row of tiles.
    fn band_rows(&self) -> usize {
        self.chunk[1].min(self.rows) as usize
    }

    /// Begins to unpack a chunk of that many rows. Returns None when the chunk was never written.
    fn unpack<'f, 'a>(
        &self,
        file: &'f Shared<'a>,
        index: usize,
        rows: u64,
    ) -> Result<Option<Chunk<'_, 'f, 'a>>, Problem> {
        let (offset, count) = (self.offsets[index], self.counts[index]);
        if count == 0 {
            return Ok(None);
        }
        let section = file.section(offset, count).ok_or_else(|| {
            Problem::truncated(format!(
                "chunk {index} of {count} bytes at {offset} is beyond its end at {}",
                file.length()
            ))
        })?;
        let row = u128::from(self.chunk[0]) * u128::from(self.bands) * self.sample.bytes() as u128;
        let size = row * u128::from(rows);
        if size > u128::from(count) * u128::from(self.ratio) {
            return Err(Problem::truncated(format!("chunk {index} has {count} bytes for {size}")));
        }
        if row > MOST_BYTES {
            return Err(Problem::Unsupported { what: format!("rows of {row} bytes"), remedy: CONVERT });
        }
        let row = row as usize;
        let is_gathered = matches!(self.predictor, Predictor::Float) && !self.is_plain_float();
        let copy = if is_gathered { row } else { 0 };
        Ok(Some(Chunk {
            layout: self,
            unpacked: Unpacked::new(section, count, self.compression, index, size as u64)?,
            row: zeroed(row)?,
            copy: zeroed(copy)?,
        }))
    }

    /// Unpacks rows of the image, all of the chunks at number `down`.
    fn band(
        &self,
        file: &Shared<'_>,
        nodata: Option<f64>,
        down: usize,
        band: &mut [f32],
        go_on: GoOn<'_>,
    ) -> Result<(), Problem> {
        let columns = self.columns as usize;
        let across = self.columns.div_ceil(self.chunk[0]) as usize;
        band.fill(f32::NAN);
        for along in 0..across {
            if !go_on() {
                return Err(Problem::Stopped);
            }
            let chunk_rows = if self.tiled { self.chunk[1] } else { (band.len() / columns) as u64 };
            let Some(mut chunk) = self.unpack(file, down * across + along, chunk_rows)? else { continue };
            let x0 = along * self.chunk[0] as usize;
            let width = (columns - x0).min(self.chunk[0] as usize);
            for row in band.chunks_exact_mut(columns) {
                chunk.next(nodata, &mut row[x0..x0 + width])?;
            }
        }
        Ok(())
    }
}

/// A chunk that is being unpacked row by row.
struct Chunk<'l, 'f, 'a> {
    layout: &'l Layout,
    unpacked: Unpacked<'f, 'a>,
    row: Vec<u8>,
    copy: Vec<u8>,
}

impl Chunk<'_, '_, '_> {
    /// Unpacks the first cells of the next row.
    fn next(&mut self, nodata: Option<f64>, out: &mut [f32]) -> Result<(), Problem> {
        let Self { layout, unpacked, row, copy } = self;
        unpacked.read(row)?;
        let width = layout.sample.bytes();
        let needs_swap = layout.big_endian && width > 1;
        match layout.predictor {
            Predictor::None if !needs_swap => {}
            Predictor::None => swap(row, width),
            Predictor::Horizontal => {
                if needs_swap {
                    swap(row, width);
                }
                layout.accumulate(row);
            }
            Predictor::Float if layout.is_plain_float() => {
                sum_up(row, 1);
                gather_plain(row, nodata.map(|v| v as f32), out);
                return Ok(());
            }
            Predictor::Float => {
                copy.copy_from_slice(row);
                gather_float(copy, row, width, layout.bands as usize);
            }
        }
        layout.sample.convert(row, width * layout.bands as usize, nodata, out);
        Ok(())
    }
}

/// The rows of an image.
pub(super) struct Tiff<'a> {
    file: Shared<'a>,
    layout: Layout,
    nodata: Option<f64>,
    /// True if the first row is the southernmost.
    is_south_up: bool,
}

impl<'a> Tiff<'a> {
    /// Checks that the image can be read in parts.
    pub(super) fn new(
        file: Shared<'a>,
        layout: Layout,
        nodata: Option<f64>,
        is_south_up: bool,
    ) -> Result<Self, Problem> {
        let tiff = Self { file, layout, nodata, is_south_up };
        let (rows, columns) = (tiff.layout.band_rows(), tiff.layout.columns);
        if !tiff.is_streamed() && rows * columns as usize > MOST_CELLS {
            return Err(Problem::Unsupported {
                what: match is_south_up {
                    true => format!("a raster from south to north in parts of {columns} x {rows} cells"),
                    false => format!("a raster of {columns} columns in tiles of {rows} rows"),
                },
                remedy: TILE,
            });
        }
        Ok(tiff)
    }

    /// Returns true if chunks are large and each is as wide as the image, so that its rows can be passed on one by one.
    fn is_streamed(&self) -> bool {
        let Layout { columns, chunk, .. } = &self.layout;
        chunk[0] >= *columns && !self.is_south_up && *columns as usize * self.layout.band_rows() > GROUP
    }

    /// Returns the rows that are unpacked at a time.
    fn rows_at_a_time(&self) -> usize {
        let (columns, rows) = (self.layout.columns as usize, self.layout.rows as usize);
        let band = self.layout.band_rows();
        if self.is_streamed() { (BLOCK / columns).clamp(1, band) } else { (GROUP / (columns * band)).max(1) * band }
            .min(rows)
    }

    /// Passes on the rows of large chunks.
    fn stream(&self, go_on: GoOn<'_>, each: &mut Each<'_>) -> Result<(), Problem> {
        let Self { file, layout, nodata, .. } = self;
        let (columns, rows, band) = (layout.columns as usize, layout.rows as usize, layout.band_rows());
        let most = self.rows_at_a_time();
        let mut samples = zeroed(most * columns)?;
        for (down, start) in (0..rows).step_by(band).enumerate() {
            let end = (start + band).min(rows);
            let chunk_rows = if layout.tiled { layout.chunk[1] } else { (end - start) as u64 };
            let mut chunk = layout.unpack(file, down, chunk_rows)?;
            for first in (start..end).step_by(most) {
                let samples = &mut samples[..most.min(end - first) * columns];
                samples.fill(f32::NAN);
                if let Some(chunk) = &mut chunk {
                    for row in samples.chunks_exact_mut(columns) {
                        if !go_on() {
                            return Err(Problem::Stopped);
                        }
                        chunk.next(*nodata, row)?;
                    }
                }
                each(first, samples)?;
            }
        }
        Ok(())
    }
}

impl Rows for Tiff<'_> {
    fn read(self: Box<Self>, go_on: GoOn<'_>, each: &mut Each<'_>) -> Result<(), Problem> {
        if self.is_streamed() {
            return self.stream(go_on, each);
        }
        let Self { file, layout, nodata, is_south_up } = &*self;
        let (columns, rows, band) = (layout.columns as usize, layout.rows as usize, layout.band_rows());
        let most = self.rows_at_a_time();
        let mut samples = filled(most * columns, 0.0)?;
        let mut pass = |start: usize| {
            let count = most.min(rows - start);
            let samples = &mut samples[..count * columns];
            par::each(samples.chunks_mut(columns * band), |k, samples| {
                layout.band(file, *nodata, start / band + k, samples, go_on)
            })?;
            if !is_south_up {
                return each(start, samples);
            }
            for row in 0..count / 2 {
                let (north, south) = samples.split_at_mut((count - 1 - row) * columns);
                north[row * columns..(row + 1) * columns].swap_with_slice(&mut south[..columns]);
            }
            each(rows - start - count, samples)
        };
        let mut starts = (0..rows).step_by(most);
        if *is_south_up { starts.rev().try_for_each(pass) } else { starts.try_for_each(&mut pass) }
    }

    fn bytes(&self) -> u64 {
        let lists = 16 * self.layout.offsets.len();
        let Layout { chunk, bands, sample, compression, .. } = self.layout;
        let chunk = chunk[0].saturating_mul(chunk[1]).saturating_mul(bands.saturating_mul(sample.bytes() as u64));
        let unpacking = rayon::current_num_threads() as u64 * memory(compression, chunk);
        (self.rows_at_a_time() * self.layout.columns as usize * size_of::<f32>() + lists) as u64 + unpacking
    }

    fn block_rows(&self, _: &Head) -> usize {
        self.rows_at_a_time()
    }
}

impl Layout {
    /// Undoes predictor 2: each sample is stored as its difference from the previous one of the same band, modulo its
    /// width.
    fn accumulate(&self, row: &mut [u8]) {
        fn run<const N: usize, T: Copy + Default>(
            row: &mut [u8],
            bands: usize,
            load: impl Fn([u8; N]) -> T,
            add: impl Fn(T, T) -> T,
            store: impl Fn(T) -> [u8; N],
        ) {
            let cells = row.as_chunks_mut::<N>().0;
            if bands == 1 {
                let mut sum = T::default();
                for cell in cells {
                    sum = add(sum, load(*cell));
                    *cell = store(sum);
                }
                return;
            }
            for at in bands..cells.len() {
                cells[at] = store(add(load(cells[at - bands]), load(cells[at])));
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
    sum_up(stored, bands);
    let samples = stored.len() / width;
    for (significance, plane) in stored.chunks_exact(samples).enumerate() {
        for (sample, byte) in row.chunks_exact_mut(width).zip(plane) {
            sample[width - 1 - significance] = *byte;
        }
    }
}

/// Replaces the differences from the byte of the cell before by their sums.
fn sum_up(stored: &mut [u8], bands: usize) {
    if bands == 1 {
        let mut sum = 0_u8;
        for byte in stored {
            sum = sum.wrapping_add(*byte);
            *byte = sum;
        }
        return;
    }
    for at in bands..stored.len() {
        stored[at] = stored[at].wrapping_add(stored[at - bands]);
    }
}

/// Joins the bytes of 32-bit numbers that are sorted by significance; `nodata` becomes NaN.
fn gather_plain(planes: &[u8], nodata: Option<f32>, out: &mut [f32]) {
    let (highest, rest) = planes.split_at(planes.len() / 4);
    let (high, rest) = rest.split_at(highest.len());
    let (low, lowest) = rest.split_at(highest.len());
    let bytes = highest.iter().zip(high).zip(low.iter().zip(lowest));
    for (out, ((a, b), (c, d))) in out.iter_mut().zip(bytes) {
        let value = f32::from_be_bytes([*a, *b, *c, *d]);
        *out = if nodata == Some(value) { f32::NAN } else { value };
    }
}

fn swap(bytes: &mut [u8], width: usize) {
    bytes.chunks_exact_mut(width).for_each(<[u8]>::reverse);
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

fn sample(directory: &Directory<'_, '_>) -> Result<Sample, Problem> {
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
