//! Position and cell size of a GeoTIFF.

use super::directory::{Directory, tag};
use crate::raster::{Cell, Head, Problem, looks_geographic};

/// The keys of the GeoKey directory that are read.
mod key {
    pub const MODEL_TYPE: u64 = 1024;
    pub const RASTER_TYPE: u64 = 1025;
    pub const GEOGRAPHIC_TYPE: u64 = 2048;
    pub const PROJECTED_TYPE: u64 = 3072;
    pub const LINEAR_UNITS: u64 = 3076;
}

/// Code for "given by other keys".
const USER_DEFINED: u64 = 32_767;

/// Reads cell size, north-west corner and reference system from the tags. Returns true if the first row is the
/// southernmost; the rotation of a raster that is not aligned with the axes is ignored.
pub(super) fn read(directory: &Directory<'_, '_>, head: &mut Head) -> Result<bool, Problem> {
    let keys = directory.numbers(tag::GEO_KEY_DIRECTORY)?;
    // four shorts of header, then four per key: name, location of its value (0 = here), count, value
    let find = |name: u64| {
        keys.chunks_exact(4).skip(1).find(|k| k[0] == name && k[1] == 0).map(|k| k[3]).filter(|v| *v != USER_DEFINED)
    };
    let model = find(key::MODEL_TYPE);
    let geographic = find(key::GEOGRAPHIC_TYPE);
    let projected = find(key::PROJECTED_TYPE);
    head.epsg = projected.or(geographic).and_then(|code| u32::try_from(code).ok()).filter(|code| *code > 0);
    let Some(transform) = transform(directory)? else { return Ok(false) };
    let [a, b, c, d, e, f] = transform;
    let cell = [(a * a + d * d).sqrt(), (b * b + e * e).sqrt()];
    if !(cell.iter().all(|side| side.is_finite() && *side > 0.0) && c.is_finite() && f.is_finite()) {
        return Err(Problem::damaged("its cells have no size"));
    }
    let mut origin = [c, f];
    if find(key::RASTER_TYPE) == Some(2) {
        // the given position is that of a cell's centre, not of its corner
        origin = [c - 0.5 * (a + b), f - 0.5 * (d + e)];
    }
    if e > 0.0 {
        let rows = head.rows as f64;
        origin = [origin[0] + b * rows, origin[1] + e * rows];
    }
    let in_degrees = match model {
        Some(2) => true,
        Some(_) => false,
        None => geographic.is_some() || looks_geographic(origin, cell, head.columns, head.rows),
    };
    head.origin = Some(origin);
    head.cell = Some(if in_degrees {
        Cell::Degrees(cell)
    } else {
        let metres = metres_per_unit(find(key::LINEAR_UNITS))?;
        Cell::Metres(cell.map(|side| side * metres))
    });
    Ok(e > 0.0)
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

fn metres_per_unit(code: Option<u64>) -> Result<f64, Problem> {
    match code {
        None | Some(0 | 9001) => Ok(1.0),
        Some(9002) => Ok(0.3048),
        Some(9003) => Ok(1200.0 / 3937.0),
        Some(9036) => Ok(1000.0),
        Some(other) => Err(Problem::Unsupported {
            what: format!("a reference system in units of EPSG code {other}"),
            remedy: "reproject it to metres: `gdalwarp -t_srs EPSG:32632 in.tif out.tif`, with the zone it lies in",
        }),
    }
}
