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

/// A bare heightmap has neither a cell size nor a range of heights.
#[test]
fn a_bare_heightmap_gets_its_scale_from_the_command_line() {
    let place = Place::new();
    std::fs::copy(repository("tests/data/glencoe_48x64_u16.png"), place.path("bare.png")).expect("copied");
    place.run(&["new", "bare.png", "-o", "g.ron"]).ended(1, &["integer codes", "--range"]);
    place.run(&["new", "bare.png", "-o", "g.ron", "--range", "0,1200"]).ended(1, &["cell size", "--cell 30"]);
    let said = place.run(&["new", "bare.png", "-o", "g.ron", "--range", "0,1200", "--cell", "30"]).done().out;
    assert!(said.contains("cells of 30 m, without a place on Earth"), "{said}");
    assert!(place.read("g.ron").contains("cell: 30, range: (0, 1200)"), "{}", place.read("g.ron"));
    let ran = place.run(&["run", "g.ron", "-o", "out", "--format", "png8"]).done();
    assert!(ran.err.contains("png8 has 256 levels"), "{}", ran.err);
    let model = repository("tests/data/bigtujunga_i16_tiled.tif");
    let known = ["new", model.to_str().expect("a name"), "-o", "h.ron", "--range", "0,9"];
    place.run(&known).ended(1, &["`--range` has no effect"]);
    let both = ["new", "bare.png", "bare.png", "-o", "h.ron", "--cell", "30"];
    place.run(&both).ended(1, &["`--cell` is for a single elevation model"]);
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

/// Cells without data come in and leave as such, in every format that can have them.
#[test]
fn voids_are_kept_into_the_files() {
    let place = Place::new();
    let model = repository("tests/data/mandakini_basin_f32_nodata.tif");
    std::fs::copy(&model, place.path("dem.tif")).expect("copied");
    let graph = r#"(world: (size: 1000, cells: 100), nodes: { "dem": Import(version: 2, file: "dem.tif", placement: stretch) },
        outputs: { "height": "dem", "data": "dem.data" })"#;
    place.write("g.ron", graph);
    let before = raster::read(&model).expect("readable");
    assert_eq!((before.head.columns, before.head.rows, before.voids.cells > 0), (100, 100, true));
    let run = |args: &[&str]| place.run(&[&["run", "g.ron", "-o", "out", "--holes", "dem.data"], args].concat());
    for (args, file) in [
        (&["--format", "tiff"][..], "height.tif"),
        (&["--format", "cog", "--window", "0,300,1000x400"], "height.tif"),
        (&["--format", "r32"], "height.r32"),
        (&["--engine", "godot", "--only", "height"], "height.exr"),
    ] {
        run(args).done();
        let after = raster::read(&place.path("out").join(file)).expect("readable");
        let part = if args.contains(&"--window") { 3000..7000 } else { 0..10_000 };
        for (before, after) in before.samples[part].iter().zip(&after.samples) {
            assert!(before.to_bits() == after.to_bits() || before.is_nan() && after.is_nan(), "{args:?}");
        }
    }
    // the mask is of the cells that have data
    run(&["--format", "tiff"]).done();
    assert!(
        raster::read(&place.path("out/data.tif")).expect("readable").samples.iter().all(|v| *v >= 0.5 || v.is_nan())
    );
    let told = place.run(&["metrics", "out/height.tif", "--json"]).done();
    assert!(told.err.contains("have no data and are left out"), "{}", told.err);
    run(&["--format", "png16"]).ended(1, &["png16 has no value for cells without data", "exr, tiff, cog or r32"]);
    run(&["--engine", "unity"]).ended(1, &["Unity has no value", "--engine godot"]);
    place.run(&["run", "g.ron", "--holes", "dem"]).ended(1, &["it is a height", "`NODE.data`"]);
    place.run(&["run", "g.ron", "--holes", "dem.dat"]).ended(1, &["--holes dem.dat", "data"]);
}

/// Tiles side by side become one elevation model, without a seam.
#[test]
fn tiles_side_by_side_are_joined() {
    let place = Place::new();
    let side = 121;
    // a ridge from west to east in metres, and a void across the common side
    let post = |column: usize, row: usize| match (100..140).contains(&column) && (40..60).contains(&row) {
        true => -32_768_i16,
        false => (column * 3 + row) as i16,
    };
    for (name, first) in [("N46E007.hgt", 0), ("N46E008.hgt", side - 1)] {
        let posts = (0..side * side).map(|at| post(first + at % side, at / side));
        std::fs::write(place.path(name), posts.flat_map(i16::to_be_bytes).collect::<Vec<u8>>()).expect("written");
    }
    let over = ["new", "N46E007.hgt", "N46E008.hgt", "-o", "g.tif"];
    place.run(&over).ended(1, &["both the graph and the joined model", ".ron"]);
    let made = place.run(&["new", "N46E007.hgt", "N46E008.hgt", "-o", "g.ron"]).done();
    assert!(made.out.contains("in EPSG:32632"), "{}", made.out);
    assert!(place.read("g.ron").contains("file: \"g.tif\""), "{}", place.read("g.ron"));
    let joined = raster::read(&place.path("g.tif")).expect("readable");
    assert_eq!((joined.head.columns, joined.head.rows, joined.voids.cells), (2 * side - 1, side, 40 * 20));
    for (at, v) in joined.samples.iter().enumerate() {
        let expected = post(at % (2 * side - 1), at / (2 * side - 1));
        assert!(*v == f32::from(expected) || v.is_nan() && expected == -32_768);
    }
    place.run(&["run", "g.ron", "-o", "out", "--format", "tiff"]).done();
    let height = raster::read(&place.path("out/height.tif")).expect("readable");
    let columns = height.head.columns;
    for row in height.samples.chunks_exact(columns) {
        // three metres a post to the east, also across the common side and the void
        assert!(row.windows(2).all(|pair| (pair[1] - pair[0]).abs() < 12.0));
    }
    place.run(&["new", "N46E007.hgt", "N46E008.hgt", "-o", "g.ron"]).ended(1, &["already"]);
    place.run(&["new", "N46E007.hgt", "none.hgt", "-o", "h.ron"]).ended(1, &["no such file"]);
    let feet = repository("tests/data/bigtujunga_i16_tiled.tif");
    let other = feet.to_str().expect("a name");
    place.run(&["new", "N46E007.hgt", other, "-o", "h.ron"]).ended(1, &["not on the grid", "EPSG:32611", "gdalwarp"]);
    assert!(!place.path("h.tif").exists());
}
