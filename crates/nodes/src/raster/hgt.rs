//! SRTM height tiles (`N40W106.hgt`): square, big-endian `i16` in metres, -32768 for voids.
//!
//! Source: NASA LP DAAC, "SRTM User Guide" (2015). A tile covers one degree, and its outer rows and columns lie on the
//! degree lines: the samples are posts, so a cell is 1/(side - 1) degree and extends half a cell beyond the tile. The
//! name gives the position of the south-west post.

use super::{
    Cell, Problem, claimed_cells,
    raw::Numbers,
    reader::{Head, Reader, Source},
};

const VOID: i16 = -32768;

/// Opens a tile; `stem` is its name without extension.
pub(super) fn open<'a>(source: Source<'a>, stem: &str) -> Result<Reader<'a>, Problem> {
    let side = side(source.length)?;
    let side = claimed_cells(side, side, 2, source.length, 1)?.isqrt();
    let cell = 1.0 / (side - 1) as f64;
    let mut head = Head::new(side, side);
    head.cell = Some(Cell::Degrees([cell, cell]));
    head.origin = south_west(stem).map(|[lon, lat]| [lon - 0.5 * cell, lat + 1.0 + 0.5 * cell]);
    head.epsg = Some(4326);
    let number = |bytes| match i16::from_be_bytes(bytes) {
        VOID => f32::NAN,
        v => f32::from(v),
    };
    Ok(Reader { head: head.clone(), rows: Box::new(Numbers { source, head, number }) })
}

/// Returns the posts per side of a file of `held` bytes.
pub(super) fn side(held: u64) -> Result<u64, Problem> {
    let side = (held / 2).isqrt();
    if side < 2 || side * side * 2 != held {
        return Err(Problem::truncated(format!(
            "{held} bytes are not a square of 2-byte posts (1201 x 1201 and 3601 x 3601 are common)"
        )));
    }
    Ok(side)
}

/// Returns longitude and latitude from a name such as `N40W106` or `s12e044`. Returns None for other names.
fn south_west(stem: &str) -> Option<[f64; 2]> {
    let stem = stem.to_ascii_uppercase();
    let (ns, rest) = stem.split_at_checked(1)?;
    let (lat, rest) = rest.split_at_checked(2)?;
    let (ew, rest) = rest.split_at_checked(1)?;
    let (lon, _) = rest.split_at_checked(3)?;
    let number = |text: &str| text.bytes().all(|b| b.is_ascii_digit()).then(|| text.parse::<f64>().ok())?;
    let sign = |letter: &str, plus: &str, minus: &str| match letter {
        l if l == plus => Some(1.0),
        l if l == minus => Some(-1.0),
        _ => None,
    };
    let (lon, lat) = (sign(ew, "E", "W")? * number(lon)?, sign(ns, "N", "S")? * number(lat)?);
    (lon.abs() <= 180.0 && lat.abs() <= 90.0).then_some([lon, lat])
}

#[cfg(test)]
mod tests {
    use super::super::tests::memory;
    use super::*;

    fn read(bytes: &[u8], stem: &str) -> Result<super::super::Raster, Problem> {
        open(memory(bytes), stem)?.raster(&|| true)
    }

    #[test]
    fn posts_lie_on_the_degree_lines() {
        let posts: [i16; 9] = [1, 2, 3, VOID, 5, 6, -7, 8, 4320];
        let bytes: Vec<u8> = posts.iter().flat_map(|v| v.to_be_bytes()).collect();
        let raster = read(&bytes, "N40W106").unwrap();
        assert_eq!((raster.head.columns, raster.head.rows, raster.voids.cells), (3, 3, 1));
        assert_eq!((raster.samples[0], raster.samples[6], raster.samples[8]), (1.0, -7.0, 4320.0));
        assert_eq!(raster.head.cell, Some(Cell::Degrees([0.5, 0.5])));
        assert_eq!(raster.head.origin, Some([-106.25, 41.25]));
        assert_eq!(read(&bytes, "tile").unwrap().head.origin, None);
        assert_eq!(south_west("s12e044_v3"), Some([44.0, -12.0]));
        assert_eq!(south_west("N4éW106"), None);
    }

    #[test]
    fn a_tile_that_is_not_square_is_refused() {
        for len in [0, 1, 2, 7, 16] {
            assert!(matches!(read(&vec![0; len], "N00E000"), Err(Problem::Truncated(_))), "{len}");
        }
    }
}
