//! Lines as GeoJSON (RFC 7946), which geographic information systems read: line strings, or polygons if they are the
//! rings of areas.
//!
//! In a world with a place, coordinates are longitude and latitude in degrees of WGS84, as the RFC wants it, or, as
//! [`LinesIn::Metres`], eastings and northings of its coordinate system, which the member `crs` names; RFC 7946 has
//! dropped it, but geographic information systems read it. In any other world they are metres: east of its west side,
//! north of its south side, and elevation, as in the GeoTIFFs of rasters. Lengths are rounded to millimetres, degrees
//! to 1e-8, which is a millimetre, areas to square metres.

use std::io::{self, Write};

use clap::ValueEnum;
use orograph_graph::{Area, GeoPlace, Line, Lines, Vertex, World};
use orograph_nodes::raster::Projection;
use serde::Serialize;

use crate::report::failure::Failure;

/// The coordinates of lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum LinesIn {
    /// Metres of the world, or of its coordinate system
    Metres,
    /// Longitude and latitude in degrees of WGS84, for worlds with a `place`
    Wgs84,
}

/// Converts positions in a world to the coordinates of its lines.
pub struct Coordinates {
    world: World,
    /// To degrees; None if the coordinates are metres.
    degrees: Option<Degrees>,
}

/// Conversion to degrees.
struct Degrees {
    system: Projection,
    /// Longitude of the middle of the world; lines across the antimeridian stay within half a turn of it.
    middle: f64,
}

impl Coordinates {
    /// The coordinates of the lines of a world. Without a choice they are degrees where they can be.
    ///
    /// # Errors
    /// When degrees are requested, but the world has no place, or its coordinate system is not known.
    pub fn new(choice: Option<LinesIn>, world: &World) -> Result<Self, Failure> {
        let metres = || Self { world: *world, degrees: None };
        let refused = |what: String, hint: &str| match choice {
            Some(LinesIn::Wgs84) => Err(Failure::wrong(format!("`--lines wgs84`: {what}")).hint(hint)),
            _ => Ok(metres()),
        };
        if choice == Some(LinesIn::Metres) {
            return Ok(metres());
        }
        let Some(place) = world.place else {
            return refused("the world has no place on Earth".to_owned(), "add `place` to `world`");
        };
        let system = match Projection::of(place.epsg) {
            Ok(system) => system,
            Err(error) => return refused(error.to_string(), "write metres: `--lines metres`"),
        };
        let of = |[x, y]: [f64; 2]| {
            let [width, height] = world.size;
            system.degrees([place.corner_m[0] + x * width, place.corner_m[1] - y * height])
        };
        let corners = [[0.5, 0.5], [0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(of);
        let Some([middle, _]) = corners[0].filter(|_| corners.iter().all(Option::is_some)) else {
            let what = format!("the world lies outside of the domain of EPSG:{}", place.epsg);
            return refused(what, "write metres: `--lines metres`");
        };
        Ok(Self { world: *world, degrees: Some(Degrees { system, middle }) })
    }

    /// East and north of a position in the world: in its coordinate system, or from its south-west corner.
    fn metres(&self, [east, south]: [f64; 2]) -> [f64; 2] {
        let [x, y] = self.world.place.map_or([0.0, self.world.size[1]], |place| place.corner_m);
        [x + east, y - south]
    }

    /// The first two coordinates of a position in the world.
    fn of(&self, position_m: [f64; 2]) -> [f64; 2] {
        let metres = self.metres(position_m);
        let degrees = self.degrees.as_ref().and_then(|degrees| {
            let [longitude, latitude] = degrees.system.degrees(metres)?;
            let turns = ((longitude - degrees.middle) / 360.0).round();
            Some([longitude - 360.0 * turns, latitude].map(|degrees| (degrees * 1e8).round() / 1e8))
        });
        degrees.unwrap_or_else(|| metres.map(millimetres))
    }

    /// The coordinate system, unless it is that of the RFC or none on Earth.
    fn system(&self) -> Option<System> {
        self.world.place.filter(|_| self.degrees.is_none()).map(System::of)
    }
}

#[derive(Serialize)]
struct Collection<F> {
    r#type: &'static str,
    /// The coordinate system, if it is one on Earth in metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    crs: Option<System>,
    /// Extent of the world in metres, a foreign member.
    world_size_m: [f64; 2],
    features: F,
}

/// A coordinate system by its name.
#[derive(Serialize)]
struct System {
    r#type: &'static str,
    properties: SystemName,
}

#[derive(Serialize)]
struct SystemName {
    name: String,
}

impl System {
    fn of(place: GeoPlace) -> Self {
        Self { r#type: "name", properties: SystemName { name: format!("urn:ogc:def:crs:EPSG::{}", place.epsg) } }
    }
}

#[derive(Serialize)]
struct Feature<C, P> {
    r#type: &'static str,
    id: usize,
    geometry: Geometry<C>,
    properties: P,
}

#[derive(Serialize)]
struct Geometry<C> {
    r#type: &'static str,
    coordinates: C,
}

/// Easting and northing, and the elevation if the line has one.
#[derive(Serialize)]
#[serde(untagged)]
enum Coordinate {
    High([f64; 3]),
    Flat([f64; 2]),
}

type Ring = Vec<[f64; 3]>;

/// The coordinates of an area.
#[derive(Serialize)]
#[serde(untagged)]
enum Parts {
    One(Vec<Ring>),
    Several(Vec<Vec<Ring>>),
}

#[derive(Serialize)]
struct AreaProperties {
    level_m: f64,
    /// The largest depth.
    depth_m: f64,
    area_m2: f64,
    volume_m3: f64,
    /// In metres, also if the geometry is in degrees.
    spill_m: [f64; 2],
}

#[derive(Serialize)]
struct Properties {
    order: u32,
    /// The `id` of the downstream line, which begins where this one ends.
    downstream: Option<u32>,
    /// Measured on the map.
    length_m: f64,
    /// At the lower end.
    width_m: f64,
    depth_m: f64,
    area_m2: f64,
    /// At each vertex.
    widths_m: Vec<f64>,
    depths_m: Vec<f64>,
    areas_m2: Vec<f64>,
}

/// Writes lines of a world as a collection of features in their order.
///
/// # Errors
/// When `to` cannot be written to.
pub fn write(to: &mut dyn Write, lines: &Lines, on: &Coordinates) -> io::Result<()> {
    let (r#type, world_size_m) = ("FeatureCollection", on.world.size);
    let crs = on.system();
    if lines.areas.is_empty() {
        let of_line = |(id, line)| feature(id, line, lines.draped, on);
        let features: Vec<_> = lines.lines.iter().enumerate().map(of_line).collect();
        serde_json::to_writer(&mut *to, &Collection { r#type, crs, world_size_m, features })?;
    } else {
        let areas = lines.rings().enumerate();
        let features: Vec<_> = areas.map(|(id, (area, rings))| area_feature(id, area, rings, on)).collect();
        serde_json::to_writer(&mut *to, &Collection { r#type, crs, world_size_m, features })?;
    }
    to.write_all(b"\n")
}

fn coordinates(line: &Line, on: &Coordinates) -> Vec<[f64; 3]> {
    let coordinate = |vertex: &Vertex| {
        let [x, y] = on.of(vertex.position_m);
        [x, y, millimetres(vertex.elevation_m)]
    };
    line.vertices.iter().map(coordinate).collect()
}

/// A polygon, or several if the area has more than one outer ring; those run counter-clockwise.
fn area_feature(id: usize, area: &Area, rings: &[Line], on: &Coordinates) -> Feature<Parts, AreaProperties> {
    let mut parts: Vec<Vec<Ring>> = Vec::new();
    for line in rings {
        let ring = coordinates(line, on);
        let doubled: f64 = ring.windows(2).map(|pair| pair[0][0] * pair[1][1] - pair[1][0] * pair[0][1]).sum();
        match parts.last_mut().filter(|_| doubled < 0.0) {
            Some(part) => part.push(ring),
            None => parts.push(vec![ring]),
        }
    }
    let geometry = if parts.len() == 1 {
        Geometry { r#type: "Polygon", coordinates: Parts::One(parts.remove(0)) }
    } else {
        Geometry { r#type: "MultiPolygon", coordinates: Parts::Several(parts) }
    };
    let properties = AreaProperties {
        level_m: millimetres(area.level_m),
        depth_m: millimetres(area.depth_m),
        area_m2: area.area_m2.round(),
        volume_m3: area.volume_m3.round(),
        spill_m: on.metres(area.spill_m).map(millimetres),
    };
    Feature { r#type: "Feature", id, geometry, properties }
}

fn feature(id: usize, line: &Line, draped: bool, on: &Coordinates) -> Feature<Vec<Coordinate>, Properties> {
    let vertices = line.vertices.as_slice();
    let all = |number: fn(&Vertex) -> f64| vertices.iter().map(number).map(millimetres).collect::<Vec<_>>();
    let step = |pair: &[Vertex]| {
        let [x, y] = [0, 1].map(|axis| pair[1].position_m[axis] - pair[0].position_m[axis]);
        (x * x + y * y).sqrt()
    };
    let lowest = vertices.last().copied().unwrap_or_default();
    Feature {
        r#type: "Feature",
        id,
        geometry: Geometry {
            r#type: "LineString",
            coordinates: coordinates(line, on)
                .into_iter()
                .map(|[x, y, z]| if draped { Coordinate::Flat([x, y]) } else { Coordinate::High([x, y, z]) })
                .collect(),
        },
        properties: Properties {
            order: line.order,
            downstream: line.downstream,
            length_m: millimetres(vertices.windows(2).map(step).sum()),
            width_m: millimetres(lowest.width_m),
            depth_m: millimetres(lowest.depth_m),
            area_m2: lowest.area_m2.round(),
            widths_m: all(|vertex| vertex.width_m),
            depths_m: all(|vertex| vertex.depth_m),
            areas_m2: vertices.iter().map(|vertex| vertex.area_m2.round()).collect(),
        },
    }
}

fn millimetres(metres: f64) -> f64 {
    (metres * 1000.0).round() / 1000.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn metres(world: World) -> Coordinates {
        Coordinates::new(Some(LinesIn::Metres), &world).expect("metres")
    }

    /// Positions by PROJ 9.5.1, and a line across the antimeridian.
    #[test]
    fn coordinates_are_degrees_in_a_world_with_a_place() {
        let vertex = |x: f64, south: f64| Vertex { position_m: [x, south], elevation_m: 7.0, ..Vertex::default() };
        let line = Line { order: 1, downstream: None, vertices: vec![vertex(0.0, 0.0), vertex(20_000.0, 10_000.0)] };
        let world = |epsg, corner_m| World {
            size: [20_000.0, 10_000.0],
            cells: [20, 10],
            place: Some(GeoPlace { epsg, corner_m }),
            ..World::default()
        };
        let written = |choice, world: &World| {
            let mut text = Vec::new();
            let on = Coordinates::new(choice, world).expect("coordinates");
            write(&mut text, &Lines::open(vec![line.clone()]), &on).expect("memory");
            serde_json::from_slice::<serde_json::Value>(&text).expect("JSON")
        };
        for (choice, world, expected) in [
            (None, world(32_632, [522_765.076_043, 5_216_320.503_846]), [9.3, 47.1]),
            (Some(LinesIn::Wgs84), world(32_719, [388_024.297_25, 6_336_986.537_844]), [-70.2, -33.1]),
        ] {
            let json = written(choice, &world);
            assert!(json["crs"].is_null(), "RFC 7946 has none");
            let first = &json["features"][0]["geometry"]["coordinates"][0];
            for axis in 0..2 {
                let found = first[axis].as_f64().expect("a number");
                assert!((found - expected[axis]).abs() < 2e-8, "{first}");
            }
            assert_eq!(first[2], 7.0);
        }
        // from 179.9 degrees on, through 180
        let json = written(None, &world(32_601, [290_000.0, 7_220_000.0]));
        let ends = [0, 1].map(|at| json["features"][0]["geometry"]["coordinates"][at][0].as_f64().expect("a number"));
        assert!((ends[1] - ends[0]).abs() < 1.0, "{ends:?}");
        // a datum by a grid of shifts
        let nad27 = world(26_711, [400_000.0, 3_800_000.0]);
        assert_eq!(written(None, &nad27)["crs"]["properties"]["name"], "urn:ogc:def:crs:EPSG::26711");
        let refused = |world: &World| Coordinates::new(Some(LinesIn::Wgs84), world).err().expect("refused").to_string();
        assert!(refused(&nad27).contains("grid of shifts"));
        assert!(refused(&World::default()).contains("no place on Earth"));
    }

    #[test]
    fn lines_become_features_with_north_up() {
        let vertex = |x: f64, south: f64, z: f64| Vertex {
            position_m: [x, south],
            elevation_m: z,
            width_m: 2.000_04,
            depth_m: 0.5,
            area_m2: 1e6,
        };
        let line =
            |downstream| Line { order: 2, downstream, vertices: vec![vertex(0.0, 0.0, 9.0), vertex(3.0, 4.0, 8.5)] };
        let lines = Lines::open(vec![line(Some(1)), line(None)]);
        let world = World { size: [100.0, 50.0], cells: [20, 10], ..World::default() };
        let mut text = Vec::new();
        write(&mut text, &lines, &metres(world)).expect("memory");
        let json: serde_json::Value = serde_json::from_slice(&text).expect("JSON");
        assert_eq!((json["type"].as_str(), &json["world_size_m"][0]), (Some("FeatureCollection"), &100.0.into()));
        let first = &json["features"][0];
        assert_eq!(first["geometry"]["type"], "LineString");
        assert_eq!(first["geometry"]["coordinates"], serde_json::json!([[0.0, 50.0, 9.0], [3.0, 46.0, 8.5]]));
        let properties = &first["properties"];
        assert_eq!((&properties["downstream"], &properties["length_m"]), (&1.into(), &5.0.into()));
        assert_eq!((&properties["widths_m"][0], &properties["order"]), (&2.0.into(), &2.into()));
        assert!(json["features"][1]["properties"]["downstream"].is_null());
        assert!(json["crs"].is_null());
        // draped lines have no elevations
        let mut text = Vec::new();
        write(&mut text, &Lines { draped: true, ..lines.clone() }, &metres(world)).expect("memory");
        let json: serde_json::Value = serde_json::from_slice(&text).expect("JSON");
        assert_eq!(json["features"][0]["geometry"]["coordinates"], serde_json::json!([[0.0, 50.0], [3.0, 46.0]]));
        // eastings and northings in a world with a place
        let place = Some(GeoPlace { epsg: 32_611, corner_m: [378_000.0, 3_812_000.0] });
        let mut text = Vec::new();
        write(&mut text, &lines, &metres(World { place, ..world })).expect("memory");
        let json: serde_json::Value = serde_json::from_slice(&text).expect("JSON");
        assert_eq!(json["crs"]["properties"]["name"], "urn:ogc:def:crs:EPSG::32611");
        let coordinates = &json["features"][0]["geometry"]["coordinates"];
        assert_eq!(*coordinates, serde_json::json!([[378_000.0, 3_812_000.0, 9.0], [378_003.0, 3_811_996.0, 8.5]]));
    }

    #[test]
    fn areas_become_polygons_with_holes() {
        let ring = |corners: &[[f64; 2]]| {
            let vertex = |&position_m: &[f64; 2]| Vertex { position_m, elevation_m: 5.0, ..Vertex::default() };
            Line { order: 1, downstream: None, vertices: corners.iter().chain(corners.first()).map(vertex).collect() }
        };
        let outer = ring(&[[10.0, 10.0], [10.0, 40.0], [40.0, 40.0], [40.0, 10.0]]);
        let hole = ring(&[[20.0, 20.0], [30.0, 20.0], [30.0, 30.0], [20.0, 30.0]]);
        let part = ring(&[[40.0, 40.0], [40.0, 45.0], [60.0, 45.0], [60.0, 40.0]]);
        let area = |rings| Area {
            rings,
            level_m: 5.0,
            depth_m: 2.5,
            area_m2: 800.0,
            volume_m3: 1234.4,
            spill_m: [45.0, 15.0],
        };
        let lines = Lines { areas: vec![area(3), area(1)], ..Lines::open(vec![outer.clone(), hole, part, outer]) };
        let world = World { size: [100.0, 50.0], cells: [20, 10], ..World::default() };
        let mut text = Vec::new();
        write(&mut text, &lines, &metres(world)).expect("memory");
        let json: serde_json::Value = serde_json::from_slice(&text).expect("JSON");
        let [first, second] = [0, 1].map(|at| &json["features"][at]);
        assert_eq!(
            (&first["geometry"]["type"], &second["geometry"]["type"]),
            (&"MultiPolygon".into(), &"Polygon".into())
        );
        let parts = first["geometry"]["coordinates"].as_array().expect("parts");
        let rings: Vec<usize> = parts.iter().map(|part| part.as_array().expect("rings").len()).collect();
        assert_eq!(rings, [2, 1]);
        assert_eq!(parts[0][0][0], serde_json::json!([10.0, 40.0, 5.0]), "north up");
        let expected = serde_json::json!(
            {"level_m": 5.0, "depth_m": 2.5, "area_m2": 800.0, "volume_m3": 1234.0, "spill_m": [45.0, 35.0]});
        assert_eq!((&first["properties"], json["features"].as_array().map(Vec::len)), (&expected, Some(2)));
    }
}
