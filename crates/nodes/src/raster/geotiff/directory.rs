//! The first image file directory of a TIFF: its tags as slices of the file, each checked against the file's length.

use std::collections::BTreeMap;

use crate::raster::Problem;

/// The tags that are read.
pub(super) mod tag {
    pub const IMAGE_WIDTH: u16 = 256;
    pub const IMAGE_LENGTH: u16 = 257;
    pub const BITS_PER_SAMPLE: u16 = 258;
    pub const COMPRESSION: u16 = 259;
    pub const PHOTOMETRIC: u16 = 262;
    pub const STRIP_OFFSETS: u16 = 273;
    pub const SAMPLES_PER_PIXEL: u16 = 277;
    pub const ROWS_PER_STRIP: u16 = 278;
    pub const STRIP_BYTE_COUNTS: u16 = 279;
    pub const PLANAR_CONFIGURATION: u16 = 284;
    pub const PREDICTOR: u16 = 317;
    pub const TILE_WIDTH: u16 = 322;
    pub const TILE_LENGTH: u16 = 323;
    pub const TILE_OFFSETS: u16 = 324;
    pub const TILE_BYTE_COUNTS: u16 = 325;
    pub const SAMPLE_FORMAT: u16 = 339;
    pub const MODEL_PIXEL_SCALE: u16 = 33550;
    pub const MODEL_TIEPOINT: u16 = 33922;
    pub const MODEL_TRANSFORMATION: u16 = 34264;
    pub const GEO_KEY_DIRECTORY: u16 = 34735;
    pub const GDAL_NODATA: u16 = 42113;
}

/// The tags of one image.
pub(super) struct Directory<'a> {
    big_endian: bool,
    entries: BTreeMap<u16, Entry<'a>>,
}

struct Entry<'a> {
    kind: u16,
    data: &'a [u8],
}

/// Returns the bytes of a value of a field type. Returns None for types that are not used by the tags we read.
const fn width(kind: u16) -> Option<usize> {
    match kind {
        1 | 2 | 6 | 7 => Some(1),
        3 | 8 => Some(2),
        4 | 9 | 11 | 13 => Some(4),
        5 | 10 | 12 | 16 | 17 | 18 => Some(8),
        _ => None,
    }
}

/// A cursor over the file in its byte order.
struct Bytes<'a> {
    all: &'a [u8],
    big_endian: bool,
}

impl<'a> Bytes<'a> {
    fn slice(&self, at: u64, len: u64) -> Result<&'a [u8], Problem> {
        let part = usize::try_from(at).ok().zip(at.checked_add(len).and_then(|end| usize::try_from(end).ok()));
        part.and_then(|(at, end)| self.all.get(at..end))
            .ok_or_else(|| Problem::truncated(format!("{len} bytes at {at} are beyond its end at {}", self.all.len())))
    }

    fn number(&self, at: u64, len: u64) -> Result<u64, Problem> {
        Ok(unsigned(self.slice(at, len)?, self.big_endian))
    }
}

fn unsigned(bytes: &[u8], big_endian: bool) -> u64 {
    let push = |value: u64, byte: &u8| value << 8 | u64::from(*byte);
    if big_endian { bytes.iter().fold(0, push) } else { bytes.iter().rev().fold(0, push) }
}

impl<'a> Directory<'a> {
    /// Reads the first directory of a file.
    pub(super) fn parse(all: &'a [u8]) -> Result<Self, Problem> {
        let big_endian = all.first() == Some(&b'M');
        let bytes = Bytes { all, big_endian };
        let big = bytes.number(2, 2)? == 43;
        // position of the first directory; lengths of its count, of a tag's count and of an offset
        let (at, count_len, word) = if big { (bytes.number(8, 8)?, 8, 8) } else { (bytes.number(4, 4)?, 2, 4) };
        let count = bytes.number(at, count_len)?;
        let entry_len = 4 + 2 * word;
        let table = bytes.slice(
            at + count_len,
            count.checked_mul(entry_len).ok_or_else(|| Problem::damaged(format!("it claims {count} tags")))?,
        )?;
        let mut entries = BTreeMap::new();
        for (index, entry) in (0_u64..).zip(table.chunks_exact(entry_len as usize)) {
            let name = unsigned(&entry[..2], big_endian) as u16;
            let kind = unsigned(&entry[2..4], big_endian) as u16;
            let count = unsigned(&entry[4..4 + word as usize], big_endian);
            let Some(len) = width(kind).and_then(|width| count.checked_mul(width as u64)) else { continue };
            let value_at = at + count_len + index * entry_len + 4 + word;
            let value_at = if len <= word { value_at } else { bytes.number(value_at, word)? };
            // the first of duplicate tags counts; one beyond the end of the file is an error only if it is requested
            let data = bytes.slice(value_at, len).unwrap_or_default();
            entries.entry(name).or_insert(Entry { kind, data });
        }
        Ok(Self { big_endian, entries })
    }

    /// Returns true if numbers are big-endian.
    pub(super) const fn big_endian(&self) -> bool {
        self.big_endian
    }

    /// Returns the integers of a tag, empty if it is missing.
    pub(super) fn numbers(&self, name: u16) -> Result<Vec<u64>, Problem> {
        let Some(entry) = self.entries.get(&name) else { return Ok(Vec::new()) };
        match (entry.kind, width(entry.kind)) {
            (1 | 3 | 4 | 13 | 16 | 18, Some(width)) if !entry.data.is_empty() => {
                Ok(entry.data.chunks_exact(width).map(|value| unsigned(value, self.big_endian)).collect())
            }
            _ => Err(Problem::damaged(format!("tag {name} holds no whole numbers"))),
        }
    }

    /// Returns the integer of a tag. Returns None if it is missing.
    pub(super) fn number(&self, name: u16) -> Result<Option<u64>, Problem> {
        Ok(self.numbers(name)?.first().copied())
    }

    /// Returns the floating-point numbers of a tag, empty if it is missing or of another type.
    pub(super) fn reals(&self, name: u16) -> Vec<f64> {
        match self.entries.get(&name) {
            Some(Entry { kind: 12, data }) => {
                data.chunks_exact(8).map(|value| f64::from_bits(unsigned(value, self.big_endian))).collect()
            }
            _ => Vec::new(),
        }
    }

    /// Returns the text of a tag, up to its terminating zero. Returns None if it is missing.
    pub(super) fn text(&self, name: u16) -> Option<&'a str> {
        let entry = self.entries.get(&name)?;
        let end = entry.data.iter().position(|byte| *byte == 0).unwrap_or(entry.data.len());
        std::str::from_utf8(&entry.data[..end]).ok()
    }
}
