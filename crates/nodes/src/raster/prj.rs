//! The coordinate system of an ESRI ASCII grid: `NAME.prj` next to `NAME.asc`, as well-known text.
//!
//! Source: OGC 18-010r7, "Well-known text representation of coordinate reference systems" (2019), and Esri's older form
//! of it, which has no codes. A system is known by its EPSG code, if the text has one, or else by its name.

use std::path::{Path, PathBuf};

use super::{Cell, Head, Problem, Projection, RasterError, is_about_units, sidecar::Beside};

/// Maximum size of the file, which is a line; larger files are something else.
const MOST_BYTES: u64 = 1 << 16;
/// The first words of such files.
const BEGINNINGS: [&str; 10] = [
    "PROJCS",
    "GEOGCS",
    "PROJCRS",
    "GEOGCRS",
    "GEODCRS",
    "COMPD_CS",
    "COMPOUNDCRS",
    "LOCAL_CS",
    "Projection",
    "PROJECTION",
];
/// EPSG codes of systems by the words of their names, in lower case.
const NAMES: [(&str, u32); 16] = [
    ("gcs wgs 1984", 4326),
    ("wgs 84", 4326),
    ("gcs north american 1983", 4269),
    ("nad83", 4269),
    ("gcs etrs 1989", 4258),
    ("etrs89", 4258),
    ("wgs 1984 web mercator auxiliary sphere", 3857),
    ("wgs 84 pseudo mercator", 3857),
    ("british national grid", 27_700),
    ("osgb 1936 british national grid", 27_700),
    ("rgf 1993 lambert 93", 2154),
    ("etrs 1989 laea", 3035),
    ("ch1903 lv95", 2056),
    ("ch1903 lv03", 21_781),
    ("nzgd 2000 new zealand transverse mercator", 2193),
    ("nzgd2000 new zealand transverse mercator 2000", 2193),
];
/// The first words of zones of UTM and the EPSG code of zone 0, north and south.
const ZONES: [(&str, u32, Option<u32>); 6] = [
    ("wgs 1984 utm zone ", 32_600, Some(32_700)),
    ("wgs 84 utm zone ", 32_600, Some(32_700)),
    ("etrs 1989 utm zone ", 25_800, None),
    ("etrs89 utm zone ", 25_800, None),
    ("nad 1983 utm zone ", 26_900, None),
    ("nad83 utm zone ", 26_900, None),
];

/// Gives a grid the coordinate system of the file beside it, if there is one.
///
/// # Errors
/// [`Problem::Sidecar`] if the file cannot be read or is no text.
pub(super) fn apply(path: &Path, head: &mut Head) -> Result<(), RasterError> {
    let Some((_, text)) = beside(path)? else { return Ok(()) };
    match code(&text) {
        Some(epsg) => place(epsg, head),
        None => head.notes.push("the coordinate system in the .prj file beside it is not known by its name".to_owned()),
    }
    Ok(())
}

/// Checks that the file beside a grid describes a coordinate system. Returns its path, or None if there is none.
///
/// # Errors
/// [`Problem::Sidecar`] if it is something else.
pub(super) fn recognise(path: &Path) -> Result<Option<PathBuf>, RasterError> {
    let Some((beside, text)) = beside(path)? else { return Ok(None) };
    if BEGINNINGS.iter().any(|word| text.trim_start().starts_with(word)) {
        return Ok(Some(beside));
    }
    let what = "it describes no coordinate system".to_owned();
    Err(Problem::Sidecar { path: beside, what }.of(path))
}

/// The file beside a grid and its text. Returns None if there is none.
fn beside(path: &Path) -> Result<Option<(PathBuf, String)>, RasterError> {
    if !is_grid(path) {
        return Ok(None);
    }
    let Some(Beside { path: beside, text }) = Beside::of(path, MOST_BYTES)? else { return Ok(None) };
    match String::from_utf8(text) {
        Ok(text) => Ok(Some((beside, text))),
        Err(_) => Err(Problem::Sidecar { path: beside, what: "it is no text in UTF-8".to_owned() }.of(path)),
    }
}

/// Returns true if a file is a grid whose coordinate system is in another file.
pub(super) fn is_grid(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("asc"))
}

fn place(epsg: u32, head: &mut Head) {
    head.epsg = Some(epsg);
    head.notes.retain(|note| !is_about_units(note));
    let Some(Cell::Metres(cell) | Cell::Degrees(cell) | Cell::Mercator(cell)) = head.cell else { return };
    head.cell = Some(match Projection::of(epsg) {
        _ if epsg == 3857 => Cell::Mercator(cell),
        Ok(system) if system.is_geographic() => Cell::Degrees(cell),
        Ok(system) => {
            head.unit_m = system.unit_m();
            Cell::Metres(cell.map(|side| side * head.unit_m))
        }
        // in metres, as most are
        Err(_) => Cell::Metres(cell),
    });
}

/// Returns the EPSG code of the system that a text describes. Returns None if it is not known.
fn code(text: &str) -> Option<u32> {
    let (mut depth, mut quoted, mut start, mut name) = (0, false, 0, None);
    for (at, c) in text.char_indices() {
        match c {
            '"' if quoted => {
                quoted = false;
                name = name.or(Some(&text[start..at]));
            }
            '"' => (quoted, start) = (true, at + 1),
            _ if quoted => {}
            '[' | '(' => depth += 1,
            ']' | ')' => depth -= 1,
            // the code of the system itself, not of one of its parts
            'A' | 'I' if depth == 1 => {
                if let Some(code) = authority(&text[at..]) {
                    return Some(code);
                }
            }
            _ => {}
        }
    }
    by_name(name?)
}

/// The code in `AUTHORITY["EPSG","32632"]` or `ID["EPSG",32632]`.
fn authority(text: &str) -> Option<u32> {
    let rest = text.strip_prefix("AUTHORITY[").or_else(|| text.strip_prefix("ID["))?;
    let (from, code) = rest.split_once(']')?.0.split_once(',')?;
    if from.trim().trim_matches('"') != "EPSG" {
        return None;
    }
    code.trim().trim_matches('"').parse().ok()
}

fn by_name(name: &str) -> Option<u32> {
    let words: Vec<&str> = name.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty()).collect();
    let name = words.join(" ").to_lowercase();
    if let Some((_, code)) = NAMES.iter().find(|(known, _)| *known == name) {
        return Some(*code);
    }
    let (zone, north, south) =
        ZONES.iter().find_map(|(start, north, south)| Some((name.strip_prefix(start)?, *north, *south)))?;
    let (number, first) = match zone.strip_suffix('s') {
        Some(number) => (number, south?),
        None => (zone.strip_suffix('n')?, north),
    };
    number.parse().ok().filter(|zone| (1..=60).contains(zone)).map(|zone: u32| first + zone)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::Reader;

    const ESRI: &str = r#"PROJCS["WGS_1984_UTM_Zone_32N",GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",
        SPHEROID["WGS_1984",6378137.0,298.257223563]],PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]],
        PROJECTION["Transverse_Mercator"],PARAMETER["Central_Meridian",9.0],UNIT["Meter",1.0]]"#;

    #[test]
    fn systems_are_known_by_code_or_name() {
        assert_eq!(code(ESRI), Some(32_632));
        for (text, expected) in [
            (r#"PROJCS["x",UNIT["metre",1,AUTHORITY["EPSG","9001"]],AUTHORITY["EPSG","2193"]]"#, Some(2193)),
            (r#"PROJCRS["x",BASEGEOGCRS["y",ID["EPSG",4326]],ID["EPSG",32719]]"#, Some(32_719)),
            (r#"PROJCS["x",UNIT["metre",1,AUTHORITY["EPSG","9001"]]]"#, None),
            (r#"PROJCS["WGS 84 / UTM zone 7S",UNIT["metre",1]]"#, Some(32_707)),
            (r#"PROJCS["ETRS_1989_UTM_Zone_33N"]"#, Some(25_833)),
            (r#"PROJCS["NAD_1983_UTM_Zone_11S"]"#, None),
            (r#"PROJCS["WGS_1984_UTM_Zone_61N"]"#, None),
            (r#"GEOGCS["GCS_WGS_1984"]"#, Some(4326)),
            (r#"PROJCS["OSGB 1936 / British National Grid"]"#, Some(27_700)),
            ("Projection UTM", None),
            ("\"]]]][[", None),
            ("é\"é[A", None),
        ] {
            assert_eq!(code(text), expected, "{text}");
        }
    }

    #[test]
    fn a_grid_gets_its_system_from_the_file_beside_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.asc");
        std::fs::write(&path, "ncols 2\nnrows 2\nxllcorner 9\nyllcorner 47\ncellsize 0.01\n1 2\n3 4\n")
            .expect("written");
        let head = |prj: &str| {
            std::fs::write(folder.path().join("a.prj"), prj).expect("written");
            Reader::open(&path).map(|reader| reader.head)
        };
        let utm = head(ESRI).expect("a grid");
        assert_eq!((utm.epsg, utm.cell, utm.notes.len()), (Some(32_632), Some(Cell::Metres([0.01; 2])), 0));
        let degrees = head(r#"GEOGCS["GCS_ETRS_1989"]"#).expect("a grid");
        assert_eq!((degrees.epsg, degrees.cell), (Some(4258), Some(Cell::Degrees([0.01; 2]))));
        let unknown = head("Projection LOCAL").expect("a grid");
        assert_eq!((unknown.epsg, unknown.notes.len()), (None, 2), "{:?}", unknown.notes);
        let feet = head(r#"PROJCS["x",AUTHORITY["EPSG","2263"]]"#).expect("a grid");
        assert_eq!(feet.unit_m, 1200.0 / 3937.0);
        assert!(head(&"x".repeat(70_000)).is_err());
    }
}
