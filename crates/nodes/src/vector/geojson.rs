//! GeoJSON (RFC 7946) in degrees, for worlds with a place, or in metres: of the world, east of its west side and north of
//! its south side, or in the coordinate system of the world's place.

use orograph_graph::{Waypoint, World};
use serde_json::Value;

use super::{Drawing, Polyline, VectorError, polyline};
use crate::raster::Projection;

/// Reads the lines and the outlines of polygons of a file.
pub(super) fn read(bytes: &[u8], world: &World) -> Result<Drawing, VectorError> {
    let json: Value =
        serde_json::from_slice(bytes).map_err(|error| VectorError::damaged(format!("it is not JSON: {error}")))?;
    let corner = corner(&json, world)?;
    let mut drawing = Drawing::default();
    collect(&json, &Value::Null, 0, &mut drawing)?;
    let farthest = farthest(world);
    let degrees = |point: &Waypoint| point.at[0].abs() <= farthest && point.at[1].abs() <= 90.0;
    let size = json.get("world_size_m").and_then(Value::as_array);
    let is_small = size.is_some_and(|size| size.iter().all(|side| side.as_f64().is_some_and(|side| side <= 180.0)));
    let is_metric = corner.is_some() || is_small && world.place.is_none();
    if !is_metric && drawing.lines.iter().flat_map(|line| &line.points).all(degrees) && !drawing.lines.is_empty() {
        project(&mut drawing, world)?;
        return Ok(drawing);
    }
    let [west, north] = corner.unwrap_or([0.0, world.size[1]]);
    for point in drawing.lines.iter_mut().flat_map(|line| &mut line.points) {
        point.at = [point.at[0] - west, north - point.at[1]];
    }
    Ok(drawing)
}

/// The largest longitude that counts as one: near the antimeridian lines go on beyond 180 degrees, as this program writes
/// them.
fn farthest(world: &World) -> f64 {
    const NEAR: f64 = 30.0;
    let middle = world.place.and_then(|place| {
        let [east, north] = [place.corner_m[0] + 0.5 * world.size[0], place.corner_m[1] - 0.5 * world.size[1]];
        Projection::of(place.epsg).ok()?.degrees([east, north])
    });
    if middle.is_some_and(|[longitude, _]| longitude.abs() > 180.0 - NEAR) { 180.0 + NEAR } else { 180.0 }
}

/// Converts longitudes and latitudes of WGS84 to positions in the world, if it has a place.
fn project(drawing: &mut Drawing, world: &World) -> Result<(), VectorError> {
    let Some(place) = world.place else {
        return Err(VectorError::new(
            "its coordinates are degrees, and the world is a plane in metres without a place on Earth",
            "give the world a `place`, or convert the file to metres first, for example `ogr2ogr -t_srs EPSG:32632 \
             metres.geojson degrees.geojson`",
        ));
    };
    let system = Projection::of(place.epsg).map_err(|error| {
        VectorError::new(format!("its coordinates are degrees: {error}"), "convert the file to the system of the world")
    })?;
    for point in drawing.lines.iter_mut().flat_map(|line| &mut line.points) {
        let [x, y] = system.position(point.at).ok_or_else(|| {
            let [longitude, latitude] = point.at;
            VectorError::new(
                format!("the point {longitude}, {latitude} lies outside of the domain of EPSG:{}", place.epsg),
                "cut out the part that is needed, or give the world a `place` in another system",
            )
        })?;
        point.at = [x - place.corner_m[0], place.corner_m[1] - y];
    }
    Ok(())
}

/// Easting and northing of the world's north-west corner in the coordinate system that the file names. Returns None
/// when it names none.
fn corner(json: &Value, world: &World) -> Result<Option<[f64; 2]>, VectorError> {
    let Some(name) = json.pointer("/crs/properties/name").and_then(Value::as_str) else { return Ok(None) };
    let code = name.rsplit(':').next().and_then(|code| code.parse::<u32>().ok());
    let in_degrees = code == Some(4326) || name.ends_with("CRS84");
    match (code, world.place) {
        _ if in_degrees => Ok(None),
        (Some(code), Some(place)) if place.epsg == code => Ok(Some(place.corner_m)),
        (_, Some(place)) => Err(VectorError::new(
            format!("its coordinate system is {name}, and that of the world is EPSG:{}", place.epsg),
            format!("convert it first: `ogr2ogr -t_srs EPSG:{} metres.geojson FILE`", place.epsg),
        )),
        (Some(code), None) => Err(VectorError::new(
            format!("its coordinate system is {name}, and the world has no place in it"),
            format!(
                "give the world the easting and northing of its north-west corner: `place: (epsg: {code}, corner: (x, y))`"
            ),
        )),
        (None, None) => Err(VectorError::new(
            format!("its coordinate system `{name}` is unknown"),
            "convert it to one with an EPSG code, in metres, and give the world a `place` in it",
        )),
    }
}

/// Collects the lines of an object; features give their properties to their geometry.
fn collect(object: &Value, properties: &Value, depth: usize, drawing: &mut Drawing) -> Result<(), VectorError> {
    /// Collections in collections.
    const DEEPEST: usize = 16;
    if depth > DEEPEST {
        return Err(VectorError::damaged("its collections are nested too deeply"));
    }
    let items = |name: &str| object.get(name).and_then(Value::as_array).map(Vec::as_slice).unwrap_or_default();
    let coordinates = items("coordinates");
    let closed = |drawing: &mut Drawing, rings: &[Value]| {
        rings.iter().try_for_each(|ring| line(list(ring)?, properties, true).map(|line| drawing.lines.extend(line)))
    };
    match object.get("type").and_then(Value::as_str) {
        Some("FeatureCollection") => {
            items("features").iter().try_for_each(|feature| collect(feature, properties, depth + 1, drawing))
        }
        Some("GeometryCollection") => {
            items("geometries").iter().try_for_each(|geometry| collect(geometry, properties, depth + 1, drawing))
        }
        Some("Feature") => match object.get("geometry") {
            Some(geometry) if !geometry.is_null() => {
                collect(geometry, object.get("properties").unwrap_or(&Value::Null), depth + 1, drawing)
            }
            _ => Ok(()),
        },
        Some("LineString") => {
            drawing.lines.extend(line(coordinates, properties, false)?);
            Ok(())
        }
        Some("MultiLineString") => coordinates.iter().try_for_each(|part| {
            drawing.lines.extend(line(list(part)?, properties, false)?);
            Ok(())
        }),
        Some("Polygon") => closed(drawing, coordinates),
        Some("MultiPolygon") => coordinates.iter().try_for_each(|part| closed(drawing, list(part)?)),
        Some("Point" | "MultiPoint") => {
            drawing.skipped += 1;
            Ok(())
        }
        Some(other) => Err(VectorError::damaged(format!("it has an object of the unknown type `{other}`"))),
        None => Err(VectorError::damaged("it has an object without a type")),
    }
}

fn list(value: &Value) -> Result<&[Value], VectorError> {
    value.as_array().map(Vec::as_slice).ok_or_else(|| VectorError::damaged("it has coordinates that are no list"))
}

/// A line with the heights of its coordinates, and the widths that its properties give to each or to all points.
fn line(coordinates: &[Value], properties: &Value, closed: bool) -> Result<Option<Polyline>, VectorError> {
    let number = |value: Option<&Value>| value.and_then(Value::as_f64).filter(|number| number.is_finite());
    let each = properties.get("widths_m").and_then(Value::as_array).filter(|widths| widths.len() == coordinates.len());
    let all = number(properties.get("width_m")).or_else(|| number(properties.get("width")));
    let point = |(at, coordinate): (usize, &Value)| {
        let parts = list(coordinate)?;
        let (Some(x), Some(y)) = (number(parts.first()), number(parts.get(1))) else {
            return Err(VectorError::damaged("it has a coordinate without two numbers"));
        };
        let width = each.map_or(all, |widths| number(widths.get(at)));
        let within = |value: f64, [least, most]: [f64; 2]| value.clamp(least, most);
        Ok(Waypoint {
            at: [x, y],
            height: number(parts.get(2)).map(|height| within(height, Waypoint::HEIGHTS)),
            width: width.map(|width| within(width, Waypoint::WIDTHS)),
        })
    };
    let points: Vec<Waypoint> = coordinates.iter().enumerate().map(point).collect::<Result<_, _>>()?;
    Ok(polyline(points, closed))
}
