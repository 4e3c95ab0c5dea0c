//! The manual's node pages are what the program prints; `cargo bless` renews them.

use std::{collections::BTreeSet, path::PathBuf};

use orograph_nodes::registry;
use orograph_tests::blessing;

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
        assert!(known == *text, "docs/nodes/{name} is not what the program prints; run `cargo bless`");
    }
    let names: BTreeSet<String> = pages.into_iter().map(|(name, _)| name).collect();
    for entry in std::fs::read_dir(folder()).expect("the manual's folder") {
        let name = entry.expect("an entry").file_name().to_string_lossy().into_owned();
        assert!(names.contains(&name), "docs/nodes/{name} is the page of no node; delete it");
    }
}
