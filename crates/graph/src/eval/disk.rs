//! Results on disk, one file each, checked when they are read back.
//!
//! A file is named by the key of its result and begins with a header: magic and version, the key, the kind of the
//! value, planes, window, length of the payload, and the BLAKE3 hash of all that and the payload. The payload is the
//! samples as little-endian `f32`, or lines or a report as JSON. A file that is not exactly what its name promises is deleted and
//! the result computed again. Files are written beside their name and renamed into place, so that several programs can
//! share a folder.

use std::{
    fs::{self, File},
    io::{self, Read as _, Seek as _, Write as _},
    path::{Path, PathBuf},
    sync::Mutex,
    time::{Duration, SystemTime},
};

use super::{event::lock, key::Key};
use crate::{
    field::Field,
    job::Cancel,
    lines::{Line, Lines, Vertex},
    report::{Axis, Measure, Report, Series},
    value::{PortType, Value},
    world::Window,
};

const MAGIC: &[u8; 8] = b"OROVALUE";
const VERSION: u32 = 1;
const HASH_BYTES: usize = 32;
const HEADER_BYTES: usize = 60 + HASH_BYTES;
const ENDING: &str = "orovalue";
const UNFINISHED: &str = ".orovalue.part";
/// Samples that are converted at a time; also how often a long transfer looks whether it is cancelled.
const CHUNK: usize = 1 << 18;

/// A folder of results under a budget of bytes.
pub(super) struct DiskCache {
    folder: PathBuf,
    budget: u64,
    /// Bytes of its files, once they have been counted.
    held: Mutex<Option<u64>>,
}

impl DiskCache {
    pub(super) fn new(folder: PathBuf, budget: u64) -> Self {
        Self { folder, budget, held: Mutex::new(None) }
    }

    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }

    fn path(&self, key: Key) -> PathBuf {
        self.folder.join(format!("{key}.{ENDING}"))
    }

    /// The result of that key, if there is one.
    ///
    /// # Errors
    /// What is wrong with a file that cannot be trusted; it has been deleted.
    pub(super) fn load(
        &self,
        key: Key,
        ty: PortType,
        window: &Window,
        cancel: &Cancel,
    ) -> Result<Option<Value>, String> {
        let path = self.path(key);
        let Ok(file) = File::open(&path) else { return Ok(None) };
        match read(file, key, ty, window, cancel) {
            Ok(value) => {
                touch(&path);
                Ok(Some(value))
            }
            Err(_) if cancel.is_cancelled() => Ok(None),
            Err(error) => {
                // what cannot be deleted is overwritten by the new result, or found damaged again
                let _ = fs::remove_file(&path);
                Err(format!("{} {error}", path.display()))
            }
        }
    }

    /// Writes a result, and deletes the least recently used ones when there are too many.
    ///
    /// # Errors
    /// When the folder cannot be written to, the disk is full, or the evaluation was cancelled meanwhile.
    pub(super) fn store(&self, key: Key, value: &Value, window: &Window, cancel: &Cancel) -> io::Result<()> {
        let json = match value {
            Value::Field(_) => None,
            Value::Lines(lines) => Some(encode_lines(lines)?),
            Value::Report(report) => Some(encode_report(report)?),
        };
        let payload = json.as_ref().map_or_else(|| value.bytes(), Vec::len) as u64;
        let bytes = HEADER_BYTES as u64 + payload;
        if bytes > self.budget {
            return Ok(());
        }
        fs::create_dir_all(&self.folder)?;
        let mut file = tempfile::Builder::new().prefix(".").suffix(UNFINISHED).tempfile_in(&self.folder)?;
        let promise = promise(key, value.as_field().map_or(0, Field::planes), window, payload);
        let mut hash = blake3::Hasher::new();
        hash.update(&promise);
        file.write_all(&[0; HEADER_BYTES])?;
        let mut put = |bytes: &[u8]| {
            stop_if(cancel)?;
            hash.update(bytes);
            file.write_all(bytes)
        };
        match (value, &json) {
            (_, Some(json)) => put(json)?,
            (Value::Field(field), None) => {
                let mut buffer = vec![0; CHUNK.min(field.samples().len()) * size_of::<f32>()];
                for chunk in field.samples().chunks(CHUNK) {
                    let bytes = &mut buffer[..size_of_val(chunk)];
                    bytes.as_chunks_mut().0.iter_mut().zip(chunk).for_each(|(to, v)| *to = v.to_le_bytes());
                    put(bytes)?;
                }
            }
            (Value::Lines(_) | Value::Report(_), None) => {}
        }
        file.rewind()?;
        file.write_all(&promise)?;
        file.write_all(hash.finalize().as_bytes())?;
        file.persist(self.path(key))?;
        self.trim(bytes)
    }

    /// Counts new bytes, and deletes the least recently used files while there are too many.
    fn trim(&self, new: u64) -> io::Result<()> {
        let mut held = lock(&self.held);
        if let Some(bytes) = held.map(|bytes| bytes + new)
            && bytes <= self.budget
        {
            *held = Some(bytes);
            return Ok(());
        }
        // count anew: other programs may share the folder
        let mut files = self.files()?;
        files.sort();
        let mut bytes: u64 = files.iter().map(|(_, _, bytes)| bytes).sum();
        for (_, path, size) in files {
            if bytes <= self.budget {
                break;
            }
            if fs::remove_file(&path).is_ok() {
                bytes -= size;
            }
        }
        *held = Some(bytes);
        Ok(())
    }

    /// The cache's files: time of last use, path and size. Leftovers of a program that was killed are removed.
    fn files(&self) -> io::Result<Vec<(SystemTime, PathBuf, u64)>> {
        let mut files = Vec::new();
        for entry in fs::read_dir(&self.folder)? {
            let entry = entry?;
            let name = entry.file_name();
            let Some(name) = name.to_str() else { continue };
            // a file that another program has just deleted is none
            let Ok(meta) = entry.metadata() else { continue };
            let Ok(used) = meta.modified() else { continue };
            if !meta.is_file() {
                continue;
            }
            if is_name(name) {
                files.push((used, entry.path(), meta.len()));
            } else if name.ends_with(UNFINISHED) && is_abandoned(used) {
                let _ = fs::remove_file(entry.path());
            }
        }
        Ok(files)
    }
}

/// Whether a file name is one that [`DiskCache::path`] gives.
fn is_name(name: &str) -> bool {
    name.split_once('.').is_some_and(|(key, ending)| {
        ending == ENDING && key.len() == 32 && key.bytes().all(|c| matches!(c, b'0'..=b'9' | b'a'..=b'f'))
    })
}

#[expect(clippy::disallowed_methods, reason = "the age of a leftover file changes no result")]
fn is_abandoned(modified: SystemTime) -> bool {
    SystemTime::now().duration_since(modified).is_ok_and(|age| age > Duration::from_secs(24 * 3600))
}

/// Marks a file as used now. Where that is not permitted, it merely looks older than it is.
#[expect(clippy::disallowed_methods, reason = "the time of last use changes no result")]
fn touch(path: &Path) {
    if let Ok(file) = File::options().append(true).open(path) {
        let _ = file.set_modified(SystemTime::now());
    }
}

/// The header up to its hash. `planes` is 0 for what is no raster.
fn promise(key: Key, planes: usize, window: &Window, payload: u64) -> Vec<u8> {
    let mut header = Vec::with_capacity(HEADER_BYTES);
    header.extend(MAGIC);
    header.extend(VERSION.to_le_bytes());
    header.extend(key.bytes());
    header.extend(if planes == 0 { b"RPRT" } else { b"FLD4" });
    header.extend((planes as u32).to_le_bytes());
    header.extend([window.origin, window.cells].as_flattened().iter().flat_map(|v| v.to_le_bytes()));
    header.extend(payload.to_le_bytes());
    header
}

fn read(mut file: File, key: Key, ty: PortType, window: &Window, cancel: &Cancel) -> io::Result<Value> {
    let damaged = |message: &str| io::Error::new(io::ErrorKind::InvalidData, message.to_owned());
    let held = file.metadata()?.len();
    let payload = match ty.planes() {
        Some(planes) => (planes * window.len() * size_of::<f32>()) as u64,
        None => held.saturating_sub(HEADER_BYTES as u64),
    };
    if held != HEADER_BYTES as u64 + payload {
        return Err(damaged("has the wrong length"));
    }
    let promise = promise(key, ty.planes().unwrap_or(0), window, payload);
    let mut header = [0; HEADER_BYTES];
    file.read_exact(&mut header)?;
    let (promised, hash_there) = header.split_at(promise.len());
    if promised != promise {
        return Err(damaged("is not what its name says"));
    }
    let mut hash = blake3::Hasher::new();
    hash.update(&promise);
    let mut take = |buffer: &mut [u8]| {
        stop_if(cancel)?;
        file.read_exact(buffer)?;
        hash.update(buffer);
        Ok::<(), io::Error>(())
    };
    let room = || io::Error::from(io::ErrorKind::OutOfMemory);
    let value = match ty.planes() {
        Some(planes) => {
            let count = planes * window.len();
            let mut samples: Vec<f32> = Vec::new();
            samples.try_reserve_exact(count).map_err(|_| room())?;
            let mut buffer = vec![0; CHUNK.min(count) * size_of::<f32>()];
            while samples.len() < count {
                let part = CHUNK.min(count - samples.len()) * size_of::<f32>();
                take(&mut buffer[..part])?;
                samples.extend(buffer[..part].as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)));
            }
            Stored::Samples(samples, planes)
        }
        None => {
            let count = usize::try_from(payload).map_err(|_| room())?;
            let mut json = Vec::new();
            json.try_reserve_exact(count).map_err(|_| room())?;
            json.resize(count, 0);
            take(&mut json)?;
            Stored::Json(json)
        }
    };
    if hash.finalize().as_bytes() != hash_there {
        return Err(damaged("is damaged"));
    }
    match value {
        Stored::Samples(samples, planes) => Ok(Field::with_planes(*window, planes, samples).into()),
        Stored::Json(json) if ty == PortType::Lines => Ok(decode_lines(&json)?.into()),
        Stored::Json(json) => Ok(decode_report(&json)?.into()),
    }
}

/// A payload whose hash has not been compared yet.
enum Stored {
    Samples(Vec<f32>, usize),
    Json(Vec<u8>),
}

fn stop_if(cancel: &Cancel) -> io::Result<()> {
    if cancel.is_cancelled() { Err(io::Error::other("cancelled")) } else { Ok(()) }
}

/// Numbers in JSON are written as their bits: it has no infinities, and a round trip must be exact.
type Bits = u64;
type StoredAxis = (String, String, Vec<Bits>);
/// Measures, series and notes.
type StoredReport = (Vec<(String, Bits, String)>, Vec<(String, StoredAxis, StoredAxis)>, Vec<String>);

/// Order, the line downstream, and the numbers of the vertices.
type StoredLine = (u32, Option<u32>, Vec<[Bits; 6]>);

fn encode_report(report: &Report) -> io::Result<Vec<u8>> {
    let axis = |axis: &Axis| -> StoredAxis {
        (axis.label.clone(), axis.unit.clone(), axis.values.iter().map(|v| v.to_bits()).collect())
    };
    let measures = report.measures.iter().map(|m| (m.name.clone(), m.value.to_bits(), m.unit.clone()));
    let series = report.series.iter().map(|s| (s.name.clone(), axis(&s.x), axis(&s.y)));
    let stored: StoredReport = (measures.collect(), series.collect(), report.notes.clone());
    Ok(serde_json::to_vec(&stored)?)
}

fn decode_report(json: &[u8]) -> io::Result<Report> {
    let (measures, series, notes): StoredReport = serde_json::from_slice(json)?;
    let axis = |(label, unit, values): StoredAxis| Axis {
        label,
        unit,
        values: values.into_iter().map(f64::from_bits).collect(),
    };
    let measures = measures.into_iter().map(|(name, bits, unit)| Measure { name, value: f64::from_bits(bits), unit });
    let series = series.into_iter().map(|(name, x, y)| Series { name, x: axis(x), y: axis(y) });
    Ok(Report { measures: measures.collect(), series: series.collect(), notes })
}

fn encode_lines(lines: &Lines) -> io::Result<Vec<u8>> {
    let stored = lines.lines.iter().map(|line| -> StoredLine {
        let vertices = line.vertices.iter().map(|vertex| vertex.numbers().map(f64::to_bits));
        (line.order, line.downstream, vertices.collect())
    });
    Ok(serde_json::to_vec(&stored.collect::<Vec<_>>())?)
}

fn decode_lines(json: &[u8]) -> io::Result<Lines> {
    let stored: Vec<StoredLine> = serde_json::from_slice(json)?;
    let lines = stored.into_iter().map(|(order, downstream, vertices)| Line {
        order,
        downstream,
        vertices: vertices.into_iter().map(|bits| Vertex::from_numbers(bits.map(f64::from_bits))).collect(),
    });
    Ok(Lines { lines: lines.collect() })
}
