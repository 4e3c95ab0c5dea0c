//! The metadata of a cube: `zarr.json` of the group and of each array.
//!
//! Sources: Zarr core specification 3.1 (2024); CF conventions 1.11 (2023); consolidated metadata as zarr-python writes
//! it.

use std::collections::BTreeMap;

use orograph_graph::{PortType, Window};
use orograph_nodes::raster::well_known_text;
use serde_json::{Map, Value, json};

/// An array of the group: its shape, its chunks and what its numbers are.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Shape {
    /// The names and the lengths of its dimensions.
    pub(super) dimensions: Vec<(String, usize)>,
    /// The lengths of its chunks.
    pub(super) chunks: Vec<usize>,
    /// Type of its numbers in the notation of Zarr.
    pub(super) numbers: &'static str,
    pub(super) attributes: Map<String, Value>,
}

impl Shape {
    /// One chunk of double-precision numbers along a dimension of its name.
    pub(super) fn coordinate(name: &str, count: usize, attributes: Map<String, Value>) -> Self {
        Self { dimensions: vec![(name.to_owned(), count)], chunks: vec![count], numbers: "float64", attributes }
    }

    pub(super) fn json(&self) -> Value {
        let fill = if self.numbers == "int32" { json!(0) } else { json!("NaN") };
        json!({
            "zarr_format": 3,
            "node_type": "array",
            "shape": self.dimensions.iter().map(|(_, count)| *count).collect::<Vec<_>>(),
            "data_type": self.numbers,
            "chunk_grid": { "name": "regular", "configuration": { "chunk_shape": self.chunks } },
            "chunk_key_encoding": { "name": "default", "configuration": { "separator": "." } },
            "fill_value": fill,
            "codecs": [{ "name": "bytes", "configuration": { "endian": "little" } }],
            "attributes": self.attributes,
            "dimension_names": self.dimensions.iter().map(|(name, _)| name).collect::<Vec<_>>(),
        })
    }
}

/// The metadata of the group with that of all arrays, so that a reader needs this file only.
pub(super) fn group(attributes: &Map<String, Value>, arrays: &BTreeMap<String, Shape>) -> Value {
    let all: Map<String, Value> = arrays.iter().map(|(name, shape)| (name.clone(), shape.json())).collect();
    json!({
        "zarr_format": 3,
        "node_type": "group",
        "attributes": attributes,
        "consolidated_metadata": { "kind": "inline", "must_understand": false, "metadata": all },
    })
}

/// The name of the array that describes the coordinate system.
pub(super) const SYSTEM: &str = "spatial_ref";

/// The coordinate system of a world with a place, as a CF grid mapping. Readers take it from well-known text, or from
/// its EPSG code where no text is known.
pub(super) fn system(window: &Window) -> Option<Shape> {
    let place = window.place()?;
    let (d, [x, y]) = (window.cell_m(), place.corner_m);
    let mut attributes = Map::new();
    let text = well_known_text(place.epsg).map_or_else(|| format!("EPSG:{}", place.epsg), str::to_owned);
    attributes.insert(SYSTEM.to_owned(), json!(text));
    attributes.insert("GeoTransform".to_owned(), json!(format!("{x} {d} 0 {y} 0 -{d}")));
    Some(Shape { dimensions: Vec::new(), chunks: Vec::new(), numbers: "int32", attributes })
}

/// The centres of the cells of a window along x and y, and what they are: metres of the world's coordinate system, or
/// from its south-west corner.
pub(super) fn centres(window: &Window) -> [(&'static str, Vec<f64>, Map<String, Value>); 2] {
    let d = window.cell_m();
    let [west, north] = match window.place() {
        Some(place) => place.corner_m,
        None => {
            let [column, row] = window.origin.map(f64::from);
            [column * d, (f64::from(window.world.cells[1]) - row) * d]
        }
    };
    let attributes = |axis: &str, side: &str| {
        let mut all = Map::new();
        all.insert("axis".to_owned(), json!(axis.to_uppercase()));
        all.insert("units".to_owned(), json!("m"));
        let (name, text) = match window.place() {
            Some(_) => ("standard_name", format!("projection_{axis}_coordinate")),
            None => ("long_name", format!("distance from the {side} side of the world")),
        };
        all.insert(name.to_owned(), json!(text));
        all
    };
    let x = (0..window.nx()).map(|i| west + (i as f64 + 0.5) * d).collect();
    let y = (0..window.ny()).map(|j| north - (j as f64 + 0.5) * d).collect();
    [("y", y, attributes("y", "south")), ("x", x, attributes("x", "west"))]
}

/// What the numbers of an output are.
pub(super) fn of_output(name: &str, ty: PortType, window: &Window) -> Map<String, Value> {
    let mut all = Map::new();
    all.insert("long_name".to_owned(), json!(name));
    if ty == PortType::Height {
        all.insert("standard_name".to_owned(), json!("surface_altitude"));
    }
    let unit = ty.unit().symbol();
    all.insert("units".to_owned(), json!(if unit.is_empty() { "1" } else { unit }));
    if window.place().is_some() {
        all.insert("grid_mapping".to_owned(), json!(SYSTEM));
    }
    all
}
