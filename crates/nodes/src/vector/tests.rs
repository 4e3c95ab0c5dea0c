//! Tests of vector files.

use std::path::PathBuf;

use orograph_graph::{GeoPlace, NodeError};

use super::*;

fn file(name: &str, text: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join(name);
    std::fs::write(&path, text).expect("written");
    (folder, path)
}

fn world() -> World {
    World { size: [1000.0, 500.0], cells: [100, 50], ..World::default() }
}

fn drawing(name: &str, text: &str, world: &World) -> Result<Drawing, [String; 2]> {
    let (_folder, path) = file(name, text);
    read(&path, world).map_err(|error| match error {
        NodeError::Failed { message, hint } => [message, hint.expect("a remedy")],
        other => panic!("{other:?}"),
    })
}

fn places(line: &Polyline) -> Vec<[f64; 2]> {
    line.points.iter().map(|point| point.at).collect()
}

#[test]
fn geojson_in_metres_is_read_with_north_up() {
    let text = r#"{"type": "FeatureCollection", "world_size_m": [1000, 500], "features": [
        {"type": "Feature", "properties": {"widths_m": [4, 6]},
         "geometry": {"type": "LineString", "coordinates": [[10, 490, 120], [20, 480, 118.5]]}},
        {"type": "Feature", "properties": {"width": 9}, "geometry": {"type": "Polygon",
         "coordinates": [[[0, 0], [50, 0], [50, 50], [0, 0]]]}},
        {"type": "Feature", "properties": null, "geometry": {"type": "Point", "coordinates": [1, 1]}},
        {"type": "Feature", "properties": null, "geometry": null}]}"#;
    let found = drawing("a.geojson", text, &world()).expect("lines");
    assert_eq!((found.lines.len(), found.skipped), (2, 1));
    let first = &found.lines[0].points;
    assert_eq!(first[0], Waypoint { at: [10.0, 10.0], height: Some(120.0), width: Some(4.0) });
    assert_eq!(first[1], Waypoint { at: [20.0, 20.0], height: Some(118.5), width: Some(6.0) });
    assert!(found.lines[1].closed);
    assert_eq!(places(&found.lines[1]), [[0.0, 500.0], [50.0, 500.0], [50.0, 450.0]]);
    assert_eq!(found.lines[1].points[2].width, Some(9.0));
}

#[test]
fn degrees_need_a_place_and_a_system_must_be_that_of_the_world() {
    let line = |crs: &str, at: [f64; 2]| {
        let [x, y] = at;
        let crs =
            if crs.is_empty() { String::new() } else { format!(r#""crs": {{"properties": {{"name": "{crs}"}}}},"#) };
        format!(r#"{{{crs} "type": "LineString", "coordinates": [[{x}, {y}], [{}, {y}]]}}"#, x + 0.5)
    };
    let placed = World { place: Some(GeoPlace { epsg: 32_611, corner_m: [378_000.0, 3_812_000.0] }), ..world() };
    let near = [-118.3, 34.4];
    let [x, y] = crate::raster::Projection::of(32_611).expect("known").position(near).expect("in its domain");
    for crs in ["", "urn:ogc:def:crs:OGC:1.3:CRS84", "EPSG:4326"] {
        let [message, remedy] = drawing("a.json", &line(crs, near), &world()).expect_err("degrees");
        assert!(message.contains("degrees") && remedy.contains("ogr2ogr"), "{message}; {remedy}");
        let found = drawing("a.json", &line(crs, near), &placed).expect("converted");
        assert_eq!(places(&found.lines[0])[0], [x - 378_000.0, 3_812_000.0 - y]);
    }
    let utm = line("urn:ogc:def:crs:EPSG::32611", [378_100.0, 3_811_900.0]);
    let found = drawing("a.json", &utm, &placed).expect("a line");
    assert_eq!(places(&found.lines[0]), [[100.0, 100.0], [100.5, 100.0]]);
    let [_, remedy] = drawing("a.json", &utm, &world()).expect_err("no place");
    assert!(remedy.contains("epsg: 32611"), "{remedy}");
    let other = line("EPSG:2056", [2_600_000.0, 1_200_000.0]);
    let [message, remedy] = drawing("a.json", &other, &placed).expect_err("another system");
    assert!(message.contains("2056") && remedy.contains("EPSG:32611"), "{message}; {remedy}");
    assert!(drawing("a.json", &line("", [300.0, 46.2]), &world()).is_ok(), "beyond degrees");
}

#[test]
fn svg_is_read_with_its_transforms() {
    let text = r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 1000 500">
        <defs><path d="M 0 0 L 9 9"/></defs>
        <g transform="translate(100 50)"><g transform="scale(2)">
            <path d="M 10 10 h 20 v 5 z m 100 0 C 120 10 120 30 140 30"/>
            <polyline points="1,2 3,4 3,4 5,6"/></g></g>
        <line x1="1" y1="2" x2="3" y2="4"/><rect x="5" y="6" width="10" height="20"/>
        <circle cx="50" cy="60" r="10"/><text>A</text></svg>"#;
    let found = drawing("a.svg", text, &world()).expect("lines");
    assert_eq!((found.lines.len(), found.skipped), (6, 1));
    assert!(found.lines[0].closed);
    assert_eq!(places(&found.lines[0]), [[120.0, 70.0], [160.0, 70.0], [160.0, 80.0]]);
    let curve = places(&found.lines[1]);
    assert!(curve.len() > 10, "{curve:?}");
    assert_eq!((curve[0], curve[curve.len() - 1]), ([320.0, 70.0], [380.0, 110.0]));
    assert_eq!(places(&found.lines[2]), [[102.0, 54.0], [106.0, 58.0], [110.0, 62.0]]);
    assert_eq!(places(&found.lines[3]), [[1.0, 2.0], [3.0, 4.0]]);
    assert!(found.lines[4].closed && found.lines[5].closed);
    for at in places(&found.lines[5]) {
        assert!((libm::hypot(at[0] - 50.0, at[1] - 60.0) - 10.0).abs() < 1e-9, "{at:?}");
    }
}

#[test]
fn bad_files_are_refused_with_a_remedy() {
    let cases = [
        ("a.geojson", "not json", "not JSON"),
        ("a.geojson", r#"{"type": "FeatureCollection", "features": []}"#, "no lines"),
        ("a.geojson", r#"{"type": "LineString", "coordinates": [[1], [2, 3]]}"#, "two numbers"),
        ("a.geojson", r#"{"type": "Curve"}"#, "unknown type `Curve`"),
        ("a.svg", "<svg><path d='M 0 0 L x'/></svg>", "attribute `d`"),
        ("a.svg", "<svg><g transform='spin(3)'/></svg>", "not SVG"),
        ("a.svg", "<html></html>", "no element `svg`"),
        ("a.svg", "<svg><g></svg>", "not SVG"),
        ("a.dxf", "0", "neither GeoJSON nor SVG"),
    ];
    for (name, text, expected) in cases {
        let [message, _] = drawing(name, text, &world()).expect_err("bad");
        assert!(message.contains(expected), "{text}: {message}");
    }
    let deep = format!("<svg>{}", "<g>".repeat(300));
    assert!(drawing("a.svg", &deep, &world()).is_err());
    let nested = format!("{}{}", r#"{"type": "GeometryCollection", "geometries": ["#.repeat(40), "]}".repeat(40));
    assert!(drawing("a.json", &nested, &world()).is_err());
    let missing = read(Path::new("/nowhere/a.svg"), &world());
    assert!(matches!(missing, Err(NodeError::Failed { hint: Some(_), .. })), "{missing:?}");
}

#[test]
fn points_out_of_all_proportion_are_refused() {
    for text in [
        r#"{"type": "LineString", "world_size_m": [1000, 500], "coordinates": [[0, 0], [1e200, 3]]}"#,
        r#"{"type": "LineString", "world_size_m": [1000, 500], "coordinates": [[0, 0], [5, -1e300]]}"#,
    ] {
        let [message, hint] = drawing("a.geojson", text, &world()).expect_err("too far");
        assert!(message.contains("of the world's corner") && hint.contains("metres"), "{message} {hint}");
    }
}

/// A line that goes on beyond 180 degrees, as this program writes it, is where one across the antimeridian is.
#[test]
fn a_line_across_the_antimeridian_is_in_degrees() {
    let place = GeoPlace { epsg: 32_601, corner_m: [350_000.0, 7_225_000.0] };
    let world = World { place: Some(place), size: [20_000.0; 2], ..world() };
    let line = |east: f64| {
        let text = format!(r#"{{"type": "LineString", "coordinates": [[179.95, 65.0], [{east}, 65.02]]}}"#);
        places(&drawing("a.json", &text, &world).expect("a line").lines[0])
    };
    let (beyond, within) = (line(180.05), line(-179.95));
    for (a, b) in beyond.iter().zip(&within) {
        assert!((a[0] - b[0]).abs() < 1e-3 && (a[1] - b[1]).abs() < 1e-3, "{beyond:?} {within:?}");
    }
    assert!((beyond[1][0] - beyond[0][0]).abs() > 4000.0, "metres");
}

/// Short texts that draw long curves end as soon as there are too many points.
#[test]
fn curves_end_at_the_largest_number_of_points() {
    let curves = format!("<svg><path d='M0 0{}'/></svg>", "s9 0 1 9".repeat(20_000));
    let pieces = format!("<svg><path d='M0 0{}'/></svg>", "s9 0 1 9z".repeat(20_000));
    let circles = format!("<svg>{}</svg>", "<circle r='9'/>".repeat(20_000));
    for text in [curves, pieces, circles] {
        let [message, _] = drawing("a.svg", &text, &world()).expect_err("too many");
        assert!(message.contains("more than 200000 points"), "{message}");
    }
}
