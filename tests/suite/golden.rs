//! The picture of each node: the hash of every output's bytes on test land, and a small picture of it to look at.
//!
//! Hashes are exact: the same on every machine, thread count and SIMD width. After a deliberate change `cargo bless`
//! renews hashes and pictures; look at the pictures before committing them.

use std::{collections::BTreeMap, fmt::Write as _};

use orograph_graph::{Exactness, Field, Value};
use orograph_nodes::registry;
use orograph_tests::{blessing, evaluate, example, golden_folder, world, write_golden};

const HASHES: &str = "hashes.txt";
const CELLS: u32 = 80;
/// The most a golden picture may take: it is to show what is tested and nothing else.
const MOST_BYTES: usize = 20 * 1024;

fn hash(value: &Value) -> String {
    let mut hasher = blake3::Hasher::new();
    match value {
        Value::Field(field) => {
            for sample in field.samples() {
                hasher.update(&sample.to_bits().to_le_bytes());
            }
        }
        Value::Lines(lines) => {
            hasher.update(&serde_json::to_vec(lines.as_ref()).expect("lines are plain data"));
        }
        Value::Report(report) => {
            hasher.update(&serde_json::to_vec(report.as_ref()).expect("a report is plain data"));
        }
    }
    hasher.finalize().to_hex()[..32].to_owned()
}

/// Linear light as a level of a picture, near enough to sRGB to be looked at.
fn gamma(linear: f32) -> u8 {
    (255.0 * linear.clamp(0.0, 1.0).sqrt()).round() as u8
}

/// A field as an 8-bit picture: colours as they are, anything else from its least to its largest sample.
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

#[test]
fn every_node_still_gives_what_it_gave() {
    let mut now = BTreeMap::new();
    for node in registry().nodes() {
        let values = evaluate(&example(node), world(CELLS), 2).unwrap_or_else(|error| panic!("{}: {error}", node.id));
        for (output, value) in node.outputs.iter().zip(values) {
            let name = format!("{}.{}", node.id, output.name);
            if node.exactness == Exactness::Exact {
                now.insert(name.clone(), hash(&value));
            }
            if let Value::Field(field) = &value
                && blessing()
            {
                let bytes = picture(field);
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
    assert!(
        changed.is_empty(),
        "other bytes than before: {changed:?}\nif that is meant, raise the version of the node, run `cargo bless` and look at \
         tests/golden"
    );
}
