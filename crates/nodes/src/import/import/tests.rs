//! Tests of `Import`.

use std::path::PathBuf;

use orograph_graph::{Cancel, GeoPlace, ParamValue, Warnings, World};

use super::*;
use crate::{
    raster::{self, GridAxis, Raster, fill_voids, resample},
    testing::world,
};

pub(super) fn folder() -> PathBuf {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/data")).to_owned()
}

pub(super) fn params(file: &str, changes: &[(&'static str, ParamValue)]) -> ParamValues {
    let mut params = ParamValues::defaults(&Params::specs());
    params.set("file", ParamValue::File(file.to_owned()));
    for (name, value) in changes {
        params.set(name, value.clone());
    }
    params
}

pub(super) fn outputs(params: &ParamValues, window: Window, cancel: Cancel) -> Result<Field, NodeError> {
    told(params, window, cancel).map(|(field, _)| field)
}

/// Runs the node; returns its value and its warnings.
fn told(params: &ParamValues, window: Window, cancel: Cancel) -> Result<(Field, Vec<String>), NodeError> {
    all(params, window, cancel).map(|(mut outputs, told)| (field(&mut outputs, "value"), told))
}

pub(super) fn field(outputs: &mut Outputs, name: &str) -> Field {
    outputs.take(name).unwrap().as_field().unwrap().clone()
}

/// Runs the node; returns its outputs and its warnings.
pub(super) fn all(params: &ParamValues, window: Window, cancel: Cancel) -> Result<(Outputs, Vec<String>), NodeError> {
    let progress = |fraction: f32| assert!((0.0..=1.0).contains(&fraction));
    let job = Job {
        node: &NODE,
        params,
        inputs: Vec::new(),
        window,
        wanted: orograph_graph::Wanted::ALL,
        folder: folder(),
        cancel,
        progress: &progress,
        level: orograph_graph::LevelJob::default(),
        warnings: Warnings::default(),
        glimpses: None,
    };
    (NODE.cpu)(&job).map(|outputs| (outputs, job.warnings.take()))
}

pub(super) fn import(file: &str, world: World, changes: &[(&'static str, ParamValue)]) -> Field {
    outputs(&params(file, changes), Window::whole(world), Cancel::default()).unwrap()
}

pub(super) fn choice(name: &'static str) -> ParamValue {
    ParamValue::Choice(name)
}

pub(super) fn mean(samples: &[f32]) -> f64 {
    samples.iter().map(|v| f64::from(*v)).sum::<f64>() / samples.len() as f64
}

#[test]
fn cells_of_equal_size_are_copied() {
    let source = raster::read(&folder().join("glencoe_128.tif")).unwrap();
    let same = import("glencoe_128.tif", world(128, 128, 50.0), &[]);
    assert_eq!(same.samples(), source.samples);
    // an odd number of cells centred in an even one; beyond it the values of the edge, or a level
    let large = import("glencoe_128.tif", world(131, 131, 50.0), &[]);
    let level = [("beyond", choice("level")), ("level", ParamValue::Float(-7.0))];
    let framed = import("glencoe_128.tif", world(131, 131, 50.0), &level);
    let first = (0..131).find(|i| framed.samples()[65 * 131 + i] != -7.0).unwrap();
    for (j, row) in source.samples.chunks_exact(128).enumerate() {
        let at = (j + first) * 131 + first;
        assert_eq!(&large.samples()[at..at + 128], row);
        assert_eq!(&framed.samples()[at..at + 128], row);
    }
    assert_eq!(large.samples()[0], source.samples[0]);
    assert_eq!(framed.samples()[0], -7.0);
    assert_eq!(framed.samples().iter().filter(|v| **v == -7.0).count(), 131 * 131 - 128 * 128);
}

#[test]
fn larger_cells_keep_the_volume() {
    let source = mean(&raster::read(&folder().join("glencoe_128.tif")).unwrap().samples);
    for cells in [64, 37, 5, 1] {
        let coarse = import("glencoe_128.tif", world(cells, cells, 6400.0 / f64::from(cells)), &[]);
        // rounding to single precision of means below 1400 m
        assert!((mean(coarse.samples()) - source).abs() < 1e-3, "{cells}");
    }
    // at true scale, a world of half the size shows the middle half, with either origin
    let corner = import("glencoe_128.tif", world(32, 32, 100.0), &[("placement", choice("corner"))]);
    let stretched = import("glencoe_128.tif", world(32, 32, 100.0), &[("placement", choice("stretch"))]);
    assert_ne!(corner, stretched);
    let whole = import("glencoe_128.tif", world(64, 64, 100.0), &[]);
    assert_eq!(corner.samples()[..32], whole.samples()[..32]);
    let centred = import("glencoe_128.tif", world(32, 32, 100.0), &[]);
    assert_eq!(centred.samples()[..32], whole.samples()[16 * 64 + 16..16 * 64 + 48]);
}

#[test]
fn degrees_become_metres() {
    // 60 x 40 cells of 3 arc-seconds near 40 degrees north: 70.9 m by 92.5 m each, so 4257 m by 3701 m.
    let world = World { size: [4257.0, 3701.0], cells: [4257, 3701], ..World::default() };
    let level = [("beyond", choice("level")), ("level", ParamValue::Float(-1.0))];
    let field = import("frontrange_3arcsec.asc", world, &level);
    let outside = field.samples().iter().filter(|v| **v == -1.0).count();
    // the raster fills the world to within a few metres
    assert!(outside < 8 * (4257 + 3701), "{outside} m² are outside");
    let source = raster::read(&folder().join("frontrange_3arcsec.asc")).unwrap();
    let (row, column) = (30, 50);
    let (x, y) = ((column as f64 + 0.5) * 70.95, (row as f64 + 0.5) * 92.53);
    let found = field.samples()[y as usize * 4257 + x as usize];
    // within a metre of a cell's centre, on a slope below one
    assert!((found - source.samples[row * 60 + column]).abs() < 1.5);
}

#[test]
fn voids_are_filled_or_levelled() {
    let file = "mandakini_basin_f32_nodata.tif";
    let source = raster::read(&folder().join(file)).unwrap();
    let (lo, hi) = source
        .samples
        .iter()
        .filter(|v| !v.is_nan())
        .fold((f32::MAX, f32::MIN), |(lo, hi), v| (lo.min(*v), hi.max(*v)));
    let stretch = ("placement", choice("stretch"));
    let filled = import(file, world(100, 100, 10.0), std::slice::from_ref(&stretch));
    let levelled = import(file, world(100, 100, 10.0), &[stretch, ("voids", choice("level"))]);
    for ((before, filled), levelled) in source.samples.iter().zip(filled.samples()).zip(levelled.samples()) {
        if before.is_nan() {
            assert!((lo..=hi).contains(filled) && *levelled == 0.0);
        } else {
            assert!(filled == before && levelled == before);
        }
    }
}

/// At its coordinates, a raster fills the world that has its place; a world moved by whole cells shows other cells of
/// it, and a part equals that part of the whole.
#[test]
fn a_raster_is_placed_by_its_coordinates() {
    let file = "bigtujunga_i16_tiled.tif";
    let source = raster::read(&folder().join(file)).unwrap();
    let (epsg, [x, y]) = (source.head.epsg.unwrap(), source.head.origin.unwrap());
    let place = |corner_m| Some(GeoPlace { epsg, corner_m });
    let place_at = |world: World, place| World { place, ..world };
    let params = params(file, &[("placement", choice("place"))]);
    let import = |world: World| outputs(&params, Window::whole(world), Cancel::default());
    let same = import(place_at(world(90, 70, 30.0), place([x, y]))).unwrap();
    assert_eq!(same.samples(), source.samples);
    let moved = place_at(world(40, 30, 30.0), place([x + 300.0, y - 600.0]));
    let found = import(moved).unwrap();
    for (j, row) in found.samples().chunks_exact(40).enumerate() {
        assert_eq!(row, &source.samples[(j + 20) * 90 + 10..][..40]);
    }
    // by a third of a cell: neither moved to whole cells nor different in a part
    let between = place_at(world(40, 30, 30.0), place([x + 310.0, y - 600.0]));
    let whole = import(between).unwrap();
    assert_ne!(whole.samples(), found.samples());
    let part = Window { origin: [7, 5], cells: [20, 11], ..Window::whole(between) };
    assert_eq!(outputs(&params, part, Cancel::default()).unwrap(), whole.crop(&part));
    for (world, told) in [
        (world(40, 30, 30.0), "no place on Earth"),
        (place_at(world(40, 30, 30.0), place([x + 1e5, y])), "outside of the world"),
        (
            place_at(world(40, 30, 30.0), Some(GeoPlace { epsg: 26_711, corner_m: [x, y] })),
            "gdalwarp -t_srs EPSG:26711",
        ),
    ] {
        let error = format!("{:?}", import(world).unwrap_err());
        assert!(error.contains(told), "{error}");
    }
}

/// Whether voids are filled or set to a level, on the cells of the file and on larger ones.
#[test]
fn data_marks_the_voids_and_what_is_beyond() {
    let file = "mandakini_basin_f32_nodata.tif";
    let source = raster::read(&folder().join(file)).unwrap();
    let stretch = ("placement", choice("stretch"));
    let data = |file: &str, world: World, changes: &[(&'static str, ParamValue)]| {
        field(&mut all(&params(file, changes), Window::whole(world), Cancel::default()).unwrap().0, "data")
    };
    let same = world(source.head.columns as u32, source.head.rows as u32, 10.0);
    for voids in ["fill", "level"] {
        let changes = [stretch.clone(), ("voids", choice(voids))];
        let found = data(file, same, &changes);
        let expected = source.samples.iter().map(|v| f32::from(u8::from(!v.is_nan())));
        assert!(found.samples().iter().copied().eq(expected), "{voids}");
        // larger cells have fractions, with the same sum but for rounding
        let coarse = data(file, world(25, 25, 40.0), &changes);
        assert!((mean(coarse.samples()) - mean(found.samples())).abs() < 1e-6);
    }
    // without voids, everything but what is beyond the file
    let framed = data("glencoe_128.tif", world(130, 130, 50.0), &[]);
    assert_eq!(framed.samples().iter().filter(|v| **v == 1.0).count(), 128 * 128);
    assert_eq!(framed.samples().iter().filter(|v| **v == 0.0).count(), 130 * 130 - 128 * 128);
}

#[test]
fn codes_span_a_mask_and_a_file_without_cells_is_stretched() {
    let file = "glencoe_48x64_u16.png";
    let field = import(file, world(48, 64, 3.0), &[]);
    // the range from its sidecar
    assert_eq!(field.range(0), Some((11.7, 709.8)));
    let alone = tempfile::tempdir().unwrap();
    let copy = alone.path().join("alone.png");
    std::fs::copy(folder().join(file), &copy).unwrap();
    let copy = copy.to_str().unwrap();
    let mask = import(copy, world(48, 64, 3.0), &[("quantity", choice("mask"))]);
    assert_eq!(mask.range(0), Some((0.0, 1.0)));
    let range = ("range", ParamValue::Point([-50.0, 250.0]));
    assert_eq!(import(copy, world(48, 64, 3.0), &[range]).range(0), Some((-50.0, 250.0)));
}

#[test]
fn every_assumption_is_told() {
    let told = |file: &str, changes: &[(&'static str, ParamValue)]| {
        told(&params(file, changes), Window::whole(world(30, 30, 50.0)), Cancel::default()).unwrap().1.join("\n")
    };
    let stretch = ("placement", choice("stretch"));
    assert_eq!(told("glencoe_128.tif", &[]), "");
    assert!(told("frontrange_3arcsec.asc", &[]).contains("longitude and latitude"));
    let basin = "mandakini_basin_f32_nodata.tif";
    assert!(told(basin, std::slice::from_ref(&stretch)).contains("have no data and are filled"));
    assert!(told(basin, &[stretch, ("voids", choice("level"))]).contains("have no data and are set to `level`"));
    let alone = tempfile::tempdir().unwrap();
    let copy = alone.path().join("alone.png");
    std::fs::copy(folder().join("glencoe_48x64_u16.png"), &copy).unwrap();
    let copy = copy.to_str().unwrap();
    assert!(told(copy, &[]).contains("no cell size"));
    let cell = ("cell", ParamValue::Float(50.0));
    assert!(told(copy, std::slice::from_ref(&cell)).contains("is taken for 0 m to 1 km; set `range`"));
    assert_eq!(told(copy, &[cell, ("range", ParamValue::Point([11.7, 709.8]))]), "");
}

#[test]
fn a_window_equals_its_part_of_the_whole() {
    for (file, cell_m) in [("glencoe_128.tif", 50.0), ("glencoe_128.tif", 17.3), ("frontrange_3arcsec.asc", 210.0)] {
        let params = params(file, &[("beyond", choice("level"))]);
        let whole = Window::whole(world(60, 50, cell_m));
        let part = Window { origin: [13, 9], cells: [30, 22], ..whole };
        let all = outputs(&params, whole, Cancel::default()).unwrap();
        assert_eq!(outputs(&params, part, Cancel::default()).unwrap(), all.crop(&part), "{file}");
    }
}

/// Voids in every second block of a raster of many strips, whose pyramid has a level in memory above the first.
#[test]
fn a_large_raster_is_filled_like_the_whole() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("large.r32");
    let (columns, rows) = (1500, 1500);
    let hole = |i: usize, j: usize| (j / 100).is_multiple_of(2) && (i + j) % 200 < 90;
    let source: Vec<f32> = (0..columns * rows)
        .map(|at| if hole(at % columns, at / columns) { f32::NAN } else { (at * 7919 % 1009) as f32 * 0.37 })
        .collect();
    std::fs::write(&path, source.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>()).expect("written");
    let mut filled = source.clone();
    fill_voids(columns, rows, &mut filled, &|| Ok(())).expect("filled");
    for cells in [1500, 16] {
        let axes = [GridAxis { source: 1500, offset: 0.0, step: 1500.0 / f64::from(cells) }.snapped(); 2];
        let resampled =
            |samples: &[f32]| resample(samples, axes, [0, 0], [cells; 2], None, &|| Ok(())).expect("resampled");
        let params = params(path.to_str().expect("text"), &[("placement", choice("stretch"))]);
        let window = Window::whole(world(cells, cells, 10.0));
        let (mut outputs, _) = all(&params, window, Cancel::default()).expect("a result");
        assert!(field(&mut outputs, "value").samples() == resampled(&filled), "{cells}");
        let known: Vec<f32> = source.iter().map(|v| f32::from(u8::from(!v.is_nan()))).collect();
        assert!(field(&mut outputs, "data").samples() == resampled(&known), "{cells}");
    }
}

/// Rows that are resampled as they are read give the bits of the whole raster.
#[test]
fn every_file_gives_the_bits_of_the_whole_raster() {
    let files = std::fs::read_dir(folder()).unwrap().map(|entry| entry.unwrap().path());
    let files: Vec<_> = files.filter(|path| Reader::open(path).is_ok()).collect();
    assert!(files.len() >= 20);
    for path in files {
        for (cells, cell_m) in [(5, 900.0), (97, 31.7)] {
            let world = world(cells, cells, cell_m);
            let name = path.to_str().unwrap();
            let found = import(name, world, &[("placement", choice("stretch"))]);
            let Raster { head, mut samples, .. } = raster::read(&path).unwrap().decoded([0.0, 1000.0]);
            fill_voids(head.columns, head.rows, &mut samples, &|| Ok(())).unwrap();
            let axes = [head.columns, head.rows]
                .map(|source| GridAxis { source, offset: 0.0, step: source as f64 / f64::from(cells) }.snapped());
            let whole = resample(&samples, axes, [0, 0], [cells; 2], None, &|| Ok(())).unwrap();
            assert!(found.samples() == whole, "{name} on {cells} cells");
        }
    }
}

#[test]
fn what_is_wrong_is_said_with_a_remedy() {
    let fails =
        |file: &str, cancel: Cancel| outputs(&params(file, &[]), Window::whole(world(4, 4, 50.0)), cancel).unwrap_err();
    for (file, words) in
        [("", "no file"), ("none.tif", "no such file"), (".", "folder"), ("README.md", "format is not known")]
    {
        let NodeError::Failed { message, hint } = fails(file, Cancel::default()) else { panic!("cancelled") };
        assert!(message.contains(words) && hint.is_some(), "{message}");
    }
    let cancel = Cancel::default();
    cancel.cancel();
    assert_eq!(fails("glencoe_128.tif", cancel), NodeError::Cancelled);
}
