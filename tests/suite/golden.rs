//! The golden picture of each node: the hash of every output's bytes on test terrain, and a small picture for viewing.
//!
//! Hashes are exact: the same on every machine, thread count and SIMD level. After a deliberate change `cargo bless`
//! updates hashes and pictures; look at the pictures before committing them. When hashes differ, the test writes a
//! sheet per output to the folder that it names: before, after, and eight times the difference around grey.

use std::{collections::BTreeMap, fmt::Write as _, path::PathBuf};

use orograph_graph::{Exactness, Field, Value};
use orograph_nodes::registry;
use orograph_tests::{blessing, evaluate, example, golden_folder, world, write_golden};

const HASHES: &str = "hashes.txt";
const CELLS: u32 = 80;
/// The maximum size of a golden picture.
const MOST_BYTES: usize = 20 * 1024;

fn hash(value: &Value) -> String {
    let mut hasher = blake3::Hasher::new();
    match value {
        Value::Field(field) => {
            for sample in field.samples() {
                hasher.update(&sample.to_bits().to_le_bytes());
            }
        }
        Value::Strata(strata) => {
            for sample in strata.offset().samples() {
                hasher.update(&sample.to_bits().to_le_bytes());
            }
            hasher.update(format!("{:?}", strata.column()).as_bytes());
        }
        Value::Lines(lines) => {
            hasher.update(&serde_json::to_vec(lines.as_ref()).expect("lines are plain data"));
        }
        Value::Report(report) => {
            hasher.update(&serde_json::to_vec(report.as_ref()).expect("a report is plain data"));
        }
        Value::State(_) => {}
    }
    hasher.finalize().to_hex()[..32].to_owned()
}

/// Linear light as a level of a picture, close enough to sRGB for viewing.
fn gamma(linear: f32) -> u8 {
    (255.0 * linear.clamp(0.0, 1.0).sqrt()).round() as u8
}

/// A field as an 8-bit picture: colours unchanged, anything else from its smallest to its largest sample.
fn picture(field: &Field) -> Vec<u8> {
    let (nx, ny, planes) = (field.window().nx(), field.window().ny(), field.planes());
    let (lo, hi) = field.range(0).expect("a finite field");
    let level = |at: usize| (255.0 * (field.plane(0)[at] - lo) / (hi - lo).max(f32::MIN_POSITIVE)).round() as u8;
    // normals have negative components
    let (scale, offset) = if planes == 3 && lo < 0.0 { (0.5, 0.5) } else { (1.0, 0.0) };
    let image = image::RgbImage::from_fn(nx as u32, ny as u32, |i, j| {
        let at = j as usize * nx + i as usize;
        if planes == 3 {
            image::Rgb([0, 1, 2].map(|k| gamma(field.plane(k)[at] * scale + offset)))
        } else {
            image::Rgb([level(at); 3])
        }
    });
    let mut bytes = std::io::Cursor::new(Vec::new());
    if planes == 3 {
        image.write_to(&mut bytes, image::ImageFormat::Png).expect("a picture in memory");
    } else {
        let grey = image::DynamicImage::ImageRgb8(image).into_luma8();
        grey.write_to(&mut bytes, image::ImageFormat::Png).expect("a picture in memory");
    }
    bytes.into_inner()
}

/// Both pictures next to each other, and their difference.
fn sheet(before: Option<&[u8]>, after: &[u8]) -> image::RgbImage {
    let read = |bytes: &[u8]| image::load_from_memory(bytes).expect("a picture").to_rgb8();
    let after = read(after);
    let (nx, ny) = after.dimensions();
    let before = before.map_or_else(|| image::RgbImage::new(nx, ny), read);
    image::RgbImage::from_fn(3 * nx, ny, |x, y| {
        let at =
            |picture: &image::RgbImage| picture.get_pixel_checked(x % nx, y).copied().unwrap_or(image::Rgb([0; 3]));
        match x / nx {
            0 => at(&before),
            1 => at(&after),
            _ => image::Rgb(
                [0, 1, 2]
                    .map(|k| (128 + 8 * (i32::from(at(&after)[k]) - i32::from(at(&before)[k]))).clamp(0, 255) as u8),
            ),
        }
    })
}

#[test]
fn the_sheet_of_a_change_shows_where_it_is() {
    let picture = |v: u8| {
        let mut image = image::RgbImage::from_pixel(4, 2, image::Rgb([100; 3]));
        image.put_pixel(1, 1, image::Rgb([v; 3]));
        let mut bytes = std::io::Cursor::new(Vec::new());
        image.write_to(&mut bytes, image::ImageFormat::Png).expect("a picture in memory");
        bytes.into_inner()
    };
    let sheet = sheet(Some(&picture(100)), &picture(105));
    assert_eq!(sheet.dimensions(), (12, 2));
    assert_eq!([1, 5, 9, 8].map(|x| sheet.get_pixel(x, 1)[0]), [100, 105, 168, 128]);
}

#[test]
fn every_node_still_gives_what_it_gave() {
    let (mut now, mut pictures) = (BTreeMap::new(), BTreeMap::new());
    for node in registry().nodes() {
        let values = evaluate(&example(node), world(CELLS), 2).unwrap_or_else(|error| panic!("{}: {error}", node.id));
        for (output, value) in node.outputs.iter().zip(values) {
            let name = format!("{}.{}", node.id, output.name);
            if node.exactness == Exactness::Exact {
                now.insert(name.clone(), hash(&value));
            }
            if let Value::Field(field) = &value {
                let bytes = picture(field);
                if !blessing() {
                    pictures.insert(name, bytes);
                    continue;
                }
                assert!(bytes.len() <= MOST_BYTES, "the picture of {name} takes {} bytes", bytes.len());
                write_golden(&format!("{name}.png"), &bytes);
            }
        }
    }
    let mut text = String::new();
    for (name, hash) in &now {
        writeln!(text, "{name} {hash}").expect("writing to memory");
    }
    if blessing() {
        write_golden(HASHES, text.as_bytes());
        return;
    }
    let known = std::fs::read_to_string(golden_folder().join(HASHES)).unwrap_or_default();
    let known: BTreeMap<String, String> =
        known.lines().filter_map(|line| line.split_once(' ')).map(|(a, b)| (a.to_owned(), b.to_owned())).collect();
    let mut changed: Vec<&String> =
        now.iter().filter(|(name, hash)| known.get(*name) != Some(hash)).map(|(n, _)| n).collect();
    changed.extend(known.keys().filter(|name| !now.contains_key(*name)));
    let sheets = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("golden");
    for (name, after) in changed.iter().filter_map(|name| pictures.get_key_value(*name)) {
        let before = std::fs::read(golden_folder().join(format!("{name}.png"))).ok();
        std::fs::create_dir_all(&sheets).expect("a folder below the target folder");
        sheet(before.as_deref(), after).save(sheets.join(format!("{name}.png"))).expect("written");
    }
    assert!(
        changed.is_empty(),
        "different bytes: {changed:?}\nbefore, after and difference are in {}\nif that is meant, raise the version of \
         the node, run `cargo bless` and look at tests/golden",
        sheets.display()
    );
}
