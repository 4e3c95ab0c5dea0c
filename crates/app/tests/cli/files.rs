//! `check`, `fmt`, `diff` and `render`: commands about files.

use std::fs;

use super::{Place, SMALL, repository};

#[test]
fn check_passes_valid_files_and_counts_the_rest() {
    let place = Place::new();
    place.write("a.ron", SMALL);
    place.write("b.ron", &SMALL.replace("Slope(", "Slop("));
    assert!(place.run(&["check", "a.ron"]).done().out.contains("ok a.ron  3 nodes, 3 outputs"));
    // warnings count before a build on which nobody looks
    place.write("c.ron", &SMALL.replace("Slope(height: \"plain\")", "Slope(height: \"plain\", from: 50, to: 10)"));
    place.run(&["check", "c.ron"]).done();
    place.run(&["check", "--strict", "a.ron"]).done();
    place.run(&["check", "--strict", "a.ron", "c.ron"]).ended(1, &["1 warning"]);
    let ran = place.run(&["check", "a.ron", "none.ron", "b.ron"]).ended(1, &["1 problem in b.ron", "none.ron"]);
    assert!(ran.out.contains("ok a.ron"), "{ran:?}");
}

/// What changes no output is a note, which is not counted as a problem; no preset has any.
#[test]
fn check_notes_what_has_no_effect() {
    let place = Place::new();
    let text = SMALL.replace("nodes: {", "nodes: { \"spare\": Constant(value: 3),");
    place.write("g.ron", &text.replace("Constant(value: 700)", "Fractal(kind: swiss, detail: 0.3)"));
    let ran = place.run(&["check", "--strict", "g.ron"]).done();
    assert!(ran.out.contains("4 nodes, 3 outputs, 2 notes"), "{ran:?}");
    for text in ["no output needs `spare`", "`detail` of `plain` has no effect", "g.ron:5:"] {
        assert!(ran.err.contains(text), "`{text}`: {ran:?}");
    }
    let lines = super::json_lines(&place.run(&["check", "--json", "g.ron"]).done().out);
    let last = lines.last().expect("a line");
    assert_eq!([last["notes"].as_u64(), last["warnings"].as_u64()], [Some(2), Some(0)]);
    assert_eq!(lines[0]["severity"], "note");

    let graphs: Vec<String> = fs::read_dir(repository("graphs"))
        .expect("a folder")
        .map(|entry| entry.expect("an entry").path().display().to_string())
        .filter(|path| path.ends_with(".ron"))
        .collect();
    let ran = place.run(&[&["check"], &graphs.iter().map(String::as_str).collect::<Vec<_>>()[..]].concat()).done();
    assert_eq!((ran.err.as_str(), ran.out.lines().count()), ("", graphs.len()), "{ran:?}");
}

#[test]
fn fmt_keeps_comments_and_is_idempotent() {
    let place = Place::new();
    let crooked = SMALL.replace("    nodes: {", "nodes   :   {").replace("3200, 1600", "3200,1600");
    place.write("g.ron", &crooked);
    let ran = place.run(&["fmt", "--check", "g.ron"]).ended(1, &["1 file not in canonical form"]);
    assert!(ran.out.contains("g.ron"), "{ran:?}");
    assert_eq!(place.read("g.ron"), crooked, "`--check` changes nothing");
    place.run(&["fmt", "g.ron"]).done();
    let canonical = place.read("g.ron");
    assert!(canonical.contains("// A plain and its shade.") && canonical.contains("// metres"), "{canonical}");
    place.run(&["fmt", "--check", "g.ron"]).done();
    assert_eq!(place.run(&["diff", "g.ron", "g.ron"]).done().out, "no difference in what they build\n");
    place.write("broken.ron", "(nodes: {");
    place.run(&["fmt", "broken.ron"]).ended(1, &["broken.ron:1:"]);
    assert_eq!(place.read("broken.ron"), "(nodes: {");
}

/// A graph from standard input is formatted, checked and built as a file in the current folder.
#[cfg(unix)]
#[test]
fn standard_input_is_a_graph_file() {
    let place = Place::new();
    let crooked = SMALL.replace("    nodes: {", "nodes   :   {");
    place.write("g.ron", &crooked);
    place.write("good.ron", SMALL);
    let canonical = place.shell("\"$0\" fmt - < g.ron").done().out;
    place.write("formatted.ron", &canonical);
    place.run(&["fmt", "--check", "formatted.ron"]).done();
    assert_eq!(place.shell("\"$0\" fmt - < formatted.ron").done().out, canonical);
    assert_eq!(place.read("g.ron"), crooked);
    place.shell("\"$0\" fmt --check - < g.ron").ended(1, &["not in canonical form"]);
    place.shell("echo '(nodes: {' | \"$0\" fmt -").ended(1, &["-:1:"]);
    let checked = place.shell("\"$0\" check --json - < good.ron").done().out;
    assert!(checked.contains(r#""file":"-""#) && checked.contains(r#""nodes":3"#), "{checked}");
    place.shell("sed s/700/900/ g.ron | \"$0\" run - -o out --only height -q").done();
    assert!(place.names("out").contains(&"height.exr".to_owned()));
    place.shell("printf '\\377' | \"$0\" run -").ended(1, &["not"]);
    place.shell("\"$0\" watch - < g.ron").ended(1, &["cannot be watched"]);
}

/// Graphs of equal text differ if the files do that they read, also in archives, which hold lines as well.
#[test]
fn diff_compares_the_files_that_are_read() {
    let place = Place::new();
    let graph = r#"(world: (size: 400, cells: 8), nodes: { "way": Path(file: "way.geojson"), "far": Distance(lines: "way") },
        outputs: { "far": "far.distance" })"#;
    let way = |x: u32| format!(r#"{{"type": "LineString", "coordinates": [[10, 10], [{x}, 300]]}}"#);
    for (folder, x) in [("a", 200), ("b", 300)] {
        fs::create_dir(place.path(folder)).expect("made");
        place.write(&format!("{folder}/g.ron"), graph);
        place.write(&format!("{folder}/way.geojson"), &way(x));
    }
    let said = "`way.geojson`: contents differ\n";
    assert_eq!(place.run(&["diff", "a/g.ron", "b/g.ron", "--exit-code"]).ended(1, &[]).out, said);
    for folder in ["a", "b"] {
        let archive = format!("{folder}.orograph");
        place.run(&["pack", &format!("{folder}/g.ron"), "-o", &archive]).done();
        place.run(&["run", &archive, "-o", "out", "-q"]).done();
    }
    assert_eq!(place.run(&["diff", "a.orograph", "b.orograph"]).done().out, said);
    place.write("a/way.geojson", "{}");
    place.run(&["pack", "a/g.ron", "-o", "c.orograph"]).ended(1, &["way.geojson", "cannot be packed", "`way`"]);
}

#[test]
fn diff_lists_what_changed() {
    let place = Place::new();
    place.write("a.ron", SMALL);
    place.write("b.ron", &SMALL.replace("value: 700", "value: 900").replace("// metres", "// feet"));
    let ran = place.run(&["diff", "a.ron", "b.ron"]).done();
    assert_eq!(ran.out, "plain.value 700 → 900\n");
    place.run(&["diff", "a.ron", "b.ron", "--exit-code"]).ended(1, &[]);
    let ran = place.run(&["diff", "a.ron", "b.ron", "--exit-code", "--json"]).ended(1, &[]);
    assert_eq!(ran.out, "{\"changes\":[\"plain.value 700 → 900\"]}\n");
    assert_eq!(place.run(&["diff", "a.ron", "a.ron", "--json"]).done().out, "{\"changes\":[]}\n");
    place.run(&["diff", "a.ron", "none.ron"]).ended(1, &["none.ron"]);
}

#[test]
fn pictures_of_graphs_and_of_height_files() {
    let place = Place::new();
    place.write("g.ron", SMALL);
    place.run(&["render", "g.ron", "-o", "map.png", "--cells", "64"]).done();
    place.run(&["render", "g.ron", "-o", "steep.png", "--output", "steep"]).done();
    let dem = repository("tests/data/glencoe_128.tif");
    let dem = dem.to_str().expect("plain name");
    for view in ["map", "hillshade"] {
        place.run(&["render", dem, "-o", &format!("{view}.png"), "--view", view]).done();
    }
    assert!(fs::read(place.path("map.png")).unwrap() != fs::read(place.path("hillshade.png")).unwrap());
    let picture = ["render", "g.ron", "-o", "none.png", "--output", "picture", "--view"];
    place.run(&[&picture[..], &["hillshade"]].concat()).ended(1, &["`--view hillshade` shows heights", "--output"]);
    place.run(&["render", "g.ron", "-o", "map.jpg"]).ended(1, &[".png"]);
    place.run(&["render", "g.ron", "-o", "no/map.png"]).ended(2, &["no/map.png"]);
    place.run(&["render", "g.ron", "-o", "map.png", "--output", "step"]).ended(1, &["did you mean `steep`?"]);
    place.run(&["render", dem, "-o", "map.png", "--cells", "8"]).ended(1, &["`--cells` is for graph files"]);
    place
        .run(&["render", dem, "-o", "map.png", "--window", "0,0,1 km x 1 km"])
        .ended(1, &["`--window` is for graph files"]);
    place.run(&["render", dem, "-o", "map.png", "--cache-trust"]).ended(1, &["`--cache-trust` is for graph files"]);
    place.run(&["render", "none.tif", "-o", "map.png"]).ended(1, &["none.tif"]);
    fs::write(place.path("raw.r16"), [0; 32]).unwrap();
    place.run(&["render", "raw.r16", "-o", "map.png", "--cell", "30"]).ended(1, &["--range"]);
    place.run(&["render", "raw.r16", "-o", "raw.png", "--cell", "30", "--range", "0,100"]).done();
    // never over what is read
    for (from, to) in [("glencoe_48x64_u16.png", "dem.png"), ("glencoe_48x64_u16.png.json", "dem.png.json")] {
        fs::copy(repository(&format!("tests/data/{from}")), place.path(to)).expect("copied");
    }
    let before = place.bytes("dem.png");
    place.write("reads.ron", r#"(nodes: { "dem": Import(file: "dem.png") }, outputs: { "height": "dem" })"#);
    for read in ["dem.png", "reads.ron"] {
        place.run(&["render", read, "-o", "dem.png"]).ended(1, &["`dem.png` would be written over", "-o"]);
    }
    assert!(place.bytes("dem.png") == before);
}

/// Water leaves at voids: no basin is larger than the cells with data.
#[test]
fn rivers_do_not_run_through_voids() {
    let place = Place::new();
    let model = repository("tests/data/mandakini_basin_f32_nodata.tif");
    let ran = place.run(&["metrics", model.to_str().expect("plain name"), "--json"]).done();
    let value: serde_json::Value = serde_json::from_str(&ran.out).expect("JSON");
    let measures = value["measures"].as_array().expect("measures");
    let of = |name: &str| {
        let measure = measures.iter().find(|measure| measure["name"] == name).expect("measured");
        measure["value"].as_f64().expect("a number")
    };
    let words = ran.err.split_whitespace().collect::<Vec<_>>();
    let at = words.iter().position(|word| *word == "of").expect("the number of voids");
    let [voids, cells] = [words[at - 1], words[at + 1]].map(|word| word.parse::<f64>().expect("a number"));
    let known_m2 = (cells - voids) * of("cell_size") * of("cell_size");
    assert!(of("basin.area") <= known_m2, "{} of {known_m2}", of("basin.area"));
}

#[cfg(feature = "editor")]
#[test]
fn pictures_of_the_3d_view() {
    if crate::device::skips("pictures_of_the_3d_view") {
        return;
    }
    let place = Place::new();
    let wet = SMALL
        .replace("\"steep\": Slope(height: \"plain\"),", "\"lake\": Constant(value: 0.4),")
        .replace("\"steep\": \"steep\"", "\"lake\": \"lake\"");
    place.write("g.ron", &wet);
    let three_d = |out: &str, more: &[&str]| {
        place.run(&[&["render", "g.ron", "-o", out, "--view", "3d", "--size", "96x64"], more].concat())
    };
    three_d("one.png", &[]).done();
    three_d("two.png", &[]).done();
    assert!(place.bytes("one.png") == place.bytes("two.png"), "not the same twice");
    for (out, more) in [
        ("colour.png", &["--colour", "picture"][..]),
        ("sun.png", &["--sun", "90,12"]),
        ("near.png", &["--azimuth", "-30", "--elevation", "50", "--distance", "3 km"]),
        ("water.png", &["--water", "lake"]),
        ("sea.png", &["--sea", "720", "--contours", "100", "--haze", "0", "--exaggeration", "2"]),
    ] {
        three_d(out, more).done();
        assert!(place.bytes(out) != place.bytes("one.png"), "{more:?} does nothing");
    }
    three_d("no.png", &["--colour", "pictur"]).ended(1, &["did you mean `picture`?"]);
    three_d("no.png", &["--colour", "lake"]).ended(1, &["`--colour` takes colours"]);
    three_d("no.png", &["--output", "picture"]).ended(1, &["`--view 3d` shows heights"]);
    three_d("no.png", &["--elevation", "95"]).ended(1, &["--elevation"]);
    place.run(&["render", "g.ron", "-o", "no.png", "--sun", "90,12"]).ended(1, &["`--sun` is for `--view 3d`"]);
}

#[cfg(feature = "editor")]
#[test]
fn without_vulkan_one_line_names_what_to_install() {
    let place = Place::new();
    place.write("g.ron", SMALL);
    for backend in ["vulkan", "vulkan,gl"] {
        let mut blind = place.command(&["render", "g.ron", "-o", "no.png", "--view", "3d"]);
        let blind = blind
            .env("WGPU_BACKEND", backend)
            .env("VK_DRIVER_FILES", "/none.json")
            .env("VK_ICD_FILENAMES", "/none.json");
        let ran = super::Ran::from(blind.output().expect("the program starts"));
        let ran = ran.ended(2, &["error: ", "mesa-vulkan-drivers"]);
        assert!(["no graphics driver was found", "only OpenGL"].iter().any(|why| ran.err.contains(why)), "{}", ran.err);
        assert!(!place.path("no.png").exists());
    }
}

/// A driver that finds a device but cannot create it: one line says so, with a remedy, and no picture is written.
#[cfg(all(feature = "editor", target_os = "linux"))]
#[test]
fn a_driver_that_cannot_create_its_device_is_reported() {
    if crate::device::skips("a_driver_that_cannot_create_its_device_is_reported") {
        return;
    }
    let place = Place::new();
    place.write("g.ron", SMALL);
    let mut command = place.command(&["render", "g.ron", "-o", "no.png", "--view", "3d"]);
    let Some(command) = crate::refusing::make_driver_refuse(&mut command, &place.path(".")) else { return };
    let ran = super::Ran::from(command.output().expect("the program starts"));
    let ran = ran.ended(2, &["error: the graphics device failed", "update the graphics driver", "`VK_DRIVER_FILES`"]);
    assert!(!ran.err.contains("panicked") && !ran.err.contains(".rs"), "{}", ran.err);
    assert!(!place.path("no.png").exists());
}

#[test]
fn metrics_of_a_height_file_and_its_difference_from_another() {
    let place = Place::new();
    let dem = repository("tests/data/glencoe_128.tif");
    let dem = dem.to_str().expect("plain name");
    let text = place.run(&["metrics", dem]).done().out;
    assert!(text.contains("128 x 128 cells") && text.contains("hypsometric_integral"), "{text}");
    let text = place.run(&["metrics", dem, "--against", dem, "--json"]).done().out;
    let value: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!((&value["cells"][0], &value["difference"]["heights"]["largest_m"]), (&128.into(), &0.0.into()));
    assert_eq!(value["difference"]["compared"]["measures"][0]["name"], "score");
    let text = place.run(&["metrics", dem, "--against", "highlands"]).done().out;
    assert!(text.contains("against highlands") && text.contains("spreads") && text.contains("farthest"), "{text}");
    place.run(&["metrics", dem, "--against", "highlands", "--plots", "kind"]).done();
    let svg = std::fs::read_to_string(place.path("kind/slope_histogram.svg")).expect("a plot");
    assert!(svg.contains("glencoe"), "the curve of a real model is drawn");
    // the reference keeps the cells that it states
    let text = place.run(&["metrics", dem, "--cell", "7", "--against", dem, "--json"]).done().out;
    let value: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let apart = &value["difference"]["measures"][0];
    assert_eq!(apart["name"], "cell_size");
    assert_ne!(apart["value"], 0.0, "{text}");
    place.run(&["metrics", dem, "--against", "highland"]).ended(1, &["neither a file nor a kind", "`highlands`"]);
    place.run(&["metrics", dem, "--against", "moon"]).ended(1, &["neither a file nor a kind", "fluvial"]);
    let text = place.run(&["metrics", dem, "--against", dem, "--plots", "deep/plots", "--theme", "dark"]).done().out;
    assert!(text.contains("hypsometric_curve.svg"), "{text}");
    let names = place.names("deep/plots");
    assert!(names.len() >= 4 && names.len().is_multiple_of(2), "{names:?}");
    assert!(
        names.contains(&"hypsometric_curve.png".to_owned())
            && place.read("deep/plots/hypsometric_curve.svg").contains(dem)
    );
    place.write("file", "");
    place.run(&["metrics", dem, "--plots", "file/plots"]).ended(2, &["`file/plots` cannot be made", "--plots"]);
    place.run(&["metrics", dem, "--theme", "dark"]).ended(1, &["--plots"]);
    place.run(&["metrics", "none.tif"]).ended(1, &["none.tif", "check the name"]);
    place.run(&["metrics", dem, "--against", "."]).ended(1, &["folder"]);
    fs::write(place.path("short.tif"), &fs::read(dem).expect("readable")[..2000]).expect("written");
    place.run(&["metrics", "short.tif"]).ended(1, &["short.tif", "fetch or export"]);
}

#[test]
fn heights_for_engines_come_with_import_settings() {
    let place = Place::new();
    place.write("g.ron", &SMALL.replace("Constant(value: 700)", "Perlin"));
    for (engine, file, name, value) in [
        ("unreal", "height.png", "Overall Resolution", "127 x 127"),
        ("unity", "height.r16", "Terrain Width", "3200.0"),
        ("godot", "height.exr", "Vertex Spacing", "100.0"),
    ] {
        let ran = place.run(&["run", "g.ron", "-o", engine, "--engine", engine, "--dither"]).done();
        let line = ran.out.lines().find(|line| line.contains(name)).unwrap_or_else(|| panic!("{ran:?}"));
        assert!(line.trim_end().ends_with(value), "{line}");
        let text = place.read(&format!("{engine}/{file}.json"));
        let sidecar: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        let told = &sidecar["import"][name];
        assert_eq!(told.as_str().map_or_else(|| told.to_string(), str::to_owned), value, "{text}");
        assert!(place.names(engine).contains(&"steep.exr".to_owned()), "what is no height is as ever");
    }
    let map = place.path("unity/height.r16");
    assert_eq!(fs::metadata(map).expect("written").len(), 2 * 33 * 33);
    let ran = place.run(&["run", "g.ron", "-o", "mesh", "--mesh", "glb", "--triangles", "100", "--no-preview"]).done();
    assert!(ran.out.contains("height.glb"), "{ran:?}");
    assert_eq!(fs::read(place.path("mesh/height.glb")).expect("written")[..4], *b"glTF");
    place.run(&["run", "g.ron", "--mesh", "glb", "--triangles", "1"]).ended(1, &["2..="]);
    place.run(&["run", "g.ron", "--engine", "cry"]).ended(1, &["unreal"]);
}

/// Tiles have the range of the whole raster, and are its parts; what cannot be divided is refused before anything is
/// built.
#[test]
fn rasters_are_divided_into_tiles_of_one_range() {
    let place = Place::new();
    place.write(
        "g.ron",
        "(format: 1, world: (size: (640, 320), cells: (64, 32), boundary: open), nodes: { \"a\": \
        Perlin(amplitude: 300) }, outputs: { \"height\": \"a\" })\n",
    );
    place.run(&["run", "g.ron", "-o", "whole", "--format", "r16", "-q"]).done();
    place.run(&["run", "g.ron", "-o", "parts", "--format", "r16", "--tiles", "4x2", "-q"]).done();
    let whole = fs::read(place.path("whole/height.r16")).expect("codes");
    let range = |file: &str| {
        let text: serde_json::Value = serde_json::from_str(&place.read(file)).expect("JSON");
        (text["range"].clone(), text["origin_m"].clone())
    };
    for (column, row) in (0..4).flat_map(|column| (0..2).map(move |row| (column, row))) {
        let name = format!("parts/height_x{column}_y{row}.r16");
        let part = fs::read(place.path(&name)).expect("codes");
        for (y, codes) in part.chunks(2 * 16).enumerate() {
            let at = 2 * ((row * 16 + y) * 64 + column * 16);
            assert_eq!(codes, &whole[at..at + 2 * 16], "{name}, row {y}");
        }
        let (shared, origin) = range(&format!("{name}.json"));
        assert_eq!(shared, range("whole/height.r16.json").0, "{name}");
        assert_eq!(origin, serde_json::json!([column as f64 * 160.0, row as f64 * 160.0]), "{name}");
    }
    assert!(place.names("parts").contains(&"height.preview.png".to_owned()), "the preview stays whole");
    let refused = |options: &[&str], words: &[&str]| {
        place.run(&[&["run", "g.ron", "-o", "none"], options].concat()).ended(1, words);
        assert!(!place.path("none").exists());
    };
    refused(&["--tiles", "3"], &["64 x 32 cells", "63 or 66"]);
    refused(&["--tiles", "2", "--engine", "godot"], &["leave out `--tiles`"]);
    refused(&["--tiles", "2", "--window", "0,0,160 x 160"], &["--window"]);
    refused(&["--tiles", "100"], &["at most 64"]);
    let ran = place.run(&["run", "g.ron", "-o", "unreal", "--tiles", "2x1", "--engine", "unreal"]).done();
    assert!(ran.out.contains("height_x1_y0.png") && ran.out.contains("Location X"), "{ran:?}");
    assert!(place.read("unreal/unreal.txt").contains("settings of the first tile"));
    // its centre is 160 m east of that of the world, in centimetres; a window has its position too, in metres with z to
    // the north
    let setting = |file: &str, name: &str| {
        let text: serde_json::Value = serde_json::from_str(&place.read(file)).expect("JSON");
        text["import"][name].as_f64()
    };
    assert_eq!(setting("unreal/height_x1_y0.png.json", "Location X"), Some(16_000.0));
    place.run(&["run", "g.ron", "-o", "part", "--engine", "unity", "--window", "160,40,320 x 160", "-q"]).done();
    let [x, z] = ["Position X", "Position Z"].map(|name| setting("part/height.r16.json", name));
    assert_eq!((x, z), (Some(160.0), Some(120.0)));
    // the position is that of the world's cells, whatever the vertices of the engine
    place.run(&["run", "g.ron", "-o", "unity", "--tiles", "2", "--engine", "unity", "-q"]).done();
    assert_eq!(range("unity/height_x1_y1.r16.json").1, serde_json::json!([320.0, 160.0]));
    refused(&["--tiles", "3", "--engine", "unity"], &["64 x 32 cells"]);
    place.run(&["run", "g.ron", "-o", "single", "--tiles", "1", "--engine", "godot", "-q"]).done();
    assert!(place.names("single").contains(&"height.exr".to_owned()));
}

/// A world that is not square, with an output of every type that an engine imports and one that it does not.
const PAINTED: &str = r#"(
    format: 1,
    world: (size: (2000, 1000), cells: (100, 50), seed: 2),
    nodes: {
        "land": Ridged(wavelength: 700, amplitude: 200),
        "steep": Slope(height: "land", from: 10, to: 60, falloff: 10),
        "low": Select(value: "land", from: -500, to: 100, falloff: 60),
        "colour": Ramp(version: 2, value: "land", range: set, low: 0, high: 200),
        "normal": NormalMap(height: "land"),
        "layers": Splat(second: "steep.mask", fourth: "low"),
    },
    outputs: {
        "land": "land", "low": "low", "slope": "steep.slope", "colour": "colour", "normal": "normal", "layers": "layers",
    },
)"#;

#[test]
fn an_engine_gets_every_output_in_its_own_format() {
    let place = Place::new();
    place.write("g.ron", PAINTED);
    let size = |path: &str| {
        let bytes = place.bytes(path);
        assert_eq!(bytes[..4], *b"\x89PNG", "{path}");
        let number = |at: usize| u32::from_be_bytes(bytes[at..at + 4].try_into().expect("four bytes"));
        // columns and rows, bits per sample, colour type: 0 grey, 2 RGB, 6 RGBA
        (number(16), number(20), bytes[24], bytes[25])
    };
    let build = |engine: &str| place.run(&["run", "g.ron", "-o", engine, "--engine", engine, "--no-preview"]).done();

    build("unreal");
    assert_eq!(size("unreal/land.png"), (127, 127, 16, 0));
    assert_eq!(size("unreal/low.png"), (127, 127, 8, 0));
    assert_eq!((size("unreal/colour.png"), size("unreal/normal.png")), ((128, 64, 8, 2), (128, 64, 16, 2)));
    let layer = |name: &str| {
        assert_eq!(size(&format!("unreal/layers.{name}.png")), (127, 127, 8, 0));
        let path = place.path(&format!("unreal/layers.{name}.png"));
        orograph_nodes::raster::read(&path).expect("a raster").samples
    };
    let layers = ["first", "second", "fourth"].map(layer);
    assert!((0..127 * 127).all(|at| layers.iter().map(|layer| layer[at]).sum::<f32>() == 255.0));
    assert!(
        layers[2].iter().any(|v| *v > 0.0) && !place.path("unreal/layers.third.png").exists(),
        "nothing is wired to it"
    );
    let text = place.read("unreal/unreal.txt");
    for told in ["Unreal Engine", "land.png\n", "layers.fourth.png\n", "127 x 127", "Scale Z", "Mapping Scale"] {
        assert!(text.contains(told), "{told} in {text}");
    }
    assert!(!text.contains("slope.exr") && place.path("unreal/slope.exr").exists(), "as without an engine");
    assert_eq!(place.names("unreal").len(), 2 * 8 + 1);

    let ran = build("unity");
    assert!(ran.out.contains("unity.txt") && ran.out.contains("Tiling Settings, Size"), "{ran:?}");
    assert_eq!(place.bytes("unity/land.r16").len(), 2 * 129 * 129);
    assert_eq!((size("unity/low.png"), size("unity/layers.png")), ((128, 128, 8, 0), (128, 128, 8, 6)));
    assert!(place.read("unity/layers.png.json").contains("Control Texture Resolution"));

    build("godot");
    assert_eq!((size("godot/low.png"), size("godot/colour.png")), ((100, 50, 8, 0), (100, 50, 8, 6)));
    assert!(place.path("godot/land.exr").exists() && place.path("godot/layers.control.exr").exists());
    let text = place.read("godot/godot.txt");
    assert!(text.contains("Vertex Spacing") && text.contains("20"), "{text}");
    let one = place.bytes("godot/layers.control.exr");
    place.run(&["run", "g.ron", "-o", "godot", "--engine", "godot", "--threads", "1", "-q"]).done();
    assert!(place.bytes("godot/layers.control.exr") == one, "not the same twice");

    // a graph without masks, and one without any output for an engine
    place.run(&["run", "g.ron", "-o", "land", "--only", "land", "--engine", "unity", "-q"]).done();
    assert_eq!(place.names("land"), ["land.preview.png", "land.r16", "land.r16.json", "unity.txt"]);
    place.run(&["run", "g.ron", "-o", "slope", "--only", "slope", "--engine", "unity", "-q"]).done();
    assert_eq!(place.names("slope"), ["slope.exr", "slope.exr.json"]);
    place.write("g.ron", &PAINTED.replace("(2000, 1000), cells: (100, 50)", "(40000, 1), cells: (40000, 1)"));
    place.run(&["run", "g.ron", "--engine", "godot"]).ended(1, &["32768", "--cells"]);
}
