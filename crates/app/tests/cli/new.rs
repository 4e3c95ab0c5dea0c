//! Graphs of real places: their coordinates come in and leave.

use orograph_nodes::raster::{self, Cell};

use super::{Place, repository};

/// Through a graph that does nothing, every sample and the coordinates are as before; a part has its own corner.
#[test]
fn a_real_place_leaves_as_it_came() {
    let place = Place::new();
    let model = repository("tests/data/bigtujunga_i16_tiled.tif");
    std::fs::copy(&model, place.path("model.tif")).expect("copied");
    let said = place.run(&["new", "model.tif", "-o", "g.ron"]).done().out;
    assert!(said.contains("90 x 70 cells of 30 m, in EPSG:32611"), "{said}");
    assert!(
        place.read("g.ron").contains("Import(version: 2, file: \"model.tif\", placement: place)"),
        "{}",
        place.read("g.ron")
    );
    place.run(&["fmt", "--check", "g.ron"]).done();
    place.run(&["run", "g.ron", "-o", "out", "--format", "tiff"]).done();
    let (before, after) = (raster::read(&model).expect("readable"), raster::read(&place.path("out/height.tif")));
    let after = after.expect("readable");
    assert_eq!((after.samples, after.head.epsg), (before.samples, before.head.epsg));
    assert_eq!((after.head.origin, after.head.cell), (before.head.origin, before.head.cell));
    let [x, y] = before.head.origin.expect("a corner");
    let part = ["run", "g.ron", "-o", "part", "--format", "tiff", "--window", "300,600,1200x900", "--cells", "180"];
    place.run(&part).done();
    let part = raster::read(&place.path("part/height.tif")).expect("readable").head;
    assert_eq!(
        (part.origin, part.cell, part.columns),
        (Some([x + 300.0, y - 600.0]), Some(Cell::Metres([15.0; 2])), 80)
    );
    place.run(&["new", "model.tif", "-o", "g.ron"]).ended(1, &["already", "-o"]);
    place.run(&["new", "none.tif", "-o", "h.ron"]).ended(1, &["no such file"]);
}

#[test]
fn a_file_in_degrees_gets_a_place_in_metres() {
    let place = Place::new();
    let model = repository("tests/data/frontrange_degrees_is_point.tif");
    let made = place.run(&["new", model.to_str().expect("a name"), "-o", "g.ron"]).done();
    assert!(made.out.contains("in EPSG:32613"), "{}", made.out);
    assert!(made.err.contains("it is in degrees; the world is in EPSG:32613"), "{}", made.err);
    assert!(place.read("g.ron").contains("placement: place"), "{}", place.read("g.ron"));
    place.run(&["check", "g.ron"]).done();
    place.run(&["run", "g.ron", "-o", "out", "--format", "cog"]).done();
    let (before, after) = (raster::read(&model).expect("readable"), raster::read(&place.path("out/height.tif")));
    let after = after.expect("readable");
    assert_eq!(after.head.epsg, Some(32613));
    let mean = |samples: &[f32]| samples.iter().map(|v| f64::from(*v)).sum::<f64>() / samples.len() as f64;
    assert!((mean(&after.samples) - mean(&before.samples)).abs() < 10.0, "of mountains");
}

/// The world of a raster is that which `new` writes, also in an archive, in other cells and in a window.
#[test]
fn a_world_comes_from_a_raster() {
    let place = Place::new();
    std::fs::copy(repository("tests/data/bigtujunga_i16_tiled.tif"), place.path("dem.tif")).expect("copied");
    place.run(&["new", "dem.tif", "-o", "new.ron"]).done();
    let graph = r#"(world: (from: "dem.tif", boundary: inland),
        nodes: { "land": Import(version: 2, file: "dem.tif", placement: place) }, outputs: { "height": "land" })"#;
    place.write("from.ron", graph);
    place.run(&["diff", "new.ron", "from.ron", "--exit-code"]).done();
    place.run(&["pack", "from.ron"]).done();
    std::fs::remove_file(place.path("dem.tif")).expect("removed");
    place.run(&["check", "from.ron"]).ended(1, &["no such file", "check the name", "from.ron:1:16"]);
    let part = ["run", "from.orograph", "-o", "part", "--format", "cog", "--window", "300,600,1200x900"];
    place.run(&[&part[..], &["--cells", "180"]].concat()).done();
    let head = raster::read(&place.path("part/height.tif")).expect("readable").head;
    assert_eq!((head.columns, head.cell, head.epsg), (80, Some(Cell::Metres([15.0; 2])), Some(32611)));
}
