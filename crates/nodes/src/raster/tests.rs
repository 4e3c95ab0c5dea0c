//! Tests over all raster formats.

use std::{fs, io, path::PathBuf};

use orograph_graph::{Field, GeoPlace, Window, World};
use proptest::prelude::*;
use rayon::prelude::*;
use serde::Deserialize;

use super::*;

/// Bytes in memory as those of a file.
pub(super) fn memory(bytes: &[u8]) -> reader::Source<'_> {
    reader::Source { bytes: Box::new(io::Cursor::new(bytes)), length: bytes.len() as u64 }
}

fn decode_while(bytes: &[u8], path: &Path, sidecar: Option<&Sidecar>, go_on: GoOn<'_>) -> Result<Raster, Problem> {
    reader::open(memory(bytes), path, sidecar)?.raster(go_on)
}

fn decode(bytes: &[u8], path: &Path, sidecar: Option<&Sidecar>) -> Result<Raster, Problem> {
    decode_while(bytes, path, sidecar, &|| true)
}

fn data(name: &str) -> PathBuf {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/data")).join(name)
}

/// Values that other programs read from the files of `tests/data`.
#[derive(Deserialize)]
struct Expected {
    columns: usize,
    rows: usize,
    voids: usize,
    min: f64,
    max: f64,
    sum: f64,
    corners: [Option<f32>; 4],
    cell: Option<[f64; 2]>,
    degrees: bool,
    origin: Option<[f64; 2]>,
    epsg: Option<u32>,
}

fn expected() -> Vec<(String, Expected)> {
    let text = fs::read(data("expected.json")).unwrap();
    let all: std::collections::BTreeMap<String, Expected> = serde_json::from_slice(&text).unwrap();
    all.into_iter().collect()
}

#[test]
fn every_variant_reads_as_other_programs_read_it() {
    let all = expected();
    assert!(all.len() >= 20);
    for (name, expected) in all {
        let raster = read(&data(&name)).unwrap();
        assert_eq!((raster.head.columns, raster.head.rows), (expected.columns, expected.rows), "{name}");
        assert_eq!(raster.voids.cells, expected.voids, "{name}");
        let known = || raster.samples.iter().filter(|v| !v.is_nan()).map(|v| f64::from(*v));
        // samples are small multiples of a power of two or single precision, so these values are exact
        assert_eq!(known().fold(f64::INFINITY, f64::min), expected.min, "{name}");
        assert_eq!(known().fold(f64::NEG_INFINITY, f64::max), expected.max, "{name}");
        let sum: f64 = known().sum();
        // only the order of summation differs
        assert!((sum - expected.sum).abs() <= 1e-9 * expected.sum.abs(), "{name}: {sum}");
        let (last_row, last) = ((raster.head.rows - 1) * raster.head.columns, raster.samples.len() - 1);
        for (at, corner) in [0, raster.head.columns - 1, last_row, last].into_iter().zip(expected.corners) {
            assert_eq!(Some(raster.samples[at]).filter(|v| !v.is_nan()), corner, "{name} at {at}");
        }
        let cell = expected.cell.map(|d| if expected.degrees { Cell::Degrees(d) } else { Cell::Metres(d) });
        assert_eq!(raster.head.cell, cell, "{name}");
        assert_eq!(raster.head.epsg, expected.epsg, "{name}");
        match (raster.head.origin, expected.origin) {
            // a corner computed from the opposite corner or from a centre differs by the rounding of the sum
            (Some(found), Some(told)) => {
                for (f, t) in found.into_iter().zip(told) {
                    assert!((f - t).abs() <= 1e-12 * t.abs(), "{name}: origin {found:?}");
                }
            }
            (found, told) => assert_eq!(found, told, "{name}"),
        }
    }
}

#[test]
fn reading_stops_when_told() {
    for name in ["mandakini_f32_lzw_predictor2_tiled.tif", "glencoe_48x64_u16.png", "frontrange_3arcsec.asc"] {
        assert!(matches!(read_while(&data(name), &|| false).unwrap_err().problem, Problem::Stopped), "{name}");
        let bytes = fs::read(data(name)).unwrap();
        assert!(matches!(decode_while(&bytes, Path::new(name), None, &|| false), Err(Problem::Stopped)), "{name}");
    }
}

#[test]
fn codes_become_metres_by_the_sidecar() {
    let raster = read(&data("glencoe_48x64_u16.png")).unwrap();
    let range = raster.head.coding.unwrap().range.unwrap();
    let metres = raster.clone().decoded([0.0, 1.0]);
    let original = read(&data("glencoe_128.tif")).unwrap();
    for j in 0..64 {
        for i in 0..48 {
            let (found, told) = (metres.samples[j * 48 + i], original.samples[j * 128 + i]);
            // half a step of the code, and the rounding of f32 near 1000 m
            let most = 0.5 * (range[1] - range[0]) / 65_535.0 + 1e-4;
            assert!(f64::from((found - told).abs()) <= most, "({i}, {j}): {found} instead of {told}");
        }
    }
}

fn terrain(nx: u32, ny: u32) -> Field {
    let world =
        World { size: [f64::from(nx) * 12.5, f64::from(ny) * 12.5], cells: [nx, ny], seed: 7, ..World::default() };
    let samples = (0..nx * ny).map(|at| ((at * 7919) % 10_007) as f32 * 0.37 - 500.0).collect();
    Field::new(Window::whole(world), samples)
}

#[test]
fn what_is_written_reads_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let field = terrain(70, 45);
    let meta = Meta { quantity: "height".into(), unit: "m".into(), graph_hash: Some("abc".into()), ..Meta::default() };
    for format in Format::ALL {
        let path = folder.path().join(format!("{}.{}", format.name(), format.extension()));
        let sidecar = write(&path, format, &field, Writing::default(), &meta, &|| true).unwrap();
        assert_eq!((sidecar.columns, sidecar.rows, sidecar.cell_m), (Some(70), Some(45), Some(12.5)));
        assert_eq!((sidecar.seed, sidecar.graph_hash.as_deref()), (Some(7), Some("abc")));
        let text = fs::read(sidecar_path(&path)).unwrap();
        // JSON is read to within a unit of the last place, so the texts are compared
        assert_eq!(text, [&serde_json::to_vec_pretty(&sidecar).expect("JSON")[..], b"\n"].concat());
        assert_eq!(serde_json::from_slice::<Sidecar>(&text).expect("a sidecar").columns, sidecar.columns);
        let back = height_field(read(&path).unwrap(), [0.0, 1.0], None).unwrap().field;
        assert_eq!(back.window().cells, [70, 45]);
        assert!((back.window().cell_m() - 12.5).abs() < 1e-12);
        match sidecar.step {
            None => assert_eq!(back.samples(), field.samples(), "{}", format.name()),
            Some(step) => {
                let full = if format == Format::Png8 { 255.0 } else { 65_535.0 };
                assert!((step * full - 3702.22).abs() < 1e-3, "{step}"); // heights are single precision
                for (a, b) in back.samples().iter().zip(field.samples()) {
                    // rounded to the nearest code; f32 near 3000 m adds a rounding of 1e-4
                    assert!(f64::from((a - b).abs()) <= 0.5 * step + 2e-4, "{}: {a} {b}", format.name());
                }
            }
        }
    }
    let left: Vec<_> = fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(left.len(), 2 * Format::ALL.len(), "no temporary file is left: {left:?}");
}

/// A part of a world with a place leaves with the coordinates of its own corner, in every format.
#[test]
fn rasters_know_where_on_earth_they_are() {
    let folder = tempfile::tempdir().expect("a folder");
    let field = terrain(70, 45);
    let place = Some(GeoPlace { epsg: 32_611, corner_m: [378_000.5, 3_812_000.0] });
    let world = World { place, ..field.window().world };
    let part = field.crop(&Window { world, origin: [8, 16], cells: [40, 20] });
    for format in Format::ALL {
        let path = folder.path().join(format!("{}.{}", format.name(), format.extension()));
        write(&path, format, &part, Writing::default(), &Meta::default(), &|| true).expect("written");
        let head = read(&path).expect("readable").head;
        assert_eq!(head.epsg, Some(32_611), "{}", format.name());
        assert_eq!(head.origin, Some([378_100.5, 3_811_800.0]), "{}", format.name());
        assert_eq!(head.cell, Some(Cell::Metres([12.5; 2])), "{}", format.name());
    }
}

/// Noise, which compression would lengthen, and terrain: other readers decode every code, and the number of threads
/// does not change a byte.
#[test]
fn png_is_the_same_for_any_number_of_threads() {
    let folder = tempfile::tempdir().expect("a folder");
    let noise = terrain(90, 60).into_samples().into_iter().enumerate();
    let noise = noise.map(|(at, _)| (orograph_graph::mix(at as u32) % 65_536) as f32).collect();
    for field in [Field::new(*terrain(90, 60).window(), noise), terrain(90, 60)] {
        for (format, full) in [(Format::Png16, 65_535.0), (Format::Png8, 255.0)] {
            let path = folder.path().join("land.png");
            let bytes = |threads: usize| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
                let writing = Writing { range: Some([-500.0, 65_535.0]), ..Writing::default() };
                pool.install(|| write(&path, format, &field, writing, &Meta::default(), &|| true)).expect("written");
                fs::read(&path).expect("there")
            };
            let alone = bytes(1);
            assert!(bytes(3) == alone && alone.len() < 90 * 60 * 2 + 500, "{}", alone.len());
            let image = image::load_from_memory(&alone).expect("a picture").into_luma16();
            for (found, v) in image.pixels().zip(field.samples()) {
                let code = ((f64::from(*v) + 500.0) * full / 66_035.0 + 0.5).floor();
                assert_eq!(f64::from(found.0[0]) * full / 65_535.0, code);
            }
        }
    }
}

#[test]
fn a_tile_of_a_world_knows_its_place() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("tile.tif");
    let whole = terrain(40, 30);
    let part = whole.crop(&Window { world: whole.window().world, origin: [8, 20], cells: [16, 10] });
    write(&path, Format::Tiff, &part, Writing::default(), &Meta::default(), &|| true).unwrap();
    let raster = read(&path).unwrap();
    // 8 cells of 12.5 m east and 10 cells of 12.5 m north of the world's south-west corner
    assert_eq!(raster.head.origin, Some([100.0, 125.0]));
    assert_eq!((raster.head.cell, raster.head.epsg), (Some(Cell::Metres([12.5, 12.5])), None));
}

#[test]
fn colour_is_encoded_as_srgb() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("map.png");
    let world = World { size: [3.0, 1.0], cells: [3, 1], ..World::default() };
    let planes = vec![0.0, 0.5, 1.0, 0.2140, 0.002, 2.0, -1.0, f32::NAN, 0.0031308];
    write_colour(&path, &Field::with_planes(Window::whole(world), 3, planes), &|| true).unwrap();
    let mut reader = ::png::Decoder::new(io::Cursor::new(fs::read(&path).expect("there"))).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut bytes).unwrap();
    // IEC 61966-2-1: 0.5 -> 187.5, 0.214 -> 127.5, 0.002 -> 6.6, 0.0031308 -> 10.3.
    assert_eq!(bytes, [0, 127, 0, 188, 7, 0, 255, 255, 10]);
    assert!(matches!(read(&path).unwrap_err().problem, Problem::Unsupported { .. }));
}

#[test]
fn a_failed_write_leaves_what_was_there() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("land.r16");
    fs::write(&path, b"before").unwrap();
    let mut broken = terrain(4, 4).into_samples();
    broken[5] = f32::NAN;
    let field = Field::new(*terrain(4, 4).window(), broken);
    let error = write(&path, Format::R16, &field, Writing::default(), &Meta::default(), &|| true).unwrap_err();
    assert!(matches!(error.problem, Problem::NotFinite { count: 1 }));
    let error = replace(&path, |_| Err(io::Error::from(io::ErrorKind::StorageFull))).unwrap_err();
    assert!(error.to_string().contains("land.r16") && error.remedy().contains("room"), "{error}");
    let error = write(&path, Format::R32, &terrain(4, 4), Writing::default(), &Meta::default(), &|| false).unwrap_err();
    assert!(matches!(error.problem, Problem::Stopped));
    assert_eq!(fs::read(&path).expect("there"), b"before");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    let nowhere = folder.path().join("missing/land.exr");
    let error =
        write(&nowhere, Format::Exr, &terrain(4, 4), Writing::default(), &Meta::default(), &|| true).unwrap_err();
    assert!(matches!(error.problem, Problem::Unwritable(_)));
}

#[test]
fn what_is_no_raster_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let problem = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        let error = read(&path).unwrap_err();
        assert!(error.to_string().contains(name) && !error.remedy().is_empty(), "{error}");
        error.problem
    };
    assert!(matches!(problem("a.tif", b"II*\0"), Problem::Truncated(_)));
    assert!(matches!(problem("a.tif", b""), Problem::Damaged(_)));
    assert!(matches!(problem("a.png", b"\x89PNG\r\n\x1a\n"), Problem::Truncated(_)));
    assert!(matches!(problem("a.exr", b"\x76\x2f\x31\x01"), Problem::Damaged(_)));
    assert!(matches!(problem("a.jpg", b"\xff\xd8"), Problem::UnknownFormat));
    assert!(matches!(problem("a.r32", &[0xff; 16]), Problem::AllVoid));
    assert!(matches!(problem("a.asc", b"ncols 1 nrows 1 cellsize 1 nodata_value 0 0"), Problem::AllVoid));
    assert!(matches!(read(folder.path()).unwrap_err().problem, Problem::Folder));
    assert!(matches!(read(&folder.path().join("none.tif")).unwrap_err().problem, Problem::Missing));
    assert!(matches!(read(&data("expected.json/x.tif")).unwrap_err().problem, Problem::Missing));
    fs::write(folder.path().join("b.r16.json"), b"{\"range\": [9, 1]}").unwrap();
    assert!(matches!(problem("b.r16", &[0; 8]), Problem::Sidecar { .. }));
}

/// Returns a file with bytes replaced at an offset.
fn patched(name: &str, at: usize, bytes: &[u8]) -> Vec<u8> {
    let mut file = fs::read(data(name)).unwrap();
    file[at..at + bytes.len()].copy_from_slice(bytes);
    file
}

#[test]
fn a_header_that_claims_gigabytes_is_refused() {
    let refused = |name: &str, bytes: &[u8]| {
        let problem = decode(bytes, Path::new(name), None).unwrap_err();
        let named = matches!(problem, Problem::Lying { .. } | Problem::Damaged(_) | Problem::Truncated(_));
        assert!(named, "{name}: {problem}");
    };
    // IHDR: width and height, with a valid checksum of the chunk
    let mut png = patched("glencoe_48x64_u16.png", 16, &[0, 0, 0x7d, 0, 0, 0, 0x7d, 0]);
    let mut crc = flate2::Crc::new();
    crc.update(&png[12..29]);
    png[29..33].copy_from_slice(&crc.sum().to_be_bytes());
    let problem = decode(&png, Path::new("a.png"), None).unwrap_err();
    assert!(matches!(problem, Problem::Lying { columns: 32_000, rows: 32_000, .. }), "{problem}");
    refused("a.asc", b"ncols 32000\nnrows 32000\ncellsize 1\n1 2 3\n");
    // the data window of an OpenEXR file: its last column and row
    let exr = fs::read(data("mandakini_f32_piz.exr")).unwrap();
    let window = b"dataWindow\0box2i\0";
    let at = exr.windows(window.len()).position(|w| w == window).unwrap() + window.len() + 4;
    refused("a.exr", &patched("mandakini_f32_piz.exr", at + 8, &[0xff, 0x7c, 0, 0, 0xff, 0x7c, 0, 0]));
    refused("a.exr", &patched("mandakini_f32_piz.exr", at + 8, &[0xff, 0xff, 0xff, 0x3f, 0xff, 0xff, 0xff, 0x3f]));
}

/// A reader may fail, but must neither panic nor return more cells than the strongest compression allows.
fn survives(name: &str, bytes: &[u8]) -> Result<(), TestCaseError> {
    let sidecar = Sidecar { columns: Some(9), rows: Some(7), ..Sidecar::default() };
    let raw = name.ends_with(".r16") || name.ends_with(".r32");
    if let Ok(raster) = decode(bytes, Path::new(name), raw.then_some(&sidecar)) {
        prop_assert_eq!(raster.samples.len(), raster.head.columns * raster.head.rows);
        // a byte before compression holds at most eight grey cells of one bit
        prop_assert!(raster.samples.len() as u64 <= bytes.len() as u64 * MAX_RATIO * 8);
        let _ = raster.head.cell_m();
    }
    Ok(())
}

fn seeds() -> Vec<(String, Vec<u8>)> {
    let mut all: Vec<_> =
        expected().into_iter().map(|(name, _)| (name.clone(), fs::read(data(&name)).unwrap())).collect();
    all.push(("N40W106.hgt".into(), (0..18_u8).collect()));
    all.push(("a.r16".into(), (0..126).collect()));
    all.push(("a.r32".into(), (0..252).collect()));
    all
}

#[test]
fn every_byte_of_a_header_may_be_wrong() {
    for (name, bytes) in seeds() {
        // the directory of a TIFF file is at its beginning or its end
        let places: Vec<usize> =
            (0..bytes.len().min(400)).chain(bytes.len().saturating_sub(300)..bytes.len()).collect();
        places.par_iter().for_each(|at| {
            for value in [0, 0x7f, 0xff] {
                let mut wrong = bytes.clone();
                wrong[*at] = value;
                survives(&name, &wrong).unwrap();
            }
        });
    }
}

fn mutation() -> impl Strategy<Value = (usize, Vec<u8>)> {
    let extreme = prop_oneof![
        Just(vec![0xff; 2]),
        Just(vec![0xff; 4]),
        Just(vec![0xff, 0xff, 0xff, 0x7f]),
        Just(vec![0x7f, 0xff, 0xff, 0xff]),
        Just(vec![0; 4]),
        Just(vec![0xff; 8]),
        proptest::collection::vec(any::<u8>(), 1..9),
    ];
    (any::<usize>(), extreme)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1500, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn mutated_files_never_panic(
        which in any::<usize>(),
        mutations in proptest::collection::vec(mutation(), 0..6),
        keep in prop_oneof![3 => Just(1.0), 1 => 0.0..1.0],
    ) {
        let seeds = std::sync::LazyLock::force(&SEEDS);
        let (name, bytes) = &seeds[which % seeds.len()];
        let mut bytes = bytes[..(bytes.len() as f64 * keep) as usize].to_vec();
        for (at, values) in mutations {
            if !bytes.is_empty() {
                // half of them near the beginning, which contains the headers
                let at = if at % 2 == 0 { at / 2 % bytes.len() } else { at / 2 % bytes.len().min(512) };
                let end = (at + values.len()).min(bytes.len());
                bytes[at..end].copy_from_slice(&values[..end - at]);
            }
        }
        survives(name, &bytes)?;
    }

    #[test]
    fn noise_never_panics(bytes in proptest::collection::vec(any::<u8>(), 0..600), kind in 0..7_usize) {
        let magic: [&[u8]; 7] =
            [b"II*\0", b"MM\0*", b"II+\0\x08\0\0\0", b"\x89PNG\r\n\x1a\n", b"\x76\x2f\x31\x01\x02\0\0\0", b"ncols ", b""];
        let name = ["a.tif", "a.tif", "a.tif", "a.png", "a.exr", "a.asc", "a.hgt"][kind];
        survives(name, &[magic[kind], &bytes].concat())?;
    }
}

static SEEDS: std::sync::LazyLock<Vec<(String, Vec<u8>)>> = std::sync::LazyLock::new(seeds);
