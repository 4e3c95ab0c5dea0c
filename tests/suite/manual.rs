//! The manual's node pages match the output of the program; `cargo bless` updates them.

use std::{collections::BTreeSet, path::PathBuf};

use orograph_nodes::registry;
use orograph_tests::{blessing, picture, pictures_folder};

/// The maximum total size of the pictures.
const MOST_BYTES: u64 = 2_500_000;

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../docs/nodes")
}

#[test]
fn the_pages_of_the_manual_are_what_the_program_prints() {
    let pages = orograph::cli::manual(&registry());
    if blessing() {
        std::fs::create_dir_all(folder()).expect("the manual's folder");
        for (name, text) in &pages {
            std::fs::write(folder().join(name), text).expect("a page of the manual");
        }
    }
    for (name, text) in &pages {
        let known = std::fs::read_to_string(folder().join(name)).unwrap_or_default();
        assert!(known == *text, "docs/nodes/{name} differs from what the program prints; run `cargo bless`");
    }
    let names: BTreeSet<String> = pages.into_iter().map(|(name, _)| name).chain(["pictures".to_owned()]).collect();
    for entry in std::fs::read_dir(folder()).expect("the manual's folder") {
        let name = entry.expect("an entry").file_name().to_string_lossy().into_owned();
        assert!(names.contains(&name), "docs/nodes/{name} belongs to no node; delete it");
    }
}

/// Golden hashes check the bytes of a node; this test checks that each node has a picture in the manual, and that there
/// are no others.
#[test]
fn every_node_that_gives_a_raster_has_its_picture() {
    let folder = pictures_folder();
    if blessing() {
        std::fs::create_dir_all(&folder).expect("the folder of pictures");
        for node in registry().listed() {
            if let Some(bytes) = picture(node) {
                std::fs::write(folder.join(format!("{}.png", node.id)), bytes).expect("a picture");
            }
        }
    }
    let pages = orograph::cli::manual(&registry());
    let shown: BTreeSet<String> = pages
        .iter()
        .filter(|(name, text)| text.contains(&format!("(pictures/{})", name.replace(".md", ".png"))))
        .map(|(name, _)| name.replace(".md", ".png"))
        .collect();
    let mut bytes = 0;
    let mut there = BTreeSet::new();
    for entry in std::fs::read_dir(folder).expect("the folder of pictures") {
        let entry = entry.expect("an entry");
        bytes += entry.metadata().expect("a size").len();
        there.insert(entry.file_name().to_string_lossy().into_owned());
    }
    assert_eq!(shown, there, "pages and pictures; run `cargo bless`, and delete the picture of a node that is gone");
    assert!(bytes < MOST_BYTES, "the manual's pictures take {bytes} bytes");
}
