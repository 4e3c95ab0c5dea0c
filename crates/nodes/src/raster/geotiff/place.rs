//! Where a window of a world lies, as the tags of a GeoTIFF say it.

use orograph_graph::Window;

use crate::raster::Projection;

/// The name of the local reference system.
const CITATION: &str = "Orograph world|";

/// Position, cell size and reference system.
pub(super) struct Place {
    /// Width and height of a cell.
    pub(super) scale: [f64; 3],
    /// The north-west corner of the raster, and its coordinates.
    pub(super) tiepoint: [f64; 6],
    /// The GeoKey directory.
    pub(super) keys: [u16; 20],
    /// Text of the keys. None where they need none.
    pub(super) citation: Option<&'static str>,
}

impl Place {
    /// Returns the place of a window. In a world without a place, the reference system is a local one in metres, x east
    /// and y north from the world's south-west corner, so that tiles of a world match.
    pub(super) fn of(window: &Window) -> Self {
        let d = window.cell_m();
        let (keys, citation, [west, north]) = match window.place() {
            Some(place) => {
                let is_geographic = Projection::of(place.epsg).is_ok_and(|system| system.is_geographic());
                (if is_geographic { geographic(place.epsg) } else { projected(place.epsg) }, None, place.corner_m)
            }
            None => {
                let [column, row] = window.origin.map(f64::from);
                (LOCAL, Some(CITATION), [column * d, (f64::from(window.world.cells[1]) - row) * d])
            }
        };
        Self { scale: [d, d, 0.0], tiepoint: [0.0, 0.0, 0.0, west, north, 0.0], keys, citation }
    }
}

/// Version 1.1.0 and four keys: a local system, cells are areas, its name in the text tag, metres.
#[rustfmt::skip]
const LOCAL: [u16; 20] = [
    1, 1, 0, 4,
    1024, 0, 1, 32_767,
    1025, 0, 1, 1,
    1026, 34_737, CITATION.len() as u16, 0,
    3076, 0, 1, 9001,
];

/// Version 1.1.0 and four keys: a system by its EPSG code, cells are areas, the unit. `model` is 1 for a projected
/// system in metres and 2 for longitude and latitude in degrees.
#[rustfmt::skip]
const fn system(epsg: u32, model: u16, code: u16, [key, unit]: [u16; 2]) -> [u16; 20] {
    [
        1, 1, 0, 4,
        1024, 0, 1, model,
        1025, 0, 1, 1,
        code, 0, 1, epsg as u16,
        key, 0, 1, unit,
    ]
}

/// The keys of a projected system, in metres.
const fn projected(epsg: u32) -> [u16; 20] {
    system(epsg, 1, 3072, [3076, 9001])
}

/// The keys of longitude and latitude, in degrees.
const fn geographic(epsg: u32) -> [u16; 20] {
    system(epsg, 2, 2048, [2054, 9102])
}
