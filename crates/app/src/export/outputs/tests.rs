//! Tests of outputs as files: whole, in bands, of windows.

use std::{collections::BTreeMap, fs, path::Path};

use orograph_graph::{
    Area, Cancel, Field, Line, Lines, OutputDecl, Port, PortType, Unit, Value, Vertex, Window, World, mix,
};
use orograph_nodes::{numerics::math, raster::Format};

use crate::export::outputs::*;
use crate::export::{engine::Engine, mesh::MeshFormat};

const TYPES: [(&str, PortType); 7] = [
    ("height", PortType::Height),
    ("mask", PortType::Mask),
    ("scalar", PortType::Scalar(Unit::SquareMetres)),
    ("vector", PortType::Vector(Unit::One)),
    ("colour", PortType::Colour),
    ("normal", PortType::Normal),
    ("weights", PortType::Weights),
];

fn outputs() -> Vec<OutputDecl> {
    let output = |(name, ty): (&str, PortType)| OutputDecl {
        name: name.to_owned(),
        port: Port { node: Default::default(), output: 0 },
        ty,
        layers: [true; 4],
        span: 0..0,
    };
    TYPES.into_iter().map(output).collect()
}

/// A value of a type, with more than 2048 cells along a side.
fn value(ty: PortType) -> Field {
    let cells = [70_u32, 2100];
    let window = Window::whole(World { size: cells.map(|n| f64::from(n) * 5.0), cells, ..World::default() });
    let planes = match ty {
        PortType::Vector(_) => 2,
        PortType::Colour | PortType::Normal => 3,
        PortType::Weights => 4,
        _ => 1,
    };
    let sample = |at: usize| {
        let wave = (math::sin((at % 70) as f64 * 0.1) * math::cos((at / 70) as f64 * 0.02)) as f32;
        let share = 0.5 + 0.4 * wave + (mix(at as u32) % 100) as f32 * 1e-4;
        if ty == PortType::Height { share * 900.0 } else { share }
    };
    Field::with_planes(window, planes, (0..planes * window.len()).map(sample).collect())
}

fn rows(field: &Field, from: u32, to: u32) -> Field {
    let [west, north] = field.window().origin;
    let cells = [field.window().cells[0], to - from];
    field.crop(&Window { origin: [west, north + from], cells, ..*field.window() })
}

/// Names and contents of the files of a folder.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry"));
    entries
        .map(|entry| (entry.file_name().to_string_lossy().into_owned(), fs::read(entry.path()).expect("a file")))
        .collect()
}

/// Every output whole, one after the other.
fn write_whole(folder: &Path, options: &OutputOptions) -> Vec<Written> {
    let (outputs, cancel) = (outputs(), Cancel::default());
    let staging = OutputFolder::prepare(folder, &outputs, options).expect("a folder");
    for output in &outputs {
        let field = value(output.ty);
        let world = field.window().world;
        staging.write(output, &Value::Field(field), &Window::whole(world), "key", &cancel).expect("written");
    }
    staging.commit().expect("in place")
}

/// The same with all writers open at once, each on its own thread; streamable outputs are written in bands.
fn write_bands(folder: &Path, options: &OutputOptions) -> Vec<Written> {
    let (outputs, cancel) = (outputs(), Cancel::default());
    let staging = OutputFolder::prepare(folder, &outputs, options).expect("a folder");
    std::thread::scope(|scope| {
        for output in outputs.iter().rev() {
            let (staging, cancel) = (&staging, &cancel);
            scope.spawn(move || {
                let field = value(output.ty);
                let mut writer = staging.writer(output, field.window()).expect("a writer");
                let step = if writer.is_streamable() { 37 } else { 2100 };
                for first in (0..2100).step_by(step) {
                    let band = rows(&field, first, (first + step as u32).min(2100));
                    writer.rows(&band, cancel).expect("the next rows");
                }
                writer.finish("key", cancel).expect("complete");
            });
        }
    });
    staging.commit().expect("in place")
}

#[test]
fn outputs_do_not_depend_on_the_bands() {
    let of = |format: Format| OutputOptions { format, ..OutputOptions::default() };
    let forms = [
        of(Format::Exr),
        OutputOptions { dither: true, ..of(Format::Png16) },
        OutputOptions { no_preview: true, ..of(Format::Tiff) },
        OutputOptions { mesh: Some(MeshFormat::Glb), triangles: 2000, ..of(Format::R32) },
        OutputOptions { engine: Some(Engine::Godot), ..of(Format::R16) },
    ];
    for options in forms {
        let places = [0, 1].map(|_| tempfile::tempdir().expect("a folder"));
        let [whole, bands] = places.each_ref().map(|place| place.path());
        let (written, again) = (write_whole(whole, &options), write_bands(bands, &options));
        assert!(files(whole) == files(bands), "{options:?}");
        let about = |written: &[Written]| -> Vec<_> {
            let name = |file: &Written| file.path.file_name().map(|name| name.to_owned());
            written.iter().map(|file| (file.output.clone(), name(file), file.what, file.bytes, file.range)).collect()
        };
        assert_eq!(about(&written), about(&again));
        let order: Vec<&str> =
            written.iter().map(|file| file.output.as_str()).filter(|name| !name.is_empty()).collect();
        let place = |name: &str| TYPES.iter().position(|(known, _)| *known == name);
        assert!(order.is_sorted_by_key(|name| place(name)), "{order:?}");
    }
}

#[test]
fn outputs_that_need_the_whole_raster_are_not_streamable() {
    let streamable = |options: &OutputOptions| -> Vec<&str> {
        let place = tempfile::tempdir().expect("a folder");
        let outputs = outputs();
        let staging = OutputFolder::prepare(place.path(), &outputs, options).expect("a folder");
        let can = |output: &&OutputDecl| {
            let field = value(output.ty);
            let mut writer = staging.writer(output, field.window()).expect("a writer");
            let first = writer.rows(&rows(&field, 0, 10), &Cancel::default());
            assert_eq!(first.is_ok(), writer.is_streamable(), "{}", output.name);
            writer.is_streamable()
        };
        let kept: Vec<String> = outputs.iter().filter(can).map(|output| output.name.clone()).collect();
        TYPES.iter().map(|(name, _)| *name).filter(|name| kept.iter().any(|kept| kept == name)).collect()
    };
    let all: Vec<&str> = TYPES.iter().map(|(name, _)| *name).collect();
    assert_eq!(streamable(&OutputOptions::default()), all);
    let codes = OutputOptions { format: Format::Png16, ..OutputOptions::default() };
    assert_eq!(streamable(&codes), ["mask", "colour", "normal", "weights"]);
    assert_eq!(streamable(&OutputOptions { mesh: Some(MeshFormat::Obj), ..OutputOptions::default() }), all[1..]);
    assert_eq!(
        streamable(&OutputOptions { engine: Some(Engine::Unreal), ..OutputOptions::default() }),
        ["scalar", "vector"]
    );
}

#[test]
fn a_cancelled_write_leaves_nothing() {
    let place = tempfile::tempdir().expect("a folder");
    let (outputs, cancel) = (outputs(), Cancel::default());
    let staging =
        OutputFolder::prepare(&place.path().join("out"), &outputs, &OutputOptions::default()).expect("a folder");
    let field = value(outputs[0].ty);
    let mut writer = staging.writer(&outputs[0], field.window()).expect("a writer");
    writer.rows(&rows(&field, 0, 1000), &cancel).expect("the first rows");
    let failure = writer.rows(&rows(&field, 990, 1100), &cancel).expect_err("out of order");
    assert!(failure.message.contains("rows 990 to 1100 come where 1000"), "{failure}");
    drop(writer);
    let mut writer = staging.writer(&outputs[0], field.window()).expect("a writer");
    writer.rows(&rows(&field, 0, 1000), &cancel).expect("the first rows");
    let failure = writer.finish("key", &cancel).expect_err("rows are missing");
    assert!(failure.message.contains("last row"), "{failure}");
    drop(staging);
    assert_eq!(fs::read_dir(place.path()).expect("a folder").count(), 0);
}

/// Every file of a window states its position: in a side file, and, for rasters with their own grid, also in itself.
#[test]
fn files_of_a_window_carry_their_origin() {
    for engine in [None, Some(Engine::Unreal)] {
        let place = tempfile::tempdir().expect("a folder");
        let options = OutputOptions { engine, no_preview: true, ..OutputOptions::default() };
        let outputs = outputs();
        let staging = OutputFolder::prepare(place.path(), &outputs, &options).expect("a folder");
        for output in &outputs {
            let whole = value(output.ty);
            let part = whole.crop(&Window { origin: [10, 1000], cells: [60, 80], ..*whole.window() });
            let world = whole.window().world;
            staging
                .write(output, &Value::Field(part), &Window::whole(world), "key", &Cancel::default())
                .expect("written");
        }
        let written = staging.commit().expect("in place");
        let rasters: Vec<&Written> = written.iter().filter(|file| !file.output.is_empty()).collect();
        assert!(rasters.len() >= 8, "{rasters:?}");
        for file in rasters {
            let beside = orograph_nodes::raster::sidecar_path(&file.path);
            let json: serde_json::Value = serde_json::from_slice(&fs::read(beside).expect("there")).expect("JSON");
            assert_eq!(json["origin_m"], serde_json::json!([50.0, 5000.0]), "{}", file.path.display());
            assert_eq!(json["origin_cells"], serde_json::json!([10, 1000]));
            assert_eq!(json["world_cells"], serde_json::json!([70, 2100]));
        }
    }
}

#[test]
fn a_failed_build_leaves_nothing() {
    let root = tempfile::tempdir().expect("a folder");
    let options = OutputOptions { triangles: 2, ..OutputOptions::default() };
    let folder = root.path().join("a/b");
    let prepared = OutputFolder::prepare(&folder, &[], &options).expect("can be made");
    assert!(folder.is_dir());
    drop(prepared);
    assert_eq!(fs::read_dir(root.path()).expect("is there").count(), 0);
    let file = root.path().join("file");
    fs::write(&file, "x").expect("written");
    for folder in [file.clone(), file.join("below")] {
        let failure = OutputFolder::prepare(&folder, &[], &options).expect_err("a file is there");
        assert_eq!(failure.exit, crate::Exit::Unable, "{failure}");
    }
}

/// A rename that fails, here because a folder is in the way, takes back those before it.
#[test]
fn a_failed_rename_leaves_earlier_files() {
    let place = tempfile::tempdir().expect("a folder");
    let (outputs, options) = (outputs(), OutputOptions { no_preview: true, ..OutputOptions::default() });
    let write = |staging: &OutputFolder, output: &OutputDecl| {
        let field = value(output.ty);
        let world = field.window().world;
        staging.write(output, &Value::Field(field), &Window::whole(world), "key", &Cancel::default()).expect("written");
    };
    let first = &outputs[..1];
    let staging = OutputFolder::prepare(place.path(), first, &options).expect("a folder");
    write(&staging, &first[0]);
    let written = staging.commit().expect("in place");
    fs::write(&written[0].path, "earlier").expect("written");

    let staging = OutputFolder::prepare(place.path(), &outputs, &options).expect("a folder");
    outputs.iter().for_each(|output| write(&staging, output));
    let last = outputs.last().expect("outputs");
    let way = place.path().join(super::names::names(last, &options).remove(0));
    fs::create_dir_all(way.join("in the way")).expect("made");
    let failure = staging.commit().expect_err("a folder is there");
    assert!(failure.hint.is_some_and(|hint| hint.contains("unchanged")), "{}", failure.message);
    assert_eq!(fs::read_to_string(&written[0].path).expect("there"), "earlier");
    let files = fs::read_dir(place.path())
        .expect("a folder")
        .filter(|entry| entry.as_ref().is_ok_and(|entry| entry.path().is_file()));
    assert_eq!(files.count(), 2, "the earlier raster and its side file");
}

/// Where a build finds no lakes, the water of the build before is removed; textures of a window lie on its water.
#[test]
fn water_of_an_earlier_build_goes() {
    let place = tempfile::tempdir().expect("a folder");
    let options = OutputOptions { mesh: Some(MeshFormat::Obj), ..OutputOptions::default() };
    let lakes = OutputDecl { name: "lakes".to_owned(), ty: PortType::Lines, ..outputs().remove(0) };
    let world = World { size: [100.0, 80.0], cells: [10, 8], ..World::default() };
    let window = Window { origin: [2, 4], cells: [5, 4], ..Window::whole(world) };
    let build = |lines: Lines| {
        let staging = OutputFolder::prepare(place.path(), std::slice::from_ref(&lakes), &options).expect("a folder");
        staging.write(&lakes, &Value::from(lines), &window, "key", &Cancel::default()).expect("written");
        staging.commit().expect("in place");
    };
    let corners = [[20.0, 40.0], [20.0, 80.0], [70.0, 80.0], [70.0, 40.0], [20.0, 40.0]];
    let vertices = corners.map(|position_m| Vertex { position_m, ..Vertex::default() }).to_vec();
    let shore = Line { order: 1, downstream: None, vertices };
    let area = Area { rings: 1, level_m: 5.0, ..Area::default() };
    build(Lines { areas: vec![area], ..Lines::open(vec![shore]) });
    let water = fs::read_to_string(place.path().join("lakes.obj")).expect("water");
    // a lake that fills the window has all of its texture
    let mut corners: Vec<&str> = water.lines().filter(|line| line.starts_with("vt ")).collect();
    corners.sort_unstable();
    assert_eq!(corners, ["vt 0 0", "vt 0 1", "vt 1 0", "vt 1 1"], "{water}");
    build(Lines::default());
    assert_eq!(files(place.path()).into_keys().collect::<Vec<_>>(), ["lakes.geojson"]);
}
