//! Tests of the writer: files do not depend on the number of rows per call.

use std::{
    fs,
    path::{Path, PathBuf},
};

use orograph_graph::{Field, Window, World, mix};
use tempfile::TempDir;

use super::*;
use crate::numerics::math;

/// Values of several planes in a world of 640 x 2100 cells of 5 m, which need several blocks and bands in every
/// format.
fn planes(count: usize, value: impl Fn(usize, usize, usize) -> f32) -> Field {
    let cells = [640_u32, 2100];
    let world = World { size: cells.map(|n| f64::from(n) * 5.0), cells, ..World::default() };
    let window = Window::whole(world);
    let (nx, ny) = (window.nx(), window.ny());
    let mut samples = Vec::with_capacity(count * window.len());
    for plane in 0..count {
        for j in 0..ny {
            samples.extend((0..nx).map(|i| value(plane, i, j)));
        }
    }
    Field::with_planes(window, count, samples)
}

fn land() -> Field {
    planes(2, |plane, i, j| {
        let bump = (math::sin(i as f64 * 0.01) * math::cos(j as f64 * 0.007)) as f32;
        bump * 900.0 + (plane * 50) as f32 + (mix((i * 7 + j) as u32) % 100) as f32 * 0.01
    })
}

/// Uniform noise from 0 to 1: incompressible.
fn noise() -> Field {
    planes(4, |plane, i, j| mix(mix((plane * 640 + i) as u32) ^ j as u32) as f32 / 4_294_967_296.0)
}

fn with_voids() -> Field {
    planes(1, |_, i, j| if i == j && j > 300 { f32::NAN } else { (i + j) as f32 })
}

/// Every content that can be written, with a field for it.
fn everything() -> Vec<(&'static str, Content, Field)> {
    let numbers = |format, range: Option<[f64; 2]>| {
        Content::Numbers(format, Writing { range, dither: range.is_some(), ..Writing::default() })
    };
    let mut all = Vec::new();
    for format in Format::ALL {
        all.push((format.name(), numbers(format, None), land()));
        all.push((format.name(), numbers(format, Some([0.0, 1.0])), noise()));
    }
    let second = Content::Numbers(Format::Exr, Writing { plane: 1, red: true, ..Writing::default() });
    all.push(("plane", second, land()));
    for format in [Format::Exr, Format::Tiff, Format::Cog, Format::R32] {
        all.push((format.name(), numbers(format, None), with_voids()));
    }
    for content in [Content::Colour, Content::Tint, Content::Normal, Content::Weights, Content::Control] {
        all.push(("picture", content, noise()));
    }
    all
}

/// Rows `from..to` of a raster.
fn band(field: &Field, from: u32, to: u32) -> Field {
    let window = field.window();
    let origin = [window.origin[0], window.origin[1] + from];
    field.crop(&Window { origin, cells: [window.cells[0], to - from], ..*window })
}

/// Writes a field in bands that end at these rows; returns the bytes of the file and of its sidecar.
fn written(path: &Path, content: Content, field: &Field, ends: &[u32]) -> [Vec<u8>; 2] {
    let mut writer = Writer::begin(path, *field.window(), content.over(field)).expect("begun");
    let mut from = 0;
    for to in ends {
        writer.rows(&band(field, from, *to), &|| true).expect("the next rows");
        from = *to;
    }
    writer.finish(Some(&Meta::default()), &|| true).expect("complete");
    [path.to_owned(), sidecar_path(path)].map(|path| fs::read(path).expect("there"))
}

#[test]
fn files_do_not_depend_on_the_bands() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("file");
    for (case, (name, content, field)) in everything().into_iter().enumerate() {
        let rows = field.window().cells[1];
        let whole = written(&path, content, &field, &[rows]);
        let mut ends = vec![1];
        while let Some(last) = ends.last().copied().filter(|last| *last < rows) {
            let most = [3, 40, 900][mix(last) as usize % 3];
            ends.push((last + 1 + mix(last ^ case as u32) % most).min(rows));
        }
        let bands = written(&path, content, &field, &ends);
        assert!(bands == whole, "{name}, {content:?}: {} bands", ends.len());
        let thirds = written(&path, content, &field, &[rows / 3, rows / 3 * 2, rows]);
        assert!(thirds == whole, "{name}, {content:?}: thirds");
    }
}

/// The `exr` crate, which needs the whole raster, writes the same bytes.
#[test]
fn exr_is_what_the_crate_writes() {
    use ::exr::prelude::*;
    let folder = tempfile::tempdir().expect("a folder");
    let (path, field) = (folder.path().join("a.exr"), land());
    for (red, name) in [(false, "Y"), (true, "R")] {
        let writing = Writing { red, ..Writing::default() };
        let [ours, _] = written(&path, super::Content::Numbers(Format::Exr, writing), &field, &[100, 2100]);
        let channel = AnyChannel::new(name, FlatSamples::F32(field.plane(0).to_vec()));
        let attributes = LayerAttributes::named("height");
        let channels = AnyChannels::sort(SmallVec::from_elem(channel, 1));
        let layer = Layer::new((640, 2100), attributes, Encoding::UNCOMPRESSED, channels);
        let mut theirs = std::io::Cursor::new(Vec::new());
        Image::from_layer(layer).write().non_parallel().to_buffered(&mut theirs).expect("memory");
        assert!(ours == theirs.into_inner());
    }
}

/// Noise exercises the fallback for files that compression would lengthen.
#[test]
fn noise_is_stored() {
    let folder = tempfile::tempdir().expect("a folder");
    let (path, field) = (folder.path().join("a.png"), noise());
    let [bytes, _] = written(&path, Content::Weights, &field, &[2100]);
    let cells = 4 * field.window().len();
    assert!((cells..cells + cells / 1000 + 1000).contains(&bytes.len()), "{} of {cells}", bytes.len());
    let picture = image::load_from_memory(&bytes).expect("a picture").into_rgba8();
    let expected = texture::apportioned(&field);
    for (at, pixel) in picture.pixels().enumerate() {
        let shares = [0, 1, 2, 3].map(|plane| (expected.plane(plane)[at] * 255.0).round() as u8);
        assert_eq!(pixel.0, shares, "at {at}");
    }
    assert_eq!(left(&folder), 2);
}

/// Returns the number of files in a folder.
fn left(folder: &TempDir) -> usize {
    fs::read_dir(folder.path()).expect("a folder").count()
}

#[test]
fn what_is_dropped_half_way_leaves_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    for (_, content, field) in everything() {
        let mut writer = Writer::begin(&folder.path().join("a"), *field.window(), content.over(&field)).expect("begun");
        writer.rows(&band(&field, 0, 1500), &|| true).expect("the first rows");
        drop(writer);
        assert_eq!(left(&folder), 0, "{content:?}");
    }
}

#[test]
fn rows_that_are_not_the_next_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let (path, field) = (folder.path().join("a.r32"), land());
    let content = Content::Numbers(Format::R32, Writing::default());
    let begin = || Writer::begin(&path, *field.window(), content).expect("begun");
    let refused = |writer: &mut Writer, band: &Field| {
        let error = writer.rows(band, &|| true).expect_err("refused");
        assert!(matches!(error.problem, Problem::Misfit(_)), "{error}");
        error.to_string()
    };
    let mut writer = begin();
    assert!(refused(&mut writer, &band(&field, 10, 20)).contains("rows 10 to 20 come where 0"));
    writer.rows(&band(&field, 0, 20), &|| true).expect("in order");
    assert!(refused(&mut writer, &band(&field, 10, 30)).contains("where 20"));
    let narrow = field.crop(&Window { origin: [0, 20], cells: [639, 5], ..*field.window() });
    assert!(refused(&mut writer, &narrow).contains("columns"));
    let error = writer.finish(None, &|| true).expect_err("rows are missing");
    assert!(matches!(error.problem, Problem::Misfit(_)), "{error}");
    // a file of the first rows, into which more rows do not fit
    let top = band(&field, 0, 50);
    let mut writer = Writer::begin(&path, *top.window(), content).expect("begun");
    assert!(refused(&mut writer, &band(&field, 0, 51)).contains("at most 50"));
    drop(writer);
    let mut writer = Writer::begin(&path, *field.window(), Content::Colour).expect("begun");
    assert!(refused(&mut writer, &field).contains("2 planes where 3"));
    drop(writer);
    let unknown = Content::Numbers(Format::R16, Writing::default());
    assert!(unknown.needs_whole() && !unknown.over(&field).needs_whole() && !content.needs_whole());
    let Err(error) = Writer::begin(&path, *field.window(), unknown) else { panic!("its range is not known") };
    assert!(matches!(error.problem, Problem::Misfit(_)), "{error}");
    // after a cancelled call, rows are missing
    let mut writer = begin();
    let error = writer.rows(&field, &|| false).expect_err("stopped");
    assert!(matches!(error.problem, Problem::Stopped), "{error}");
    assert!(refused(&mut writer, &field).contains("failed"));
    drop(writer);
    assert_eq!(left(&folder), 0);
}

#[test]
fn a_file_of_a_window_is_that_part_of_the_whole_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let whole = land();
    let window = Window { origin: [120, 700], cells: [300, 410], ..*whole.window() };
    let part = whole.crop(&window);
    for format in Format::ALL {
        for dither in [false, true] {
            let writing = Writing { range: Some([-1000.0, 1000.0]), dither, ..Writing::default() };
            let samples = |name: &str, field: &Field| -> (PathBuf, Raster) {
                let path = folder.path().join(format!("{name}.{}", format.extension()));
                write(&path, format, field, writing, &Meta::default(), &|| true).expect("written");
                let raster = read(&path).expect("readable");
                (path, raster)
            };
            let (of_whole, all) = samples("whole", &whole);
            let (of_part, cut) = samples("part", &part);
            let row = |j: usize| &all.samples[(700 + j) * 640 + 120..][..300];
            assert!((0..410).all(|j| cut.samples[j * 300..][..300] == *row(j)), "{}", format.name());
            let json = |path: &Path| -> serde_json::Value {
                serde_json::from_slice(&fs::read(sidecar_path(path)).expect("there")).expect("JSON")
            };
            let (of_whole, of_part) = (json(&of_whole), json(&of_part));
            assert_eq!(of_part["origin_m"], serde_json::json!([600.0, 3500.0]));
            assert_eq!(of_part["origin_cells"], serde_json::json!([120, 700]));
            assert_eq!(of_part["world_cells"], serde_json::json!([640, 2100]));
            assert!(of_whole.get("origin_m").is_none() && of_whole.get("world_cells").is_none());
        }
    }
}
