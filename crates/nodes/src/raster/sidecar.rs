//! The JSON file with metadata that a raster format cannot store: `NAME.png.json` next to `NAME.png`.

use std::{
    ffi::OsString,
    io::{self, Read as _},
    path::{Path, PathBuf},
};

use orograph_graph::{Window, World, input};
use serde::{Deserialize, Serialize};

use super::{Cell, Head, Meta, Problem, RasterError, prj};

/// Description of a raster file. Written with every height file; read with PNG, OpenEXR and raw files. With files of other
/// formats only the sea level and the quantity are read.
///
/// When reading, everything is optional, unknown names are ignored, and `z_min` and `z_max` may replace `range`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Sidecar {
    /// Number of columns.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub columns: Option<u64>,
    /// Number of rows.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rows: Option<u64>,
    /// Side of a cell in metres, if cells are square.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cell_m: Option<f64>,
    /// Metres to the east and to the south from the north-west corner of the world to that of the area that the raster
    /// shows, if that is a part of the world.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub origin_m: Option<[f64; 2]>,
    /// The same offset in cells of the world.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub origin_cells: Option<[u32; 2]>,
    /// Cells of the whole world, if the raster shows a part of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub world_cells: Option<[u32; 2]>,
    /// EPSG code of the coordinate system, if the world has a place on Earth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub epsg: Option<u32>,
    /// Easting and northing of the north-west corner of that area in that system.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub corner_m: Option<[f64; 2]>,
    /// True if the values are those of vertices: the outermost ones stand on the sides of the area, so that cells around
    /// them begin half a cell beyond it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vertices: Option<bool>,
    /// Smallest and largest value, in `unit`; in a format of codes, the values of the lowest and the largest code.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub range: Option<[f64; 2]>,
    /// Symbol of the unit; empty for dimensionless numbers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Quantity of the values, such as `height` or `mask`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub quantity: Option<String>,
    /// In a format of codes, the size of one step, in `unit`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step: Option<f64>,
    /// True if the codes are dithered.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dither: Option<bool>,
    /// Import settings for another program, by the names used there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub import: Option<serde_json::Map<String, serde_json::Value>>,
    /// The world's seed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seed: Option<u32>,
    /// Sea level of the world in metres, if it has a sea.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sea_level_m: Option<f64>,
    /// Finer cells along the side of each cell whose values it holds, if there were several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub supersample: Option<u32>,
    /// Hash of the graph that built the raster.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub graph_hash: Option<String>,
    /// Name and version of the program that wrote the file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub program: Option<String>,
}

/// Name of the sidecar of a file: the file's name with `.json` after it; of an ASCII grid, `NAME.prj` with its
/// coordinate system.
#[must_use]
pub fn sidecar_path(path: &Path) -> PathBuf {
    if prj::is_grid(path) {
        return path.with_extension("prj");
    }
    let mut name = OsString::from(path);
    name.push(".json");
    PathBuf::from(name)
}

/// Maximum size of a sidecar, which is a few lines; larger files are something else.
const MOST_BYTES: u64 = 1 << 20;

/// A small file beside a raster.
pub(super) struct Beside {
    pub(super) path: PathBuf,
    pub(super) text: Vec<u8>,
}

impl Beside {
    /// Reads the [sidecar](sidecar_path) of a raster. Returns None if there is none.
    ///
    /// # Errors
    /// [`Problem::Sidecar`] if it cannot be read or has more than `most` bytes.
    pub(super) fn of(raster: &Path, most: u64) -> Result<Option<Self>, RasterError> {
        let path = sidecar_path(raster);
        let wrong = |what: String| Problem::Sidecar { path: path.clone(), what }.of(raster);
        let file = match input::open(&path) {
            Ok((file, meta)) if meta.len() <= most => file,
            Ok(_) => return Err(wrong(format!("it has more than {}", orograph_graph::bytes(most)))),
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(wrong(error.to_string())),
        };
        let mut text = Vec::new();
        file.take(most).read_to_end(&mut text).map_err(|error| wrong(error.to_string()))?;
        Ok(Some(Self { path, text }))
    }
}

#[derive(Deserialize)]
struct Other {
    z_min: Option<f64>,
    z_max: Option<f64>,
}

impl Sidecar {
    /// Returns the metadata common to all rasters of a window.
    #[must_use]
    pub fn of(window: &Window, meta: &Meta) -> Self {
        let [columns, rows] = window.cells;
        let shown = meta.shows.as_ref().unwrap_or(window);
        let part = (!shown.is_whole()).then_some(shown);
        let sides = [0, 1].map(|axis| window.world.size[axis] / f64::from(window.world.cells[axis]));
        let beyond = |axis: usize| {
            f64::from(window.cells[axis]) * sides[axis] > f64::from(shown.cells[axis]) * shown.cell_m() * (1.0 + 1e-9)
        };
        let has_vertices = beyond(0) && beyond(1);
        Self {
            columns: Some(u64::from(columns)),
            rows: Some(u64::from(rows)),
            cell_m: ((sides[1] / sides[0] - 1.0).abs() < 1e-9).then_some(sides[0]),
            origin_m: part.map(|part| part.origin.map(|cells| f64::from(cells) * part.cell_m())),
            origin_cells: part.map(|part| part.origin),
            world_cells: part.map(|part| part.world.cells),
            epsg: shown.place().map(|place| place.epsg),
            corner_m: shown.place().map(|place| place.corner_m),
            vertices: has_vertices.then_some(true),
            unit: Some(meta.unit.clone()),
            quantity: Some(meta.quantity.clone()),
            import: meta.import.clone(),
            seed: Some(window.world.seed),
            sea_level_m: window.world.sea_level,
            supersample: meta.supersample,
            graph_hash: meta.graph_hash.clone(),
            program: Some(concat!("orograph ", env!("CARGO_PKG_VERSION")).to_owned()),
            ..Self::default()
        }
    }

    /// Returns the sidecar of a file. Returns None if there is none.
    ///
    /// # Errors
    /// [`Problem::Sidecar`] if it is invalid.
    pub(super) fn beside(path: &Path) -> Result<Option<Self>, RasterError> {
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
        if !["png", "exr", "r16", "raw", "r32"].contains(&extension.as_str()) {
            return Ok(None);
        }
        let Some(Beside { path: beside, text }) = Beside::of(path, MOST_BYTES)? else { return Ok(None) };
        Self::parse(&text).map(Some).map_err(|what| Problem::Sidecar { path: beside, what }.of(path))
    }

    /// Returns the sidecar of a file of any format. Returns None if there is none that can be read.
    fn beside_any(path: &Path) -> Option<Self> {
        let beside = (!prj::is_grid(path)).then(|| Beside::of(path, MOST_BYTES)).and_then(Result::ok).flatten();
        beside.and_then(|beside| Self::parse(&beside.text).ok())
    }

    fn parse(text: &[u8]) -> Result<Self, String> {
        let mut sidecar: Self = serde_json::from_slice(text).map_err(|error| error.to_string())?;
        let other: Other = serde_json::from_slice(text).map_err(|error| error.to_string())?;
        sidecar.range = sidecar.range.or(other.z_min.zip(other.z_max).map(|(lo, hi)| [lo, hi]));
        if let Some([lo, hi]) = sidecar.range
            && !(lo.is_finite() && hi.is_finite() && lo <= hi)
        {
            return Err(format!("its range from {lo} to {hi} does not rise"));
        }
        if let Some(cell) = sidecar.cell_m
            && !(cell.is_finite() && cell > 0.0)
        {
            return Err(format!("a cell of {cell} m has no extent"));
        }
        if sidecar.corner_m.is_some_and(|corner| !corner.iter().all(|metres| metres.is_finite())) {
            return Err("its corner is not finite".to_owned());
        }
        let [lowest, highest] = World::SEA_LEVELS;
        if let Some(level) = sidecar.sea_level_m
            && !(lowest..=highest).contains(&level)
        {
            return Err(format!("a sea at {level} m is not within {lowest} to {highest} m"));
        }
        Ok(sidecar)
    }

    /// Sets the cell size and the place of a raster, as far as they are known.
    pub(super) fn locate(&self, head: &mut Head) {
        head.cell = self.cell_m.map(|d| Cell::Metres([d, d]));
        (head.origin, head.epsg) = (self.cell_corner_m(), self.epsg);
    }

    /// The north-west corner of the first cell, which for vertices is half a cell beyond the area.
    fn cell_corner_m(&self) -> Option<[f64; 2]> {
        let beyond_m = if self.vertices == Some(true) { 0.5 * self.cell_m? } else { 0.0 };
        self.corner_m.map(|[east, north]| [east - beyond_m, north + beyond_m])
    }
}

/// Returns the sea level in the sidecar of a file. Returns None if there is none. A file that states its own cell size,
/// such as TIFF, may have an unreadable `.json` of another program beside it: that counts as none.
///
/// # Errors
/// [`Problem::Sidecar`] if the sidecar is needed to read the file and is invalid.
pub fn sea_level(path: &Path) -> Result<Option<f64>, RasterError> {
    let sidecar = Sidecar::beside(path)?.or_else(|| Sidecar::beside_any(path));
    Ok(sidecar.and_then(|sidecar| sidecar.sea_level_m))
}

/// Returns what a file holds if its sidecar says that it does not hold heights, such as `scalar in m²`.
#[must_use]
pub fn other_quantity(path: &Path) -> Option<String> {
    // an unusable sidecar is reported by the reader
    let Sidecar { quantity, unit, .. } = Sidecar::beside_any(path)?;
    let quantity = quantity.filter(|quantity| quantity != "height")?;
    Some(match unit.filter(|unit| !unit.is_empty()) {
        Some(unit) => format!("`{quantity}` in {unit}"),
        None => format!("`{quantity}`"),
    })
}

#[cfg(test)]
mod tests {
    use orograph_graph::GeoPlace;

    use super::*;

    #[test]
    fn both_forms_are_read() {
        let own = Sidecar {
            columns: Some(3),
            rows: Some(2),
            cell_m: Some(12.5),
            range: Some([-1.0, 4.0]),
            seed: Some(7),
            sea_level_m: Some(-2.5),
            ..Sidecar::default()
        };
        let text = serde_json::to_vec(&own).unwrap();
        assert_eq!(Sidecar::parse(&text).expect("a sidecar"), own);
        let other = Sidecar::parse(br#"{"z_min": -1.2, "z_max": 1344.9, "formula": "z"}"#).unwrap();
        assert_eq!(other.range, Some([-1.2, 1344.9]));
    }

    /// The outermost vertices stand on the sides of the area, so that cells around them begin half a cell further out.
    #[test]
    fn cells_around_vertices_go_beyond_the_area() {
        let place = Some(GeoPlace { epsg: 32611, corner_m: [4e5, 4e6] });
        let world = World { size: [1000.0; 2], cells: [100; 2], place, ..World::default() };
        let area = Window { origin: [20, 40], cells: [40, 60], ..Window::whole(world) };
        // rasters that show the area, of so many columns and rows with these sides
        let shown = |cells: [u32; 2], sides: [f64; 2]| {
            let size = [0, 1].map(|axis| f64::from(cells[axis]) * sides[axis]);
            let meta = Meta { shows: Some(area), ..Meta::default() };
            let own = Sidecar::of(&Window::whole(World { size, cells, ..world }), &meta);
            assert_eq!((own.corner_m, own.origin_m), (Some([400_200.0, 3_999_600.0]), Some([200.0, 400.0])));
            (own.vertices, own.cell_m, own.cell_corner_m())
        };
        assert_eq!(shown([40, 60], [10.0; 2]), (None, Some(10.0), Some([400_200.0, 3_999_600.0])));
        assert_eq!(shown([20, 30], [20.0; 2]), (None, Some(20.0), Some([400_200.0, 3_999_600.0])));
        assert_eq!(shown([5, 7], [100.0; 2]), (Some(true), Some(100.0), Some([400_150.0, 3_999_650.0])));
        assert_eq!(shown([5, 4], [100.0, 200.0]), (Some(true), None, None));
    }

    #[test]
    fn nonsense_is_refused() {
        for text in [
            r#"{"range": [5, 1]}"#,
            r#"{"cell_m": 0}"#,
            r#"{"sea_level_m": 13000}"#,
            r#"{"cell_m": -3}"#,
            "[1",
            r#"{"columns": -1}"#,
        ] {
            assert!(Sidecar::parse(text.as_bytes()).is_err(), "{text}");
        }
        assert_eq!(sidecar_path(Path::new("a/b.png")), Path::new("a/b.png.json"));
    }
}
