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
fn a_file_in_degrees_has_a_size_and_no_place() {
    let place = Place::new();
    let model = repository("tests/data/frontrange_degrees_is_point.tif");
    let said = place.run(&["new", model.to_str().expect("a name"), "-o", "g.ron"]).done().out;
    assert!(said.contains("without a place"), "{said}");
    place.run(&["check", "g.ron"]).done();
    place.run(&["run", "g.ron", "-o", "out"]).done();
}
