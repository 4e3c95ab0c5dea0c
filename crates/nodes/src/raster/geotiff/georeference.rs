//! Position and cell size of a GeoTIFF, and the unit of its values.

use super::{
    directory::{Directory, tag},
    metadata::Items,
};
use crate::raster::{ASSUMED_DEGREES, Cell, Head, Problem, Scaling, looks_geographic};

/// The keys of the GeoKey directory that are read.
mod key {
    pub const MODEL_TYPE: u64 = 1024;
    pub const RASTER_TYPE: u64 = 1025;
    pub const GEOGRAPHIC_TYPE: u64 = 2048;
    pub const PROJECTED_TYPE: u64 = 3072;
    pub const PROJECTION: u64 = 3075;
    pub const LINEAR_UNITS: u64 = 3076;
    pub const VERTICAL: u64 = 4096;
    pub const VERTICAL_UNITS: u64 = 4099;
}

/// EPSG codes of Web Mercator, among them withdrawn ones and those of Esri and of early web maps.
const WEB_MERCATOR: [u32; 5] = [3857, 3785, 900_913, 102_100, 102_113];
/// Codes of other cylindrical projections of the whole world, whose metres are not metres on the ground.
const CYLINDRICAL: [u32; 7] = [3395, 3832, 3994, 4087, 6933, 54_001, 54_004];
/// Values of the key of the projection for the same: Mercator, equirectangular, cylindrical of equal area.
const CYLINDRICAL_METHODS: [u64; 3] = [7, 17, 28];

/// Vertical reference systems in feet, and the codes of their units: NAVD88 and NGVD29.
const VERTICAL_IN_FEET: [(u64, u64); 3] = [(6360, 9003), (8228, 9002), (5702, 9003)];
/// Names of common vertical reference systems.
const VERTICAL_NAMES: [(u64, &str); 9] = [
    (3855, "EGM2008"),
    (5773, "EGM96"),
    (5798, "EGM84"),
    (5703, "NAVD88"),
    (6360, "NAVD88 in feet"),
    (8228, "NAVD88 in feet"),
    (5701, "Newlyn"),
    (5783, "DHHN92"),
    (7837, "DHHN2016"),
];

/// Code for "given by other keys".
const USER_DEFINED: u64 = 32_767;

/// Reads cell size, north-west corner, reference system and the conversion of samples to metres from the tags. Returns
/// true if the first row is the southernmost.
pub(super) fn read(directory: &Directory<'_, '_>, items: &Items, head: &mut Head) -> Result<bool, Problem> {
    let keys = directory.numbers(tag::GEO_KEY_DIRECTORY)?;
    // four shorts of header, then four per key: name, location of its value (0 = here), count, value
    let find = |name: u64| {
        keys.chunks_exact(4).skip(1).find(|k| k[0] == name && k[1] == 0).map(|k| k[3]).filter(|v| *v != USER_DEFINED)
    };
    let model = find(key::MODEL_TYPE);
    let geographic = find(key::GEOGRAPHIC_TYPE);
    let projected = find(key::PROJECTED_TYPE);
    // a projection of the file's own lies on a geographic system, whose code is not that of its coordinates
    let is_own = model == Some(1) && projected.is_none() && geographic.is_some();
    if is_own {
        head.notes.push(
            "its projection has no EPSG code, so its place is not known; reproject it with `gdalwarp -t_srs`"
                .to_owned(),
        );
    }
    head.epsg =
        projected.or(geographic.filter(|_| !is_own)).and_then(|code| u32::try_from(code).ok()).filter(|code| *code > 0);
    let vertical = find(key::VERTICAL);
    let feet = VERTICAL_IN_FEET.iter().find(|(code, _)| Some(*code) == vertical).map(|(_, unit)| *unit);
    head.scaling = scaling(items, find(key::VERTICAL_UNITS).or(feet), &mut head.notes)?;
    if let Some(code) = vertical.filter(|code| *code > 0) {
        head.notes.push(format!(
            "heights refer to the vertical datum EPSG:{code}{}, and stay as they are",
            VERTICAL_NAMES
                .iter()
                .find(|(known, _)| *known == code)
                .map_or(String::new(), |(_, name)| format!(" ({name})"))
        ));
    }
    let Some([a, b, c, d, e, f]) = transform(directory)? else {
        if directory.has(tag::MODEL_TIEPOINT) {
            head.notes.push("the file is placed by ground control points, which are not read".to_owned());
        }
        return Ok(false);
    };
    let cell = [a.abs(), e.abs()];
    if ![a, b, c, d, e, f].iter().all(|number| number.is_finite()) {
        return Err(Problem::damaged("its cells have no size"));
    }
    // by more than a hundredth of a cell from one side to the other
    if a < 0.0 || b.abs() * head.rows as f64 > 0.01 * cell[0] || d.abs() * head.columns as f64 > 0.01 * cell[1] {
        return Err(Problem::Unsupported {
            what: "a raster that is rotated or mirrored".into(),
            remedy: "turn it to the north: `gdalwarp in.tif out.tif`",
        });
    }
    if cell.contains(&0.0) {
        return Err(Problem::damaged("its cells have no size"));
    }
    let mut origin = [c, f];
    if find(key::RASTER_TYPE) == Some(2) {
        // the given position is that of a cell's centre, not of its corner
        origin = [c - 0.5 * a, f - 0.5 * e];
    }
    if e > 0.0 {
        origin[1] += e * head.rows as f64;
    }
    head.origin = Some(origin);
    head.cell = Some(match model {
        Some(2) => Cell::Degrees(cell),
        None if geographic.is_some() => Cell::Degrees(cell),
        None if projected.is_none() && looks_geographic(origin, cell, head.columns, head.rows) => {
            head.notes.push(ASSUMED_DEGREES.to_owned());
            Cell::Degrees(cell)
        }
        _ => {
            let names = directory.text(tag::GEO_ASCII_PARAMS)?.unwrap_or_default();
            let metres = metres_per_unit(find(key::LINEAR_UNITS))?;
            let cell = cell.map(|side| side * metres);
            head.unit_m = metres;
            let has_unit = items.unit.is_some() || find(key::VERTICAL_UNITS).or(feet).is_some();
            if metres != 1.0 && !has_unit {
                head.notes.push(
                    "its coordinates are in feet, and its heights are taken as metres; if they are feet too, multiply them \
                     by 0.3048"
                        .to_owned(),
                );
            }
            projected_cell(cell, head.epsg, find(key::PROJECTION), &names)?
        }
    });
    Ok(e > 0.0)
}

/// Returns the size of a cell of a projected reference system: its code, its projection, and the names in the file.
fn projected_cell(cell: [f64; 2], epsg: Option<u32>, method: Option<u64>, names: &str) -> Result<Cell, Problem> {
    let names = names.to_ascii_lowercase();
    let is_named = ["web_mercator", "pseudo-mercator", "popular visualisation"].iter().any(|name| names.contains(name));
    if epsg.map_or(is_named, |code| WEB_MERCATOR.contains(&code)) {
        return Ok(Cell::Mercator(cell));
    }
    let is_cylindrical = epsg.is_some_and(|code| CYLINDRICAL.contains(&code));
    if is_cylindrical || method.is_some_and(|method| CYLINDRICAL_METHODS.contains(&method)) {
        return Err(Problem::Unsupported {
            what: "a map projection of the whole world, whose metres are not those on the ground,".into(),
            remedy: REPROJECT,
        });
    }
    Ok(Cell::Metres(cell))
}

/// Returns the conversion of samples to metres by scale, offset and unit. Returns None if they are metres.
fn scaling(items: &Items, key: Option<u64>, notes: &mut Vec<String>) -> Result<Option<Scaling>, Problem> {
    let metres = match items.unit.as_deref().map(str::to_ascii_lowercase).as_deref() {
        None => metres_per_unit(key)?,
        Some("m" | "metre" | "metres" | "meter" | "meters") => 1.0,
        Some("ft" | "foot" | "feet" | "international foot") => FOOT,
        Some("us-ft" | "ftus" | "ussurveyfoot" | "us survey foot" | "foot_us") => SURVEY_FOOT,
        Some(other) => {
            notes.push(format!(
                "the unit `{}` of its values is not known; they are taken as metres",
                other.escape_debug()
            ));
            1.0
        }
    };
    let scaling = Scaling { scale: metres * items.scale.unwrap_or(1.0), offset: metres * items.offset.unwrap_or(0.0) };
    Ok(Some(scaling).filter(|scaling| *scaling != Scaling { scale: 1.0, offset: 0.0 }))
}

/// Returns the map from (column, row) to (x, y): `x = a column + b row + c`, `y = d column + e row + f`. Returns None
/// if the tags have none.
fn transform(directory: &Directory<'_, '_>) -> Result<Option<[f64; 6]>, Problem> {
    if let [a, b, _, c, d, e, _, f, ..] = directory.reals(tag::MODEL_TRANSFORMATION)?[..] {
        return Ok(Some([a, b, c, d, e, f]));
    }
    let [sx, sy, ..] = directory.reals(tag::MODEL_PIXEL_SCALE)?[..] else { return Ok(None) };
    let (i, j, x, y) = match directory.reals(tag::MODEL_TIEPOINT)?[..] {
        [i, j, _, x, y, ..] => (i, j, x, y),
        _ => (0.0, 0.0, 0.0, 0.0),
    };
    Ok(Some([sx, 0.0, x - i * sx, 0.0, -sy, y + j * sy]))
}

/// Metres in an international foot and in a foot of the United States' survey.
const FOOT: f64 = 0.3048;
const SURVEY_FOOT: f64 = 1200.0 / 3937.0;
const REPROJECT: &str = "reproject it to metres: `gdalwarp -t_srs EPSG:32632 in.tif out.tif`, with the zone it lies in";

fn metres_per_unit(code: Option<u64>) -> Result<f64, Problem> {
    match code {
        None | Some(0 | 9001) => Ok(1.0),
        Some(9002) => Ok(FOOT),
        Some(9003) => Ok(SURVEY_FOOT),
        Some(9036) => Ok(1000.0),
        Some(other) => Err(Problem::Unsupported {
            what: format!("a reference system in units of EPSG code {other}"),
            remedy: REPROJECT,
        }),
    }
}
