//! Tests of the GeoTIFF reader and writer.

use super::{directory::tag, *};
use crate::raster::{Cell, Raster, Voids, tests::memory};

fn read(bytes: &[u8]) -> Result<Raster, Problem> {
    open(memory(bytes))?.raster(&|| true)
}

/// Builds a little-endian classic TIFF of 16-bit samples in one strip, with additional tags (tag, type, values).
fn tiff(columns: u32, rows: u32, samples: &[u16], extra: &[(u16, u16, Vec<u8>)]) -> Vec<u8> {
    let short = |v: u16| v.to_le_bytes().to_vec();
    let long = |v: u32| v.to_le_bytes().to_vec();
    let mut file = vec![b'I', b'I', 42, 0, 0, 0, 0, 0];
    file.extend(samples.iter().flat_map(|v| v.to_le_bytes()));
    let mut entries: Vec<(u16, u16, Vec<u8>)> = vec![
        (tag::IMAGE_WIDTH, 4, long(columns)),
        (tag::IMAGE_LENGTH, 4, long(rows)),
        (tag::BITS_PER_SAMPLE, 3, short(16)),
        (tag::STRIP_OFFSETS, 4, long(8)),
        (tag::STRIP_BYTE_COUNTS, 4, long(2 * samples.len() as u32)),
    ];
    entries.retain(|(name, ..)| extra.iter().all(|(other, ..)| other != name));
    entries.extend(extra.iter().cloned());
    let mut table = Vec::new();
    for (name, kind, data) in &entries {
        let width = match kind {
            1 | 2 => 1,
            3 => 2,
            4 => 4,
            _ => 8,
        };
        table.extend(name.to_le_bytes());
        table.extend(kind.to_le_bytes());
        table.extend((data.len() as u32 / width).to_le_bytes());
        if data.len() <= 4 {
            let mut word = data.clone();
            word.resize(4, 0);
            table.extend(word);
        } else {
            table.extend((file.len() as u32).to_le_bytes());
            file.extend(data);
        }
    }
    let at = file.len() as u32;
    file[4..8].copy_from_slice(&at.to_le_bytes());
    file.extend((entries.len() as u16).to_le_bytes());
    file.extend(table);
    file.extend([0; 4]);
    file
}

fn reals(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

fn shorts(values: &[u16]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

#[test]
fn a_raster_stored_south_up_is_turned() {
    let transform = reals(&[10.0, 0.0, 0.0, 500.0, 0.0, 10.0, 0.0, 900.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
    let file = tiff(2, 3, &[1, 2, 3, 4, 5, 6], &[(tag::MODEL_TRANSFORMATION, 12, transform)]);
    let raster = read(&file).unwrap();
    assert_eq!(raster.samples, [5.0, 6.0, 3.0, 4.0, 1.0, 2.0]);
    assert_eq!(raster.head.origin, Some([500.0, 930.0]));
    assert_eq!(raster.head.cell, Some(Cell::Metres([10.0, 10.0])));
}

/// One strip or tile of more cells than are unpacked at a time, as wide as the image, is read row by row.
#[test]
fn a_large_chunk_is_read_row_by_row() {
    use std::io::Write;
    let side = 2100_u32;
    let sample = |at: usize| (at * 7919 % 65_521) as u16;
    let samples: Vec<u16> = (0..(side * side) as usize).map(sample).collect();
    let mut packed = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
    samples.iter().for_each(|v| packed.write_all(&v.to_le_bytes()).expect("memory"));
    let mut packed = packed.finish().expect("memory");
    let count = packed.len() as u32;
    packed.resize(packed.len().next_multiple_of(2), 0);
    let packed: Vec<u16> = packed.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect();
    let long = |v: u32| v.to_le_bytes().to_vec();
    let deflate = (tag::COMPRESSION, 3, shorts(&[8]));
    let strip = [deflate.clone(), (tag::STRIP_BYTE_COUNTS, 4, long(count))];
    let tile = [
        deflate,
        (tag::TILE_WIDTH, 4, long(side)),
        (tag::TILE_LENGTH, 4, long(side)),
        (tag::TILE_OFFSETS, 4, long(8)),
        (tag::TILE_BYTE_COUNTS, 4, long(count)),
    ];
    for extra in [&strip[..], &tile[..]] {
        let file = tiff(side, side, &packed, extra);
        let reader = open(memory(&file)).expect("a raster");
        assert!(reader.bytes() < 2 << 20, "{}", reader.bytes());
        let raster = reader.raster(&|| true).expect("readable");
        assert!(raster.samples.iter().enumerate().all(|(at, v)| *v == f32::from(sample(at))));
    }
}

/// What cannot be read row by row is refused where it is large, with the remedy.
#[test]
fn large_parts_are_refused() {
    let side = 5000_u32;
    let samples = vec![0_u16; 40_000];
    let long = |v: u32| v.to_le_bytes().to_vec();
    let deflate = (tag::COMPRESSION, 3, shorts(&[8]));
    let transform = reals(&[10.0, 0.0, 0.0, 500.0, 0.0, 10.0, 0.0, 900.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
    let south_up = [deflate.clone(), (tag::MODEL_TRANSFORMATION, 12, transform)];
    let lists = |of: [u32; 2]| of.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    let tiles = [
        deflate,
        (tag::TILE_WIDTH, 4, long(2512)),
        (tag::TILE_LENGTH, 4, long(side)),
        (tag::TILE_OFFSETS, 4, lists([8, 40_008])),
        (tag::TILE_BYTE_COUNTS, 4, lists([40_000, 40_000])),
    ];
    for extra in [&south_up[..], &tiles[..]] {
        match open(memory(&tiff(side, side, &samples, extra))).err() {
            Some(Problem::Unsupported { remedy, .. }) => assert!(remedy.contains("BLOCKYSIZE")),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn feet_become_metres_and_unknown_units_are_refused() {
    let with_units = |code: u16| {
        let keys = shorts(&[1, 1, 0, 2, 1024, 0, 1, 1, 3076, 0, 1, code]);
        let scale = reals(&[100.0, 100.0, 0.0]);
        read(&tiff(1, 1, &[7], &[(tag::MODEL_PIXEL_SCALE, 12, scale), (tag::GEO_KEY_DIRECTORY, 3, keys)]))
    };
    let Some(Cell::Metres([feet, _])) = with_units(9002).unwrap().head.cell else { panic!("metres") };
    assert!((feet - 30.48).abs() < 1e-12);
    assert!(matches!(with_units(9014), Err(Problem::Unsupported { .. })));
}

/// Reads a raster of one cell with GeoKeys (name, value) and other tags.
fn keyed(keys: &[[u16; 2]], scale: f64, extra: &[(u16, u16, Vec<u8>)]) -> Result<Raster, Problem> {
    let mut directory = vec![1, 1, 0, keys.len() as u16];
    directory.extend(keys.iter().flat_map(|[name, value]| [*name, 0, 1, *value]));
    let mut tags = vec![
        (tag::MODEL_PIXEL_SCALE, 12, reals(&[scale, scale, 0.0])),
        (tag::MODEL_TIEPOINT, 12, reals(&[0.0, 0.0, 0.0, -11_169_055.58, 2_800_000.0, 0.0])),
        (tag::GEO_KEY_DIRECTORY, 3, shorts(&directory)),
    ];
    tags.extend(extra.iter().cloned());
    read(&tiff(1, 1, &[7], &tags))
}

#[test]
fn web_mercator_is_recognised_and_other_world_maps_are_refused() {
    let cell =
        |keys: &[[u16; 2]], extra: &[_]| keyed(keys, 30.0, extra).map(|raster| raster.head.cell.expect("a cell"));
    let named = |name: &str| [(tag::GEO_ASCII_PARAMS, 2, format!("{name}|\0").into_bytes())];
    for epsg in [3857, 3785] {
        assert_eq!(cell(&[[1024, 1], [3072, epsg]], &[]).expect("readable"), Cell::Mercator([30.0; 2]));
    }
    // as Esri's programs write it
    let esri = cell(&[[1024, 1], [3072, 32_767], [3075, 7]], &named("WGS_1984_Web_Mercator_Auxiliary_Sphere"));
    assert_eq!(esri.expect("readable"), Cell::Mercator([30.0; 2]));
    assert_eq!(cell(&[[1024, 1], [3072, 32_632]], &[]).expect("readable"), Cell::Metres([30.0; 2]));
    for keys in [[[1024, 1], [3072, 3395]], [[1024, 1], [3072, 4087]], [[1024, 1], [3075, 7]]] {
        match cell(&keys, &[]) {
            Err(Problem::Unsupported { remedy, .. }) => assert!(remedy.contains("gdalwarp"), "{remedy}"),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn samples_become_metres_by_scale_offset_and_unit() {
    let item = |role: &str, text: &str| format!("<Item name=\"X\" sample=\"0\" role=\"{role}\">{text}</Item>");
    let value = |items: &[String], unit: Option<u16>| {
        let xml = format!("<GDALMetadata>{}</GDALMetadata>\0", items.concat());
        let keys: Vec<[u16; 2]> = [[1024, 1]].into_iter().chain(unit.map(|unit| [4099, unit])).collect();
        keyed(&keys, 30.0, &[(tag::GDAL_METADATA, 2, xml.into_bytes())])
    };
    let known = |items: &[String], unit| value(items, unit).expect("readable").samples[0];
    assert_eq!(known(&[], None), 7.0);
    assert_eq!(known(&[item("scale", "0.1"), item("offset", "-100")], None), -99.3);
    assert_eq!(known(&[], Some(9002)), (7.0_f64 * 0.3048) as f32);
    assert_eq!(known(&[item("unittype", "US survey foot")], Some(9001)), (7.0 * 1200.0 / 3937.0) as f32);
    assert_eq!(known(&[item("scale", "0.5"), item("unittype", "ft")], None), (3.5_f64 * 0.3048) as f32);
    assert!(matches!(value(&[], Some(9014)), Err(Problem::Unsupported { .. })));
    let odd = value(&[item("unittype", "fathom")], None).expect("readable");
    assert!(odd.samples == [7.0] && odd.head.notes[0].contains("`fathom`"), "{:?}", odd.head.notes);
}

#[test]
fn rotated_and_mirrored_rasters_are_refused() {
    let read = |a: f64, b: f64, d: f64, e: f64| {
        let transform = reals(&[a, b, 0.0, 500.0, d, e, 0.0, 900.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
        read(&tiff(2, 3, &[1, 2, 3, 4, 5, 6], &[(tag::MODEL_TRANSFORMATION, 12, transform)]))
    };
    // 30 degrees; a quarter turn; from east to west
    for [a, b, d, e] in [[8.66, 5.0, 5.0, -8.66], [0.0, 10.0, 10.0, 0.0], [-10.0, 0.0, 0.0, -10.0]] {
        match read(a, b, d, e) {
            Err(Problem::Unsupported { remedy, .. }) => assert!(remedy.contains("gdalwarp"), "{remedy}"),
            other => panic!("{other:?}"),
        }
    }
    assert_eq!(read(10.0, 1e-9, 1e-9, -10.0).expect("rounding").head.cell, Some(Cell::Metres([10.0; 2])));
    assert!(matches!(read(10.0, 0.0, 0.0, 0.0), Err(Problem::Damaged(_))));
    assert!(matches!(read(f64::NAN, 0.0, 0.0, -10.0), Err(Problem::Damaged(_))));
}

#[test]
fn customary_values_are_voids_unless_the_file_declares_its_own() {
    let signed = (tag::SAMPLE_FORMAT, 3, shorts(&[2]));
    let samples = [-9999_i16, 12, -32_768, -32_767].map(|v| v as u16);
    let raster = read(&tiff(4, 1, &samples, std::slice::from_ref(&signed))).expect("readable");
    assert_eq!((raster.samples[1], raster.voids), (12.0, Voids { cells: 3, assumed: 3 }));
    let remarks = raster.voids.remarks(&raster.head, "are filled");
    assert!(remarks.len() == 2 && remarks[0].contains("-9999") && remarks[1].contains("3 of 4"), "{remarks:?}");
    let declared = (tag::GDAL_NODATA, 2, b"-32768\0".to_vec());
    let raster = read(&tiff(4, 1, &samples, &[signed, declared])).expect("readable");
    assert_eq!(raster.samples[0], -9999.0);
    assert_eq!(raster.voids, Voids { cells: 1, assumed: 0 });
}

#[test]
fn the_first_of_several_bands_is_read_and_the_user_told() {
    let bands = [(tag::SAMPLES_PER_PIXEL, 3, shorts(&[2])), (tag::BITS_PER_SAMPLE, 3, shorts(&[16, 16]))];
    let raster = read(&tiff(2, 1, &[1, 90, 2, 91], &bands)).expect("readable");
    assert_eq!(raster.samples, [1.0, 2.0]);
    assert!(raster.head.notes[0].contains("2 bands"), "{:?}", raster.head.notes);
}

/// Overviews and masks are no further images; directories in a ring are read once.
#[test]
fn the_first_of_several_images_is_read_and_the_user_told() {
    let notes = |kinds: &[u32], ring: bool| {
        let mut file = tiff(2, 1, &[1, 2], &[]);
        for (index, kind) in kinds.iter().enumerate() {
            let (link, at) = (file.len() - 4, file.len() as u32);
            file[link..].copy_from_slice(&at.to_le_bytes());
            file.extend([1, 0]);
            file.extend(tag::NEW_SUBFILE_TYPE.to_le_bytes());
            file.extend([4, 0, 1, 0, 0, 0]);
            file.extend(kind.to_le_bytes());
            let is_last = index + 1 == kinds.len();
            file.extend(if ring && is_last { at } else { 0 }.to_le_bytes());
        }
        let raster = read(&file).expect("readable");
        assert_eq!(raster.samples, [1.0, 2.0]);
        raster.head.notes
    };
    assert_eq!(notes(&[1, 4, 5], false), [""; 0]);
    assert_eq!(notes(&[0, 2, 1], false), ["the file has 3 images; the first is read"]);
    assert_eq!(notes(&[0], true), ["the file has 2 images; the first is read"]);
}

#[test]
fn a_header_that_claims_gigabytes_is_refused() {
    let small = [0_u16; 400];
    let claim = |columns, rows, extra: &[(u16, u16, Vec<u8>)]| read(&tiff(columns, rows, &small, extra)).unwrap_err();
    assert!(matches!(claim(32_000, 32_000, &[]), Problem::Lying { columns: 32_000, rows: 32_000, .. }));
    assert!(matches!(claim(u32::MAX, u32::MAX, &[]), Problem::Lying { .. }));
    // compressed: possible for the length of the file, but not for that of its only strip
    let deflate = (tag::COMPRESSION, 3, shorts(&[8]));
    assert!(matches!(claim(32_000, 32_000, std::slice::from_ref(&deflate)), Problem::Lying { .. }));
    let strip = (tag::STRIP_BYTE_COUNTS, 4, 10_u32.to_le_bytes().to_vec());
    assert!(matches!(claim(1000, 900, &[deflate, strip]), Problem::Truncated(_)));
    // a tile far larger than the image
    let tiles = [
        (tag::TILE_WIDTH, 4, u32::MAX.to_le_bytes().to_vec()),
        (tag::TILE_LENGTH, 4, u32::MAX.to_le_bytes().to_vec()),
        (tag::TILE_OFFSETS, 4, 8_u32.to_le_bytes().to_vec()),
        (tag::TILE_BYTE_COUNTS, 4, 800_u32.to_le_bytes().to_vec()),
    ];
    assert!(matches!(claim(10, 10, &tiles), Problem::Truncated(_)));
    assert!(matches!(claim(0, 10, &[]), Problem::Empty { .. }));
}

#[test]
fn variants_that_are_not_read_are_named() {
    let with = |name, value: u16| read(&tiff(2, 2, &[1; 4], &[(name, 3, shorts(&[value]))])).unwrap_err().to_string();
    assert!(with(tag::COMPRESSION, 34_887).contains("LERC"));
    assert!(with(tag::COMPRESSION, 50_000).contains("Zstandard"));
    assert!(with(tag::PHOTOMETRIC, 2).contains("colour"));
    assert!(with(tag::PREDICTOR, 9).contains("predictor 9"));
    assert!(with(tag::BITS_PER_SAMPLE, 12).contains("12-bit"));
}

#[test]
fn a_chunk_that_was_never_written_is_void() {
    let offsets = [8_u32, 0].iter().flat_map(|v| v.to_le_bytes()).collect();
    let counts = [4_u32, 0].iter().flat_map(|v| v.to_le_bytes()).collect();
    let extra =
        [(tag::ROWS_PER_STRIP, 3, shorts(&[1])), (tag::STRIP_OFFSETS, 4, offsets), (tag::STRIP_BYTE_COUNTS, 4, counts)];
    let raster = read(&tiff(2, 2, &[11, 12], &extra)).unwrap();
    assert_eq!((raster.samples[1], raster.voids.cells), (12.0, 2));
}

/// A BigTIFF whose samples lie beyond the places that 32 bits can state; the file is sparse.
#[test]
fn a_file_of_more_than_four_gigabytes_is_read() {
    use std::io::{Seek as _, SeekFrom, Write as _};
    let at = 5_000_000_000_u64;
    let tags: [(u16, u64); 7] = [
        (tag::IMAGE_WIDTH, 3),
        (tag::IMAGE_LENGTH, 2),
        (tag::BITS_PER_SAMPLE, 16),
        (tag::STRIP_OFFSETS, at),
        (tag::SAMPLES_PER_PIXEL, 1),
        (tag::STRIP_BYTE_COUNTS, 12),
        (tag::SAMPLE_FORMAT, 1),
    ];
    let mut head = vec![b'I', b'I', 43, 0, 8, 0, 0, 0, 16, 0, 0, 0, 0, 0, 0, 0];
    head.extend((tags.len() as u64).to_le_bytes());
    for (name, value) in tags {
        head.extend(name.to_le_bytes());
        head.extend(16_u16.to_le_bytes());
        head.extend(1_u64.to_le_bytes());
        head.extend(value.to_le_bytes());
    }
    head.extend([0; 8]);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("large.tif");
    let mut file = std::fs::File::create(&path).expect("created");
    file.write_all(&head).expect("written");
    file.seek(SeekFrom::Start(at)).expect("a place");
    file.write_all(&shorts(&[1, 2, 3, 4, 5, 6])).expect("written");
    drop(file);
    let raster = crate::raster::read(&path).expect("a raster");
    assert_eq!(raster.samples, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
}

#[test]
fn vertical_datums_are_reported_and_feet_converted() {
    let keys = |codes: &[(u16, u16)]| {
        let all = codes.iter().flat_map(|(key, value)| [*key, 0, 1, *value]);
        let all: Vec<u16> = [1, 1, 0, codes.len() as u16].into_iter().chain(all).collect();
        (tag::GEO_KEY_DIRECTORY, 3, shorts(&all))
    };
    let read = |codes: &[(u16, u16)]| read(&tiff(2, 1, &[100, 200], &[keys(codes)])).expect("a raster");
    let egm96 = read(&[(4096, 5773)]);
    assert_eq!(egm96.samples, [100.0, 200.0]);
    assert!(egm96.head.notes[0].contains("EPSG:5773 (EGM96)"), "{:?}", egm96.head.notes);
    let navd88 = read(&[(4096, 6360)]);
    assert!((f64::from(navd88.samples[0]) - 100.0 * 1200.0 / 3937.0).abs() < 1e-5, "{:?}", navd88.samples);
    assert!(read(&[]).head.notes.is_empty());
}
