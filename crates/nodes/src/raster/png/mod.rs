//! PNG: grey as codes for heights, and colour as pictures.
//!
//! Source: W3C, "Portable Network Graphics (PNG) Specification (Third Edition)" (2025). Grey of up to 8 bits is read as
//! codes from 0 to 255, grey of 16 bits as codes from 0 to 65535; the sidecar or the graph gives their range. Fully
//! transparent cells are voids.
//!
//! Rows are compressed as they are written ([`Stream`]).

mod idat;
mod stream;

use std::io::Cursor;

use ::png::{BitDepth, ColorType, Decoder, DecodingError, Transformations};
use orograph_graph::memory::{collected, zeroed};

pub(super) use self::stream::{Picture, Stream, stored};
use super::{Coding, GoOn, MAX_RATIO, Problem, Raster, Sidecar, claimed_cells};

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
    // cells of less than a byte are packed, several to a byte
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
