//! Tests of cloud-optimised GeoTIFF against the reader, and of its layout.

use orograph_graph::{Field, GeoPlace, Window, World, mix};

use super::*;
use crate::raster::{
    Content, Format, Raster, Writer, Writing,
    geotiff::{
        directory::{Directory, tag},
        open,
    },
    reader::Shared,
    tests::memory,
};

/// Terrain in cells of 10 m, with voids if wanted.
fn terrain(columns: u32, rows: u32, has_voids: bool) -> Field {
    let cells = [columns, rows];
    let place = Some(GeoPlace { epsg: 32632, corner_m: [400_000.0, 5_100_000.0] });
    let world = World { size: cells.map(|n| f64::from(n) * 10.0), cells, place, ..World::default() };
    let value = |k: u32| {
        let (i, j) = (k % columns, k / columns);
        let is_void = has_voids && (i < 37 && j < 25 || mix(k).is_multiple_of(97));
        if is_void { f32::NAN } else { 900.0 + (i + 2 * j) as f32 * 0.37 + mix(k) as f32 / 4e9 }
    };
    Field::new(Window::whole(world), (0..columns * rows).map(value).collect())
}

fn written(field: &Field) -> Vec<u8> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("height.tif");
    let content = Content::Numbers(Format::Cog, Writing::default());
    let mut writer = Writer::begin(&path, *field.window(), content).expect("begun");
    writer.rows(field, &|| true).expect("rows");
    writer.finish(None, &|| true).expect("complete");
    let files = std::fs::read_dir(folder.path()).expect("a folder").count();
    assert_eq!(files, 1, "the waiting tiles are left");
    std::fs::read(path).expect("bytes")
}

fn read(bytes: &[u8]) -> Raster {
    open(memory(bytes)).and_then(|reader| reader.raster(&|| true)).expect("a raster")
}

fn bits(samples: &[f32]) -> Vec<u32> {
    samples.iter().map(|v| v.to_bits()).collect()
}

/// Where the directories of a classic file are.
fn directories(bytes: &[u8]) -> Vec<usize> {
    let number = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("4 bytes")) as usize;
    let mut all = vec![number(4)];
    while let Some(at) = all.last().copied() {
        let tags = usize::from(u16::from_le_bytes([bytes[at], bytes[at + 1]]));
        match number(at + 2 + 12 * tags) {
            0 => break,
            next => all.push(next),
        }
    }
    all
}

/// The same file beginning with another of its directories.
fn of_directory(bytes: &[u8], at: usize) -> Vec<u8> {
    let mut other = bytes.to_vec();
    other[4..8].copy_from_slice(&(at as u32).to_le_bytes());
    other
}

#[test]
fn every_bit_reads_back_with_the_place() {
    for (columns, rows, has_voids) in [(1300, 700, true), (512, 512, false), (40, 1, false), (513, 1025, true)] {
        let field = terrain(columns, rows, has_voids);
        let raster = read(&written(&field));
        assert_eq!([raster.head.columns, raster.head.rows], [columns, rows].map(|n| n as usize));
        assert!(bits(&raster.samples) == bits(field.samples()), "{columns} x {rows}");
        assert_eq!(raster.head.epsg, Some(32632));
        assert_eq!(raster.head.origin, Some([400_000.0, 5_100_000.0]));
        assert_eq!(raster.voids.cells > 0, has_voids);
    }
}

#[test]
fn overviews_are_means_without_voids() {
    let field = terrain(1300, 700, true);
    let bytes = written(&field);
    let levels = directories(&bytes);
    assert_eq!(levels.len(), 3);
    let mut above = read(&bytes);
    for at in &levels[1..] {
        let level = read(&of_directory(&bytes, *at));
        let [columns, rows] = [above.head.columns, above.head.rows];
        assert_eq!([level.head.columns, level.head.rows], [columns.div_ceil(2), rows.div_ceil(2)]);
        for (k, mean) in level.samples.iter().enumerate() {
            let [i, j] = [k % level.head.columns, k / level.head.columns].map(|n| 2 * n);
            let four = [(i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1)];
            let there = four.into_iter().filter(|(i, j)| *i < columns && *j < rows);
            let known: Vec<f64> =
                there.map(|(i, j)| f64::from(above.samples[j * columns + i])).filter(|v| !v.is_nan()).collect();
            let expected = known.iter().sum::<f64>() / known.len() as f64;
            assert_eq!(mean.is_nan(), known.is_empty(), "{i}, {j}");
            // half a unit in the last place of 2000
            assert!(known.is_empty() || (f64::from(*mean) - expected).abs() < 7e-5, "{i}, {j}: {mean} {expected}");
        }
        above = level;
    }
}

#[test]
fn directories_come_first_and_small_overviews_before_large_ones() {
    let bytes = written(&terrain(1300, 700, false));
    let levels = directories(&bytes);
    assert_eq!(levels[0], 8);
    let places: Vec<Vec<u64>> = levels
        .iter()
        .map(|at| {
            let file = of_directory(&bytes, *at);
            let shared = Shared::new(memory(&file));
            let directory = Directory::parse(&shared).expect("a directory");
            directory.numbers(tag::TILE_OFFSETS).expect("places")
        })
        .collect();
    let in_file: Vec<u64> = places.iter().rev().flatten().copied().collect();
    assert!(in_file.is_sorted(), "{in_file:?}");
    assert!(levels.iter().all(|at| (*at as u64) < in_file[0]));
}

#[test]
fn directories_of_large_files_have_places_of_64_bits() {
    let tiles = [5_000_000_000, 6_000_000_000].map(|at| Tile { at, bytes: 900_000 }).to_vec();
    let images =
        [Image { cells: [900, 300], tiles: tiles.clone() }, Image { cells: [450, 150], tiles: tiles[..1].to_vec() }];
    let window = *terrain(900, 300, false).window();
    let bytes = head(&images, &window, true, true);
    let shared = Shared::new(memory(&bytes));
    let directory = Directory::parse(&shared).expect("a directory");
    assert_eq!(directory.numbers(tag::TILE_OFFSETS).expect("places"), [5_000_000_000, 6_000_000_000]);
    assert_eq!(directory.number(tag::IMAGE_WIDTH).expect("a width"), Some(900));
    assert_eq!(directory.text(tag::GDAL_NODATA).expect("a text").as_deref(), Some("nan"));
}

#[test]
fn cancelling_leaves_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let field = terrain(1300, 700, false);
    let content = Content::Numbers(Format::Cog, Writing::default());
    let mut writer = Writer::begin(&folder.path().join("height.tif"), *field.window(), content).expect("begun");
    assert!(writer.rows(&field, &|| false).is_err());
    drop(writer);
    assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 0);
}
