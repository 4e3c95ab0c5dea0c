//! One stored result as a file.
//!
//! | bytes | what |
//! |---|---|
//! | 8 | magic `OROVALUE` |
//! | 4 | version of the format |
//! | 16 | the name: hash of program, key and output |
//! | 4 | `FLDS`, `STRA`, `LINE`, `RPRT` or `STAT` |
//! | 4, 16, 8, 4 | planes, window (origin, cells), bytes of the payload, rows of a band |
//! | 32 | BLAKE3 hash of the above and of the table |
//! | 32 each | the table: BLAKE3 hash of each band, plane after plane |
//! | rest | the payload: samples as little-endian `f32`, or as one band JSON or a state |
//!
//! A part of the rows can be read and verified without the rest, so that cropping a wider raster reads only the bands
//! that the window touches.

use std::{
    fs::File,
    io::{self, Seek, Write},
};

use rayon::prelude::*;

use super::{json, state, strata};
use crate::{
    field::Field,
    job::Cancel,
    memory::{self, Zero},
    value::{PortType, Value},
    world::Window,
};

const MAGIC: &[u8; 8] = b"OROVALUE";
const VERSION: u32 = 5;
const HASH: usize = 32;
/// Fields before the hash of the header.
const FIELDS: usize = 8 + 4 + 16 + 4 + 4 + 16 + 8 + 4;
/// Approximate size of a band of rows in bytes.
const BAND_BYTES: usize = 1 << 20;
/// Number of bands that are hashed in parallel before they are written.
const BATCH: usize = 16;

/// The name of a result: its hash.
pub(super) type Name = [u8; 16];

/// What a value consists of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::eval) enum Form {
    /// That many numbers per cell.
    Planes(usize),
    /// Rock at depth.
    Strata,
    /// Lines.
    Lines,
    /// A report.
    Report,
    /// The state of a level.
    State,
}

impl Form {
    /// The form of the values of a type.
    pub(in crate::eval) fn of(ty: PortType) -> Self {
        match ty.planes() {
            Some(planes) => Self::Planes(planes),
            None if ty == PortType::Strata => Self::Strata,
            None if ty == PortType::Lines => Self::Lines,
            None => Self::Report,
        }
    }
}

/// The layout of a result in its file.
struct Layout {
    kind: &'static [u8; 4],
    planes: usize,
    window: Window,
    payload: u64,
    band_rows: usize,
}

impl Layout {
    fn of_field(planes: usize, window: &Window) -> Self {
        let row = window.nx() * size_of::<f32>();
        let payload = (planes * window.ny() * row) as u64;
        Self { kind: b"FLDS", planes, window: *window, payload, band_rows: (BAND_BYTES / row.max(1)).max(1) }
    }

    const fn of_one_band(kind: &'static [u8; 4], window: &Window, payload: u64) -> Self {
        Self { kind, planes: 0, window: *window, payload, band_rows: 0 }
    }

    /// Number of bands of one plane; one for what has no planes.
    fn bands(&self) -> usize {
        if self.planes == 0 { 1 } else { self.window.ny().div_ceil(self.band_rows) }
    }

    fn table_bytes(&self) -> usize {
        HASH * self.planes.max(1) * self.bands()
    }

    /// Offset of the payload.
    fn start(&self) -> u64 {
        (FIELDS + HASH + self.table_bytes()) as u64
    }

    fn fields(&self, name: &Name) -> Vec<u8> {
        let mut fields = Vec::with_capacity(FIELDS);
        fields.extend(MAGIC);
        fields.extend(VERSION.to_le_bytes());
        fields.extend(name);
        fields.extend(self.kind);
        fields.extend((self.planes as u32).to_le_bytes());
        fields.extend([self.window.origin, self.window.cells].as_flattened().iter().flat_map(|v| v.to_le_bytes()));
        fields.extend(self.payload.to_le_bytes());
        fields.extend((self.band_rows as u32).to_le_bytes());
        fields
    }
}

/// Size of the file of a value.
///
/// # Errors
/// When lines or a report cannot be encoded.
pub(super) fn bytes(value: &Value, window: &Window) -> u64 {
    let layout = match value {
        Value::Field(field) => Layout::of_field(field.planes(), window),
        Value::Strata(_) | Value::Lines(_) | Value::Report(_) => {
            Layout::of_one_band(b"RPRT", window, value.bytes() as u64)
        }
        Value::State(kept) => Layout::of_one_band(b"STAT", window, state::encoded_bytes(kept)),
    };
    layout.start() + layout.payload
}

/// Writes the file of a value.
///
/// # Errors
/// When it cannot be written, or the evaluation is cancelled.
pub(super) fn write<W: Write + Seek>(file: &mut W, name: &Name, value: &Value, cancel: &Cancel) -> io::Result<()> {
    match value {
        Value::Field(field) => write_field(file, name, field, cancel),
        Value::Strata(kept) => write_one_band(file, name, b"STRA", &state::encode(&strata::encode(kept))?),
        Value::Lines(lines) => write_one_band(file, name, b"LINE", &json::encode_lines(lines)?),
        Value::Report(report) => write_one_band(file, name, b"RPRT", &json::encode_report(report)?),
        Value::State(kept) => write_one_band(file, name, b"STAT", &state::encode(kept)?),
    }
}

fn write_one_band(file: &mut impl Write, name: &Name, kind: &'static [u8; 4], payload: &[u8]) -> io::Result<()> {
    // What has no planes is found by the window in their file name; the one inside is not read.
    let window = Window { world: crate::World::default(), origin: [0; 2], cells: [0; 2] };
    let layout = Layout::of_one_band(kind, &window, payload.len() as u64);
    file.write_all(&header(&layout.fields(name), blake3::hash(payload).as_bytes()))?;
    file.write_all(payload)
}

fn write_field<W: Write + Seek>(file: &mut W, name: &Name, field: &Field, cancel: &Cancel) -> io::Result<()> {
    let layout = Layout::of_field(field.planes(), field.window());
    let band = layout.band_rows * field.window().nx();
    let bands: Vec<&[f32]> = (0..field.planes()).flat_map(|plane| field.plane(plane).chunks(band)).collect();
    let fields = layout.fields(name);
    // The header is written last, when its hashes are known; until then the file has a temporary name.
    file.write_all(&vec![0; layout.start() as usize])?;
    let mut table = Vec::with_capacity(layout.table_bytes());
    for batch in bands.chunks(BATCH) {
        stop_if(cancel)?;
        let encoded: Vec<(Vec<u8>, blake3::Hash)> = batch
            .par_iter()
            .map(|samples| {
                let mut bytes = vec![0; size_of_val(*samples)];
                bytes.as_chunks_mut().0.iter_mut().zip(*samples).for_each(|(to, v)| *to = v.to_le_bytes());
                let hash = blake3::hash(&bytes);
                (bytes, hash)
            })
            .collect();
        for (bytes, hash) in encoded {
            file.write_all(&bytes)?;
            table.extend(hash.as_bytes());
        }
    }
    file.rewind()?;
    file.write_all(&header(&fields, &table))
}

/// Fields, the hash of fields and table, and the table.
fn header(fields: &[u8], table: &[u8]) -> Vec<u8> {
    let hash = blake3::Hasher::new().update(fields).update(table).finalize();
    [fields, hash.as_bytes(), table].concat()
}

/// Reads the part of a value on a window, from the file of the value on `stored`.
///
/// # Errors
/// When the file does not match its name, cannot be read, or reading is cancelled.
pub(super) fn read(
    file: &File,
    name: &Name,
    form: Form,
    stored: &Window,
    window: &Window,
    cancel: &Cancel,
) -> io::Result<Value> {
    let held = file.metadata()?.len();
    let Form::Planes(planes) = form else {
        let none = Window { world: crate::World::default(), origin: [0; 2], cells: [0; 2] };
        let kind = match form {
            Form::Strata => b"STRA",
            Form::Lines => b"LINE",
            Form::State => b"STAT",
            Form::Report | Form::Planes(_) => b"RPRT",
        };
        let blank = Layout::of_one_band(kind, &none, 0);
        let layout = Layout::of_one_band(kind, &none, held.saturating_sub(blank.start()));
        let table = read_table(file, name, &layout, held)?;
        let bytes = read_band(file, layout.start(), layout.payload as usize, &table, cancel)?;
        return Ok(match form {
            Form::Strata => strata::decode(state::decode(&bytes)?, window)?.into(),
            Form::Lines => json::decode_lines(&bytes)?.into(),
            Form::State => state::decode(&bytes)?.into(),
            Form::Report | Form::Planes(_) => json::decode_report(&bytes)?.into(),
        });
    };
    let layout = Layout::of_field(planes, stored);
    let table = read_table(file, name, &layout, held)?;
    let mut samples: Vec<f32> = zeroed(planes * window.len())?;
    let top = (window.origin[1] - stored.origin[1]) as usize;
    let left = (window.origin[0] - stored.origin[0]) as usize;
    // Rows of the result by band; the first and the last band may be partial.
    let first_rows = (layout.band_rows - top % layout.band_rows).min(window.ny());
    let (nx, planes_rows) = (window.nx(), window.len());
    samples.par_chunks_mut(planes_rows).enumerate().try_for_each(|(plane, samples)| {
        let (head, rest) = samples.split_at_mut(first_rows * nx);
        let parts = std::iter::once(head).chain(rest.chunks_mut(layout.band_rows * nx)).collect::<Vec<_>>();
        parts.into_par_iter().enumerate().filter(|(_, part)| !part.is_empty()).try_for_each(|(at, part)| {
            let band = top / layout.band_rows + at;
            let rows = layout.band_rows.min(stored.ny() - band * layout.band_rows);
            let row_bytes = stored.nx() * size_of::<f32>();
            let before = (plane * stored.ny() + band * layout.band_rows) * row_bytes;
            let hash = &table[HASH * (plane * layout.bands() + band)..][..HASH];
            let bytes = read_band(file, layout.start() + before as u64, rows * row_bytes, hash, cancel)?;
            let skipped = if at == 0 { top % layout.band_rows } else { 0 };
            for (row, out) in part.chunks_exact_mut(nx).enumerate() {
                let from = &bytes[(skipped + row) * row_bytes + left * size_of::<f32>()..][..size_of_val(out)];
                out.iter_mut().zip(from.as_chunks().0).for_each(|(to, bytes)| *to = f32::from_le_bytes(*bytes));
            }
            Ok::<(), io::Error>(())
        })
    })?;
    Ok(Field::with_planes(*window, planes, samples).into())
}

fn read_table(file: &File, name: &Name, layout: &Layout, held: u64) -> io::Result<Vec<u8>> {
    if held != layout.start() + layout.payload {
        return Err(damaged("has the wrong length"));
    }
    let mut header = vec![0; layout.start() as usize];
    read_at(file, &mut header, 0)?;
    let (fields, rest) = header.split_at(FIELDS);
    let (hash, table) = rest.split_at(HASH);
    if fields != layout.fields(name) {
        return Err(damaged("does not match its name"));
    }
    if blake3::Hasher::new().update(fields).update(table).finalize().as_bytes() != hash {
        return Err(damaged("is damaged"));
    }
    Ok(table.to_vec())
}

fn read_band(file: &File, at: u64, count: usize, hash: &[u8], cancel: &Cancel) -> io::Result<Vec<u8>> {
    stop_if(cancel)?;
    let mut bytes: Vec<u8> = zeroed(count)?;
    read_at(file, &mut bytes, at)?;
    if blake3::hash(&bytes).as_bytes() != hash { Err(damaged("is damaged")) } else { Ok(bytes) }
}

pub(super) fn zeroed<T: Zero>(count: usize) -> io::Result<Vec<T>> {
    memory::zeroed(count).map_err(|refused| io::Error::new(io::ErrorKind::OutOfMemory, refused))
}

/// Fills a buffer from an offset of the file, without moving a position shared with others.
#[cfg(unix)]
fn read_at(file: &File, buffer: &mut [u8], at: u64) -> io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, buffer, at)
}

/// As above.
#[cfg(windows)]
fn read_at(file: &File, buffer: &mut [u8], at: u64) -> io::Result<()> {
    let mut done = 0;
    while done < buffer.len() {
        match std::os::windows::fs::FileExt::seek_read(file, &mut buffer[done..], at + done as u64)? {
            0 => return Err(io::ErrorKind::UnexpectedEof.into()),
            count => done += count,
        }
    }
    Ok(())
}

pub(super) fn damaged(message: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, message.to_owned())
}

fn stop_if(cancel: &Cancel) -> io::Result<()> {
    if cancel.is_cancelled() { Err(io::Error::other("cancelled")) } else { Ok(()) }
}
