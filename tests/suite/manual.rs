//! The manual's node pages match the output of the program; `cargo bless` updates them.

use std::{collections::BTreeSet, path::PathBuf};

use orograph_nodes::registry;
use orograph_tests::{blessing, pictures_folder};

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

/// Each node that gives a raster has its picture in the manual, and there are no others. What nodes compute is checked by
/// golden hashes.
#[test]
fn every_node_that_gives_a_raster_has_its_picture() {
    let pages = orograph::cli::manual(&registry());
    let shown: BTreeSet<String> = pages
        .iter()
        .map(|(name, text)| (name.replace(".md", ".jpg"), text))
        .filter(|(picture, text)| text.contains(&format!("(pictures/{picture})")))
        .map(|(picture, _)| picture)
        .collect();
    let mut bytes = 0;
    let mut there = BTreeSet::new();
    for entry in std::fs::read_dir(pictures_folder()).expect("the folder of pictures") {
        let entry = entry.expect("an entry");
        bytes += entry.metadata().expect("a size").len();
        there.insert(entry.file_name().to_string_lossy().into_owned());
    }
    let remedy = "draw a picture by `cargo run --release -p orograph-tests --example node_pictures -- NODE`";
    assert_eq!(shown, there, "pages and pictures: {remedy}, and delete that of a node that is gone");
    assert!(bytes < MOST_BYTES, "the manual's pictures take {bytes} bytes");
}

/// Codes are for programs, so that each is in the table.
#[test]
fn codes_of_problems_are_documented() {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..");
    let page = std::fs::read_to_string(root.join("docs/programs.md")).expect("the page for programs");
    let sources = ["crates/graph/src/document", "crates/graph/src/eval/error.rs", "crates/app/src/report/failure.rs"];
    let mut codes = BTreeSet::new();
    for source in sources {
        for path in rust_files(&root.join(source)) {
            let text = std::fs::read_to_string(&path).expect("a source file");
            let before = [
                "Diagnostic::error(",
                "Diagnostic::warning(",
                "Diagnostic::note(",
                "Misfit::new(",
                "=> \"",
                "Exit::Wrong, ",
                "Exit::Unable, ",
            ];
            for start in before {
                let is_code = !start.starts_with('=') || path.ends_with("error.rs");
                for rest in text.split(start).skip(1).filter(|_| is_code) {
                    let rest = rest.trim_start().trim_start_matches('"');
                    let code: String = rest.chars().take_while(|c| c.is_ascii_lowercase() || *c == '-').collect();
                    if rest[code.len()..].starts_with('"') && code.len() > 2 {
                        codes.insert(code);
                    }
                }
            }
        }
    }
    assert!(codes.contains("unknown-node") && codes.contains("node-failed") && codes.len() > 30, "{codes:?}");
    for code in codes {
        assert!(page.contains(&format!("`{code}`")), "docs/programs.md does not describe the code `{code}`");
    }
}

fn rust_files(path: &std::path::Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(path) else { return vec![path.to_owned()] };
    entries
        .flat_map(|entry| rust_files(&entry.expect("an entry").path()))
        .filter(|path| path.extension().is_some_and(|e| e == "rs"))
        .collect()
}
