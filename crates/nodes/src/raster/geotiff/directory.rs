//! An image file directory of a TIFF: where its tags have their values, each checked against the file's length.

use std::{
    collections::{BTreeMap, BTreeSet},
    io::Read,
};

use orograph_graph::memory::zeroed;

use crate::raster::{Problem, reader::Shared};

/// The tags that are read.
pub(super) mod tag {
    pub const NEW_SUBFILE_TYPE: u16 = 254;
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
    pub const GEO_ASCII_PARAMS: u16 = 34737;
    pub const GDAL_METADATA: u16 = 42112;
    pub const GDAL_NODATA: u16 = 42113;
}

/// The tags of one image.
pub(super) struct Directory<'f, 'a> {
    file: &'f Shared<'a>,
    big_endian: bool,
    /// True in a BigTIFF.
    big: bool,
    entries: BTreeMap<u16, Entry>,
    /// Where the next directory begins; 0 after the last.
    next: u64,
}

struct Entry {
    kind: u16,
    /// Where its values begin, unless they are beyond the end of the file.
    at: Option<u64>,
    /// The number of its values.
    count: u64,
}

/// Maximum number of tags, which a classic TIFF cannot exceed.
const MOST_TAGS: u64 = 0xffff;
/// Maximum number of directories that are looked at; those of a damaged file may form a ring.
const MOST_IMAGES: usize = 1000;
/// Flags of the subfile type.
const REDUCED: u64 = 1;
const MASK: u64 = 4;
/// Maximum number of values of a tag that has one per band, or few.
const FEW: usize = 1 << 16;
/// Maximum number of bytes of a text; the rest is not read.
const LONGEST: usize = 1 << 20;

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

/// Returns bytes of the file.
fn slice(file: &Shared<'_>, at: u64, length: u64) -> Result<Vec<u8>, Problem> {
    let beyond = || Problem::truncated(format!("{length} bytes at {at} are beyond its end at {}", file.length()));
    let mut section = file.section(at, length).ok_or_else(beyond)?;
    let mut bytes = zeroed(usize::try_from(length).map_err(|_| beyond())?)?;
    section.read_exact(&mut bytes).map_err(Problem::Unreadable)?;
    Ok(bytes)
}

fn unsigned(bytes: &[u8], big_endian: bool) -> u64 {
    let push = |value: u64, byte: &u8| value << 8 | u64::from(*byte);
    if big_endian { bytes.iter().fold(0, push) } else { bytes.iter().rev().fold(0, push) }
}

impl<'f, 'a> Directory<'f, 'a> {
    /// Reads the first directory of a file.
    pub(super) fn parse(file: &'f Shared<'a>) -> Result<Self, Problem> {
        let big_endian = slice(file, 0, 1)? == b"M";
        let number = |at: u64, len: u64| Ok::<_, Problem>(unsigned(&slice(file, at, len)?, big_endian));
        let big = number(2, 2)? == 43;
        let at = if big { number(8, 8)? } else { number(4, 4)? };
        Self::parse_at(file, big_endian, big, at)
    }

    fn parse_at(file: &'f Shared<'a>, big_endian: bool, big: bool, at: u64) -> Result<Self, Problem> {
        let number = |at: u64, len: u64| Ok::<_, Problem>(unsigned(&slice(file, at, len)?, big_endian));
        // lengths of the count of tags, and of a tag's count and an offset
        let (count_len, word) = if big { (8, 8) } else { (2, 4) };
        let count = number(at, count_len)?;
        if count > MOST_TAGS {
            return Err(Problem::damaged(format!("it claims {count} tags")));
        }
        let entry_len = 4 + 2 * word;
        let table_at = at.saturating_add(count_len);
        let table = slice(file, table_at, count * entry_len)?;
        let mut entries = BTreeMap::new();
        for (index, entry) in (0_u64..).zip(table.chunks_exact(entry_len as usize)) {
            let name = unsigned(&entry[..2], big_endian) as u16;
            let kind = unsigned(&entry[2..4], big_endian) as u16;
            let count = unsigned(&entry[4..4 + word as usize], big_endian);
            let Some(len) = width(kind).and_then(|width| count.checked_mul(width as u64)) else { continue };
            let value_at = match len <= word {
                true => table_at + index * entry_len + 4 + word,
                false => unsigned(&entry[4 + word as usize..], big_endian),
            };
            // the first of duplicate tags counts; one beyond the end of the file is an error only if it is requested
            let at = file.section(value_at, len).map(|_| value_at);
            entries.entry(name).or_insert(Entry { kind, at, count });
        }
        // a file may end with its last directory
        let next = number(table_at + count * entry_len, word).unwrap_or(0);
        Ok(Self { file, big_endian, big, entries, next })
    }

    /// Returns the number of images after this one, without overviews and masks; what cannot be read is not counted.
    pub(super) fn further_images(&self) -> usize {
        let (mut next, mut seen, mut found) = (self.next, BTreeSet::from([0]), 0);
        while seen.insert(next) && seen.len() <= MOST_IMAGES {
            let Ok(other) = Self::parse_at(self.file, self.big_endian, self.big, next) else { break };
            let kind = other.number(tag::NEW_SUBFILE_TYPE).ok().flatten().unwrap_or(0);
            found += usize::from(kind & (REDUCED | MASK) == 0);
            next = other.next;
        }
        found
    }

    /// Returns true if numbers are big-endian.
    pub(super) const fn big_endian(&self) -> bool {
        self.big_endian
    }

    /// Returns true if there is such a tag.
    pub(super) fn has(&self, name: u16) -> bool {
        self.entries.contains_key(&name)
    }

    /// Returns the bytes of the first values of a tag. Returns None if they are beyond the end of the file.
    fn values(&self, entry: &Entry, most: usize) -> Result<Option<Vec<u8>>, Problem> {
        let Some((at, width)) = entry.at.zip(width(entry.kind)) else { return Ok(None) };
        slice(self.file, at, entry.count.min(most as u64) * width as u64).map(Some)
    }

    /// Returns the integers of a tag, at most that many, empty if it is missing.
    pub(super) fn first_numbers(&self, name: u16, most: usize) -> Result<Vec<u64>, Problem> {
        let Some(entry) = self.entries.get(&name) else { return Ok(Vec::new()) };
        let values = self.values(entry, most)?.filter(|values| !values.is_empty());
        match (entry.kind, width(entry.kind), values) {
            (1 | 3 | 4 | 13 | 16 | 18, Some(width), Some(values)) => {
                Ok(values.chunks_exact(width).map(|value| unsigned(value, self.big_endian)).collect())
            }
            _ => Err(Problem::damaged(format!("tag {name} holds no whole numbers"))),
        }
    }

    /// Returns the integers of a tag of few values, empty if it is missing.
    pub(super) fn numbers(&self, name: u16) -> Result<Vec<u64>, Problem> {
        self.first_numbers(name, FEW)
    }

    /// Returns the integer of a tag. Returns None if it is missing.
    pub(super) fn number(&self, name: u16) -> Result<Option<u64>, Problem> {
        Ok(self.first_numbers(name, 1)?.first().copied())
    }

    /// Returns the floating-point numbers of a tag, empty if it is missing or of another type.
    pub(super) fn reals(&self, name: u16) -> Result<Vec<f64>, Problem> {
        let Some(entry) = self.entries.get(&name).filter(|entry| entry.kind == 12) else { return Ok(Vec::new()) };
        let values = self.values(entry, FEW)?.unwrap_or_default();
        Ok(values.chunks_exact(8).map(|value| f64::from_bits(unsigned(value, self.big_endian))).collect())
    }

    /// Returns the text of a tag, up to its terminating zero. Returns None if it is missing.
    pub(super) fn text(&self, name: u16) -> Result<Option<String>, Problem> {
        let Some(entry) = self.entries.get(&name) else { return Ok(None) };
        let values = self.values(entry, LONGEST)?.unwrap_or_default();
        let end = values.iter().position(|byte| *byte == 0).unwrap_or(values.len());
        Ok(std::str::from_utf8(&values[..end]).ok().map(str::to_owned))
    }
}
