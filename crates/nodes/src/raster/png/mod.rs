//! PNG: grey as codes for heights, and colour as pictures.
//!
//! Source: W3C, "Portable Network Graphics (PNG) Specification (Third Edition)" (2025). Grey of up to 8 bits is read as
//! codes from 0 to 255, grey of 16 bits as codes from 0 to 65535; the sidecar or the graph gives their range. Fully
//! transparent cells are voids.
//!
//! Rows are compressed as they are written ([`Stream`]).

mod idat;
mod stream;

use ::png::{BitDepth, ColorType, Decoder, DecodingError, Transformations};
use orograph_graph::memory::zeroed;

pub(super) use self::stream::{Picture, Stream, stored};
use super::{
    Coding, GoOn, MAX_RATIO, Problem, Sidecar, claimed_cells,
    reader::{Bytes, Each, Head, Reader, Rows, Source},
};

/// Maximum number of cells of an interlaced picture, of up to four bytes: it is complete only at its end.
const MOST_INTERLACED: u64 = 1 << 24;

/// Opens a grey PNG.
pub(super) fn open<'a>(source: Source<'a>, sidecar: Option<&Sidecar>) -> Result<Reader<'a>, Problem> {
    let mut decoder = Decoder::new(source.bytes);
    decoder.set_transformations(Transformations::EXPAND);
    decoder.ignore_checksums(false);
    // they may be large, and say nothing about heights
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    let header = decoder.read_header_info().map_err(fault)?;
    let (columns, rows, colour) = (u64::from(header.width), u64::from(header.height), header.color_type);
    let bits = header.bit_depth as u64 * colour.samples() as u64;
    let interlaced = header.interlaced;
    if !matches!(colour, ColorType::Grayscale | ColorType::GrayscaleAlpha) {
        return Err(Problem::Unsupported {
            what: "a colour PNG".into(),
            remedy: "convert it to 16-bit grey: a height has one channel",
        });
    }
    // cells of less than a byte are packed, several to a byte
    let cells = claimed_cells(columns, rows, bits.div_ceil(8), source.length, MAX_RATIO * (8 / bits.min(8)))?;
    if interlaced && cells as u64 > MOST_INTERLACED {
        return Err(Problem::Unsupported {
            what: format!("an interlaced PNG of {columns} x {rows} cells, more than {MOST_INTERLACED} in all"),
            remedy: "save it without interlacing",
        });
    }
    let reader = decoder.read_info().map_err(fault)?;
    if reader.info().animation_control.is_some() {
        return Err(Problem::Unsupported { what: "an animated PNG".into(), remedy: "save one picture of it" });
    }
    let (_, depth) = reader.output_color_type();
    let mut head = Head::new(columns as usize, rows as usize);
    let full = if depth == BitDepth::Sixteen { 65_535 } else { 255 };
    head.coding = Some(Coding { full, range: sidecar.and_then(|s| s.range) });
    sidecar.into_iter().for_each(|sidecar| sidecar.locate(&mut head));
    let step = match reader.output_color_type() {
        (ColorType::Grayscale, BitDepth::Eight) => 1,
        (ColorType::GrayscaleAlpha, BitDepth::Eight) | (ColorType::Grayscale, BitDepth::Sixteen) => 2,
        (ColorType::GrayscaleAlpha, BitDepth::Sixteen) => 4,
        _ => return Err(Problem::damaged("its samples are not of the kind it declares")),
    };
    if reader.output_line_size(columns as u32) != Some(head.columns * step) {
        return Err(Problem::damaged("its first picture does not fill it"));
    }
    Ok(Reader { head: head.clone(), rows: Box::new(Grey { reader, head, step }) })
}

/// The rows of a grey picture.
struct Grey<'a> {
    reader: ::png::Reader<Box<dyn Bytes + 'a>>,
    head: Head,
    /// Bytes of a cell.
    step: usize,
}

impl Rows for Grey<'_> {
    fn read(self: Box<Self>, go_on: GoOn<'_>, each: &mut Each<'_>) -> Result<(), Problem> {
        let Self { mut reader, head, step } = *self;
        let (columns, line, most) = (head.columns, head.columns * step, head.block_rows());
        let is_alpha = reader.output_color_type().0 == ColorType::GrayscaleAlpha;
        let interlaced = reader.info().interlaced;
        let mut bytes = zeroed(line * if interlaced { head.rows } else { most })?;
        if interlaced {
            if reader.output_buffer_size() != Some(bytes.len()) {
                return Err(Problem::damaged("its first picture does not fill it"));
            }
            reader.next_frame(&mut bytes).map_err(fault)?;
        }
        let mut samples = zeroed(most * columns)?;
        for first in (0..head.rows).step_by(most) {
            let count = most.min(head.rows - first);
            let bytes = if interlaced { &mut bytes[first * line..] } else { &mut bytes[..] };
            let bytes = &mut bytes[..count * line];
            if !interlaced {
                for row in bytes.chunks_exact_mut(line) {
                    if !go_on() {
                        return Err(Problem::Stopped);
                    }
                    reader.read_row(row).map_err(fault)?;
                }
            }
            let samples = &mut samples[..count * columns];
            let cells = samples.iter_mut().zip(bytes.chunks_exact(step));
            match (is_alpha, step) {
                (false, 1) => cells.for_each(|(sample, c)| *sample = f32::from(c[0])),
                (false, _) => cells.for_each(|(sample, c)| *sample = f32::from(word(c))),
                (true, 2) => cells.for_each(|(sample, c)| *sample = visible(u16::from(c[0]), u16::from(c[1]))),
                (true, _) => cells.for_each(|(sample, c)| *sample = visible(word(c), word(&c[2..]))),
            }
            each(first, samples)?;
        }
        Ok(())
    }

    fn bytes(&self) -> u64 {
        let rows = self.head.block_rows();
        let unpacked = if self.reader.info().interlaced { self.head.rows } else { rows };
        // and what the decoder holds
        (self.head.columns * (unpacked * self.step + rows * size_of::<f32>()) + (1 << 19)) as u64
    }

    fn may_have_voids(&self) -> bool {
        self.reader.output_color_type().0 == ColorType::GrayscaleAlpha
    }
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
