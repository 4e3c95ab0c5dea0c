//! Lines as GeoJSON (RFC 7946), which geographic information systems read.
//!
//! Coordinates are not degrees but metres of the world: east of its west side, north of its south side, and elevation,
//! as in the GeoTIFFs of rasters. Lengths are rounded to millimetres, areas to square metres.

use std::io::{self, Write};

use orograph_graph::{Line, Lines, Vertex, World};
use serde::Serialize;

#[derive(Serialize)]
struct Collection<F> {
    r#type: &'static str,
    /// Extent of the world in metres, a foreign member.
    world_size_m: [f64; 2],
    features: F,
}

#[derive(Serialize)]
struct Feature {
    r#type: &'static str,
    id: usize,
    geometry: Geometry,
    properties: Properties,
}

#[derive(Serialize)]
struct Geometry {
    r#type: &'static str,
    coordinates: Vec<[f64; 3]>,
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
pub fn write(to: &mut dyn Write, lines: &Lines, world: &World) -> io::Result<()> {
    let features: Vec<Feature> = lines.lines.iter().enumerate().map(|(id, line)| feature(id, line, world)).collect();
    let collection = Collection { r#type: "FeatureCollection", world_size_m: world.size, features };
    serde_json::to_writer(&mut *to, &collection)?;
    to.write_all(b"\n")
}

fn feature(id: usize, line: &Line, world: &World) -> Feature {
    let vertices = line.vertices.as_slice();
    let all = |number: fn(&Vertex) -> f64| vertices.iter().map(number).map(millimetres).collect::<Vec<_>>();
    let coordinates = vertices.iter().map(|vertex| {
        let [east, south] = vertex.position_m;
        [east, world.size[1] - south, vertex.elevation_m].map(millimetres)
    });
    let step = |pair: &[Vertex]| {
        let [x, y] = [0, 1].map(|axis| pair[1].position_m[axis] - pair[0].position_m[axis]);
        (x * x + y * y).sqrt()
    };
    let lowest = vertices.last().copied().unwrap_or_default();
    Feature {
        r#type: "Feature",
        id,
        geometry: Geometry { r#type: "LineString", coordinates: coordinates.collect() },
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
        let lines = Lines { lines: vec![line(Some(1)), line(None)] };
        let world = World { size: [100.0, 50.0], cells: [20, 10], ..World::default() };
        let mut text = Vec::new();
        write(&mut text, &lines, &world).expect("memory");
        let json: serde_json::Value = serde_json::from_slice(&text).expect("JSON");
        assert_eq!((json["type"].as_str(), &json["world_size_m"][0]), (Some("FeatureCollection"), &100.0.into()));
        let first = &json["features"][0];
        assert_eq!(first["geometry"]["type"], "LineString");
        assert_eq!(first["geometry"]["coordinates"], serde_json::json!([[0.0, 50.0, 9.0], [3.0, 46.0, 8.5]]));
        let properties = &first["properties"];
        assert_eq!((&properties["downstream"], &properties["length_m"]), (&1.into(), &5.0.into()));
        assert_eq!((&properties["widths_m"][0], &properties["order"]), (&2.0.into(), &2.into()));
        assert!(json["features"][1]["properties"]["downstream"].is_null());
    }
}
