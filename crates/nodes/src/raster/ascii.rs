//! ESRI ASCII grids (`.asc`): a header of keywords and numbers, then rows of numbers, north first.
//!
//! Source: Esri, "Esri ASCII raster format" (ArcGIS documentation); `dx` and `dy` for cells that are not square are
//! GDAL's extension. Keywords are case-insensitive; `xllcorner`/`yllcorner` are the outer corner,
//! `xllcenter`/`yllcenter` the centre of the south-west cell. The format has no reference system: grids that fit on
//! the globe with cells of at most a tenth of a degree are assumed to be longitude and latitude.

use orograph_graph::memory::zeroed;

use super::{
    ASSUMED_DEGREES, ASSUMED_METRES, Cell, GoOn, Problem, claimed_cells, is_on_globe, looks_geographic,
    reader::{Bytes, Each, Head, Reader, Rows, Source},
};

/// The words of a header, in lower case.
const WORDS: [&str; 10] =
    ["ncols", "nrows", "xllcorner", "yllcorner", "xllcenter", "yllcenter", "cellsize", "dx", "dy", "nodata_value"];

#[derive(Default)]
struct Header {
    columns: Option<u64>,
    rows: Option<u64>,
    west: Option<f64>,
    south: Option<f64>,
    centred: [bool; 2],
    cell: [Option<f64>; 2],
    nodata: Option<f32>,
}

/// Opens a grid.
pub(super) fn open(source: Source<'_>) -> Result<Reader<'_>, Problem> {
    let mut words = Words { bytes: source.bytes, word: Vec::new(), again: false };
    words.skip_mark()?;
    // What is not a grid at all is not quoted in a message.
    if !words.next()?.is_some_and(is_field) {
        return Err(no_header());
    }
    words.again = true;
    let mut header = Header::default();
    while let Some(word) = words.next()? {
        if !header_word(word) {
            words.again = true;
            break;
        }
        let name = word.to_vec();
        let value = words
            .next()?
            .ok_or_else(|| Problem::truncated(format!("`{}` has no value", String::from_utf8_lossy(&name))))?;
        header.set(&name, value)?;
    }
    let (Some(columns), Some(rows)) = (header.columns, header.rows) else {
        return Err(no_header());
    };
    // a cell needs at least a digit and a blank
    claimed_cells(columns, rows, 2, source.length + 1, 1)?;
    let mut head = Head::new(columns as usize, rows as usize);
    head.assumes_voids = header.nodata.is_none();
    header.place(&mut head);
    let grid = Grid { words, head: head.clone(), nodata: header.nodata };
    Ok(Reader { head, rows: Box::new(grid) })
}

/// The longest word: numbers are shorter, and longer words are cut off, which leaves no number.
const LONGEST: usize = 1 << 10;

/// The words of a file.
struct Words<'a> {
    bytes: Box<dyn Bytes + 'a>,
    word: Vec<u8>,
    /// True if the last word is to be returned again.
    again: bool,
}

impl Words<'_> {
    /// Skips a byte order mark.
    fn skip_mark(&mut self) -> Result<(), Problem> {
        let mark = b"\xef\xbb\xbf";
        if !self.bytes.fill_buf().map_err(Problem::Unreadable)?.starts_with(mark) {
            return Ok(());
        }
        self.bytes.consume(mark.len());
        Ok(())
    }

    fn next(&mut self) -> Result<Option<&[u8]>, Problem> {
        if std::mem::take(&mut self.again) {
            return Ok(Some(&self.word));
        }
        self.word.clear();
        loop {
            let buffer = self.bytes.fill_buf().map_err(Problem::Unreadable)?;
            if buffer.is_empty() {
                break;
            }
            let blanks = match self.word.is_empty() {
                true => buffer.iter().take_while(|byte| byte.is_ascii_whitespace()).count(),
                false => 0,
            };
            let rest = &buffer[blanks..];
            let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
            let room = LONGEST - self.word.len();
            if length > room {
                // `x` makes it no number
                self.word.extend_from_slice(&rest[..room]);
                self.word[LONGEST - 1] = b'x';
            } else {
                self.word.extend_from_slice(&rest[..length]);
            }
            let is_complete = length < rest.len() && !self.word.is_empty();
            self.bytes.consume(blanks + length);
            if is_complete {
                break;
            }
        }
        Ok(if self.word.is_empty() { None } else { Some(&self.word) })
    }
}

/// The cells of a grid.
struct Grid<'a> {
    words: Words<'a>,
    head: Head,
    nodata: Option<f32>,
}

impl Rows for Grid<'_> {
    fn read(mut self: Box<Self>, go_on: GoOn<'_>, each: &mut Each<'_>) -> Result<(), Problem> {
        let Head { columns, rows, .. } = self.head;
        let most = self.head.block_rows();
        let mut samples = zeroed(most * columns)?;
        for first in (0..rows).step_by(most) {
            let count = most.min(rows - first) * columns;
            for (at, sample) in (first * columns..).zip(&mut samples[..count]) {
                if at % (1 << 15) == 0 && !go_on() {
                    return Err(Problem::Stopped);
                }
                let Some(word) = self.words.next()? else {
                    return Err(Problem::truncated(format!("{at} of {} cells are there", columns * rows)));
                };
                let value: f32 = parse(word).ok_or_else(|| {
                    let (row, column) = (at / columns + 1, at % columns + 1);
                    let place = format!("`{}` in row {row}, column {column}", excerpt(word));
                    if word.contains(&b',') {
                        let (what, remedy) = (format!("a decimal comma ({place})"), "write decimals with a point");
                        return Problem::Unsupported { what, remedy };
                    }
                    Problem::damaged(format!("{place} is not a number"))
                })?;
                *sample = if self.nodata == Some(value) { f32::NAN } else { value };
            }
            each(first, &mut samples[..count])?;
        }
        match self.words.next()? {
            Some(word) => {
                Err(Problem::damaged(format!("`{}` follows the last of its {columns} x {rows} cells", excerpt(word))))
            }
            None => Ok(()),
        }
    }

    fn bytes(&self) -> u64 {
        (self.head.block_rows() * self.head.columns * size_of::<f32>()) as u64
    }
}

/// Returns true if the first word is one of a header.
pub(super) fn begins(bytes: &[u8]) -> bool {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let first = bytes.split(u8::is_ascii_whitespace).find(|word| !word.is_empty());
    first.is_some_and(is_field)
}

/// Returns true for a word of a header.
fn is_field(word: &[u8]) -> bool {
    WORDS.iter().any(|field| field.as_bytes().eq_ignore_ascii_case(word))
}

fn no_header() -> Problem {
    Problem::damaged("its header does not begin with `ncols` and `nrows`")
}

fn header_word(word: &[u8]) -> bool {
    word[0].is_ascii_alphabetic() && parse::<f32>(word).is_none()
}

fn parse<T: std::str::FromStr>(word: &[u8]) -> Option<T> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// Returns the start of a word, short enough for a message.
fn excerpt(word: &[u8]) -> String {
    String::from_utf8_lossy(&word[..word.len().min(24)]).into_owned()
}

impl Header {
    fn set(&mut self, word: &[u8], value: &[u8]) -> Result<(), Problem> {
        let name = String::from_utf8_lossy(word).to_ascii_lowercase();
        let wrong = || Problem::damaged(format!("`{}` is no value for `{}`", excerpt(value), excerpt(word)));
        let number = || parse::<f64>(value).filter(|v| v.is_finite()).ok_or_else(wrong);
        let length = || number().and_then(|v| if v > 0.0 { Ok(Some(v)) } else { Err(wrong()) });
        match name.as_str() {
            "ncols" => self.columns = Some(parse(value).ok_or_else(wrong)?),
            "nrows" => self.rows = Some(parse(value).ok_or_else(wrong)?),
            "xllcorner" => self.west = Some(number()?),
            "yllcorner" => self.south = Some(number()?),
            "xllcenter" => (self.west, self.centred[0]) = (Some(number()?), true),
            "yllcenter" => (self.south, self.centred[1]) = (Some(number()?), true),
            "cellsize" => self.cell = [length()?; 2],
            "dx" => self.cell[0] = length()?,
            "dy" => self.cell[1] = length()?,
            "nodata_value" => self.nodata = Some(parse(value).ok_or_else(wrong)?),
            _ => return Err(Problem::damaged(format!("`{}` is no word of an ESRI ASCII grid", excerpt(word)))),
        }
        Ok(())
    }

    fn place(&self, head: &mut Head) {
        let [Some(dx), Some(dy)] = self.cell else { return };
        head.cell = Some(Cell::Metres([dx, dy]));
        let (Some(west), Some(south)) = (self.west, self.south) else { return };
        let west = if self.centred[0] { west - 0.5 * dx } else { west };
        let south = if self.centred[1] { south - 0.5 * dy } else { south };
        let origin = [west, south + dy * head.rows as f64];
        head.origin = Some(origin);
        if looks_geographic(origin, [dx, dy], head.columns, head.rows) {
            head.cell = Some(Cell::Degrees([dx, dy]));
            head.notes.push(ASSUMED_DEGREES.to_owned());
        } else if [west, south] != [0.0; 2] && is_on_globe(origin, [dx, dy], head.columns, head.rows) {
            head.notes.push(ASSUMED_METRES.to_owned());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Raster, tests::memory};
    use super::*;

    fn read(bytes: &[u8]) -> Result<Raster, Problem> {
        open(memory(bytes))?.raster(&|| true)
    }

    #[test]
    fn words_are_read_in_any_case_and_the_corner_from_the_centre() {
        let text = b"NCOLS 3\r\nnrows 2\nXLLCENTER 500015\nyllCenter 4000015\nCellSize 30\nnodata_VALUE -9999\n\
                     1 2.5 -9999\n4e1 nan -6\n";
        let raster = read(text).unwrap();
        assert_eq!((raster.head.columns, raster.head.rows, raster.voids.cells), (3, 2, 2));
        assert_eq!((raster.samples[1], raster.samples[3], raster.samples[5]), (2.5, 40.0, -6.0));
        assert_eq!(raster.head.cell, Some(Cell::Metres([30.0, 30.0])));
        assert_eq!(raster.head.origin, Some([500_000.0, 4_000_060.0]));
    }

    #[test]
    fn what_is_wrong_is_named() {
        let message = |text: &[u8]| read(text).expect_err("wrong").to_string();
        assert!(message(b"ncols 2 nrows 2 cellsize 1 1 2 x 4").contains("row 2, column 1"));
        assert!(message(b"ncols 2 nrows 2 cellsize 1 1 2 3").contains("3 of 4 cells"));
        assert!(message(b"ncols 2 nrows 2 1 2 3 4 5").contains("`5` follows"));
        assert!(message(b"ncols 2 nrows 2 cellsize -1 1 2 3 4").contains("cellsize"));
        assert!(message(b"ncols 20000 nrows 30000 cellsize 1 1 2 3 4").contains("20000 x 30000"));
        assert!(message(b"ncols 0 nrows 3 cellsize 1").contains("nothing in it"));
        assert!(message(b"ncols 2 height 3").contains("`height`"));
        assert!(message(b"height 3").contains("does not begin with `ncols`"), "what is no grid is not quoted");
        assert!(message(b"").contains("ncols"));
        assert!(message(b"ncols 2 nrows 1 1,5 2").contains("a decimal comma (`1,5` in row 1, column 1)"));
        let long = [&b"ncols 2 nrows 1 1 "[..], &[b'1'; 9000]].concat();
        assert!(message(&long).contains("row 1, column 2"));
    }
}
