//! Grey PNG as codes for heights; PNG as a picture.
//!
//! Source: W3C, "Portable Network Graphics (PNG) Specification (Third Edition)" (2025). Grey of up to 8 bits is read as codes
//! from 0 to 255, of 16 bits from 0 to 65535; what they stand for is told by the sidecar or by the graph. A fully
//! transparent cell is void.
//!
//! Written is with `fdeflate`, the fastest compressor there is for such rows, which works on one thread. What comes before it, a
//! third of the work, runs on the others meanwhile, band by band, so that no more than two bands lie in memory.

use std::io::{self, Cursor, Write};

use ::png::{BitDepth, ColorType, Compression, Decoder, DecodingError, Encoder, EncodingError, Transformations};

use orograph_graph::memory::{collected, zeroed};

use super::{Coding, GoOn, MAX_RATIO, Problem, Raster, Sidecar, claimed_cells, filter::filter};

/// Decodes a grey PNG.
pub(super) fn read(bytes: &[u8], sidecar: Option<&Sidecar>, go_on: GoOn<'_>) -> Result<Raster, Problem> {
    let mut decoder = Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(Transformations::EXPAND);
    decoder.ignore_checksums(false);
    let header = decoder.read_header_info().map_err(fault)?;
    let (columns, rows, colour) = (header.width, header.height, header.color_type);
    let bits = header.bit_depth as u64 * colour.samples() as u64;
    if !matches!(colour, ColorType::Grayscale | ColorType::GrayscaleAlpha) {
        return Err(Problem::Unsupported {
            what: "a colour PNG".into(),
            remedy: "convert it to 16-bit grey: a height has one channel",
        });
    }
    let held = bytes.len() as u64;
    // Cells of less than a byte are packed, so that one byte stands for several.
    let cells = claimed_cells(columns.into(), rows.into(), bits.div_ceil(8), held, MAX_RATIO * (8 / bits.min(8)))?;
    let mut reader = decoder.read_info().map_err(fault)?;
    if reader.info().animation_control.is_some() {
        return Err(Problem::Unsupported { what: "an animated PNG".into(), remedy: "save one picture of it" });
    }
    let too_large = || Problem::TooLarge { columns: columns.into(), rows: rows.into() };
    let line = reader.output_line_size(columns).ok_or_else(too_large)?;
    let mut bytes = zeroed(reader.output_buffer_size().ok_or_else(too_large)?)?;
    if reader.info().interlaced {
        reader.next_frame(&mut bytes).map_err(fault)?;
    } else {
        for row in bytes.chunks_exact_mut(line) {
            if !go_on() {
                return Err(Problem::Stopped);
            }
            reader.read_row(row).map_err(fault)?;
        }
    }
    let (samples, full): (Vec<f32>, u32) = match reader.output_color_type() {
        (ColorType::Grayscale, BitDepth::Eight) => (collected(bytes.iter().map(|v| f32::from(*v)))?, 255),
        (ColorType::GrayscaleAlpha, BitDepth::Eight) => {
            (collected(bytes.chunks_exact(2).map(|c| visible(u16::from(c[0]), u16::from(c[1]))))?, 255)
        }
        (ColorType::Grayscale, BitDepth::Sixteen) => {
            (collected(bytes.chunks_exact(2).map(|c| f32::from(word(c))))?, 65_535)
        }
        (ColorType::GrayscaleAlpha, BitDepth::Sixteen) => {
            (collected(bytes.chunks_exact(4).map(|c| visible(word(c), word(&c[2..]))))?, 65_535)
        }
        _ => return Err(Problem::damaged("its samples are not of the kind it declares")),
    };
    if samples.len() != cells {
        return Err(Problem::damaged("its first picture does not fill it"));
    }
    let mut raster = Raster::new(columns as usize, rows as usize, samples);
    raster.coding = Some(Coding { full, range: sidecar.and_then(|s| s.range) });
    raster.cell = sidecar.and_then(Sidecar::cell);
    Ok(raster)
}

fn word(bytes: &[u8]) -> u16 {
    u16::from_be_bytes([bytes[0], bytes[1]])
}

fn visible(value: u16, alpha: u16) -> f32 {
    if alpha == 0 { f32::NAN } else { f32::from(value) }
}

fn fault(error: DecodingError) -> Problem {
    match error {
        DecodingError::IoError(_) => Problem::truncated("the picture does not reach its end"),
        other => Problem::damaged(other.to_string()),
    }
}

/// What a PNG holds, and how its rows are made.
pub(super) struct Rows<'a> {
    pub(super) cells: [u32; 2],
    pub(super) colour: ColorType,
    pub(super) depth: BitDepth,
    /// Whether it is a picture with the curve of sRGB rather than numbers.
    pub(super) srgb: bool,
    /// Fills whole rows with their bytes, 16-bit numbers big end first; the first of them is told.
    pub(super) fill: &'a (dyn Fn(usize, &mut [u8]) + Sync),
}

/// Bytes of a band, the rows that are worked on together: few enough for the caches.
const BAND: usize = 1 << 20;
/// The most bytes of a chunk: the format ends at 2^31.
const MOST_OF_CHUNK: usize = 1 << 30;

/// Writes a picture, compressed fast: about an eighth larger than the best, some thirty times as fast.
pub(super) fn write(to: impl Write, picture: &Rows<'_>) -> io::Result<()> {
    encode(to, picture).map_err(|error| match error {
        EncodingError::IoError(error) => error,
        other => io::Error::other(other),
    })
}

fn encode(to: impl Write, picture: &Rows<'_>) -> Result<(), EncodingError> {
    let Rows { cells: [columns, rows], colour, depth, srgb, fill } = *picture;
    let mut encoder = Encoder::new(to, columns, rows);
    encoder.set_color(colour);
    encoder.set_depth(depth);
    encoder.set_compression(Compression::NoCompression);
    if srgb {
        encoder.set_source_srgb(::png::SrgbRenderingIntent::Perceptual);
    }
    let mut writer = encoder.write_header()?;
    let step = colour.samples() * (depth as usize / 8);
    let (length, rows) = (columns as usize * step, rows as usize);
    let packed = compressed(rows, length, step, fill)?;
    if packed.len() < length * rows {
        packed.chunks(MOST_OF_CHUNK).try_for_each(|part| writer.write_chunk(::png::chunk::IDAT, part))?;
    } else {
        // its codes are made for small rests; noise is shorter as it is
        let mut bytes = vec![0; length * rows];
        fill(0, &mut bytes);
        writer.write_image_data(&bytes)?;
    }
    writer.finish()
}

/// The compressed rows: a band is made and filtered while the one before it is compressed.
fn compressed(
    rows: usize,
    length: usize,
    step: usize,
    fill: &(dyn Fn(usize, &mut [u8]) + Sync),
) -> io::Result<Vec<u8>> {
    let band = (BAND / length).clamp(1, rows);
    // the first row is the last of the band before
    let mut bytes = vec![0; (band + 1) * length];
    let mut make = |first: usize, lines: &mut Vec<u8>| {
        let count = band.min(rows - first);
        fill(first, &mut bytes[length..(count + 1) * length]);
        lines.resize(count * (length + 1), 0);
        filter(lines, &bytes[..(count + 1) * length], length, step);
        bytes.copy_within(count * length..(count + 1) * length, 0);
    };
    let (mut now, mut next) = (Vec::new(), Vec::new());
    // room that is not needed is never touched
    let mut compressor = fdeflate::Compressor::new(Vec::with_capacity(length * rows))?;
    make(0, &mut now);
    for first in (0..rows).step_by(band) {
        let (done, ()) = rayon::join(
            || compressor.write_data(&now),
            || {
                if first + band < rows {
                    make(first + band, &mut next);
                }
            },
        );
        done?;
        std::mem::swap(&mut now, &mut next);
    }
    compressor.finish()
}
