//! ESRI ASCII grids (`.asc`): a header of keywords and numbers, then rows of numbers, north first.
//!
//! Source: Esri, "Esri ASCII raster format" (ArcGIS documentation); `dx` and `dy` for cells that are not square are
//! GDAL's extension. Keywords are case-insensitive; `xllcorner`/`yllcorner` are the outer corner,
//! `xllcenter`/`yllcenter` the centre of the south-west cell. The format has no reference system: grids that fit on
//! the globe with cells of at most a tenth of a degree are assumed to be longitude and latitude.

use orograph_graph::memory::with_capacity;

use super::{Cell, GoOn, Problem, Raster, claimed_cells, looks_geographic};

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

/// Decodes a grid.
pub(super) fn read(bytes: &[u8], go_on: GoOn<'_>) -> Result<Raster, Problem> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut words = bytes.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).peekable();
    let mut header = Header::default();
    while let Some(word) = words.next_if(|word| header_word(word)) {
        let value = words
            .next()
            .ok_or_else(|| Problem::truncated(format!("`{}` has no value", String::from_utf8_lossy(word))))?;
        header.set(word, value)?;
    }
    let (Some(columns), Some(rows)) = (header.columns, header.rows) else {
        return Err(Problem::damaged("its header does not begin with `ncols` and `nrows`"));
    };
    // a cell needs at least a digit and a blank
    let cells = claimed_cells(columns, rows, 2, bytes.len() as u64 + 1, 1)?;
    let mut samples = with_capacity(cells)?;
    for word in words.by_ref().take(cells) {
        let value: f32 = parse(word).ok_or_else(|| {
            let at = samples.len() as u64;
            let (row, column) = (at / columns + 1, at % columns + 1);
            Problem::damaged(format!("`{}` in row {row}, column {column} is not a number", excerpt(word)))
        })?;
        if samples.len() % (1 << 15) == 0 && !go_on() {
            return Err(Problem::Stopped);
        }
        samples.push(if header.nodata == Some(value) { f32::NAN } else { value });
    }
    if samples.len() < cells {
        return Err(Problem::truncated(format!("{} of {cells} cells are there", samples.len())));
    }
    if let Some(word) = words.next() {
        return Err(Problem::damaged(format!("`{}` follows the last of its {columns} x {rows} cells", excerpt(word))));
    }
    let mut raster = Raster::new(columns as usize, rows as usize, samples);
    header.place(&mut raster);
    Ok(raster)
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

    fn place(&self, raster: &mut Raster) {
        let [Some(dx), Some(dy)] = self.cell else { return };
        raster.cell = Some(Cell::Metres([dx, dy]));
        let (Some(west), Some(south)) = (self.west, self.south) else { return };
        let west = if self.centred[0] { west - 0.5 * dx } else { west };
        let south = if self.centred[1] { south - 0.5 * dy } else { south };
        let origin = [west, south + dy * raster.rows as f64];
        raster.origin = Some(origin);
        if looks_geographic(origin, [dx, dy], raster.columns, raster.rows) {
            raster.cell = Some(Cell::Degrees([dx, dy]));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_read_in_any_case_and_the_corner_from_the_centre() {
        let text = b"NCOLS 3\r\nnrows 2\nXLLCENTER 500015\nyllCenter 4000015\nCellSize 30\nnodata_VALUE -9999\n\
                     1 2.5 -9999\n4e1 nan -6\n";
        let raster = read(text, &|| true).unwrap();
        assert_eq!((raster.columns, raster.rows, raster.voids()), (3, 2, 2));
        assert_eq!((raster.samples[1], raster.samples[3], raster.samples[5]), (2.5, 40.0, -6.0));
        assert_eq!(raster.cell, Some(Cell::Metres([30.0, 30.0])));
        assert_eq!(raster.origin, Some([500_000.0, 4_000_060.0]));
    }

    #[test]
    fn what_is_wrong_is_named() {
        let message = |text: &[u8]| read(text, &|| true).expect_err("wrong").to_string();
        assert!(message(b"ncols 2 nrows 2 cellsize 1 1 2 x 4").contains("row 2, column 1"));
        assert!(message(b"ncols 2 nrows 2 cellsize 1 1 2 3").contains("3 of 4 cells"));
        assert!(message(b"ncols 2 nrows 2 1 2 3 4 5").contains("`5` follows"));
        assert!(message(b"ncols 2 nrows 2 cellsize -1 1 2 3 4").contains("cellsize"));
        assert!(message(b"ncols 20000 nrows 30000 cellsize 1 1 2 3 4").contains("20000 x 30000"));
        assert!(message(b"ncols 0 nrows 3 cellsize 1").contains("nothing in it"));
        assert!(message(b"height 3").contains("`height`"));
        assert!(message(b"").contains("ncols"));
    }
}
