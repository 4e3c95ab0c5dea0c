//! House rules that the compiler does not check.

use std::path::{Path, PathBuf};

use orograph_nodes::registry;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Files with an extension below a folder, sorted.
fn files(folder: &Path, of: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display())) {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == of) {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

fn all_sources() -> Vec<PathBuf> {
    ["crates/graph", "crates/nodes", "crates/app", "crates/python", "tests", "fuzz"]
        .iter()
        .flat_map(|folder| files(&root().join(folder), "rs"))
        .collect()
}

#[test]
fn files_fit_in_a_head() {
    for path in all_sources() {
        let lines = std::fs::read_to_string(&path).expect("a source file").lines().count();
        assert!(lines <= 700, "{} has {lines} lines; split it", path.display());
    }
}

#[test]
fn every_file_begins_with_its_documentation() {
    for path in all_sources() {
        let text = std::fs::read_to_string(&path).expect("a source file");
        assert!(text.starts_with("//!"), "{} does not begin with `//!`", path.display());
    }
}

/// rustfmt wraps code, and leaves comments as they are. Indentation does not count: the first line of documentation may
/// have 120 characters, wherever it is.
#[test]
fn comments_fit_in_120_characters() {
    for path in all_sources() {
        let text = std::fs::read_to_string(&path).expect("a source file");
        for (row, line) in text.lines().enumerate() {
            let comment = line.trim_start();
            let is_long = comment.starts_with("//") && comment.chars().count() > "/// ".len() + 120;
            assert!(!is_long, "{}:{}: wrap this comment at 120 characters", path.display(), row + 1);
        }
    }
}

#[test]
fn every_declaration_is_registered() {
    let declared: usize = files(&root().join("crates/nodes/src"), "rs")
        .iter()
        .map(|path| std::fs::read_to_string(path).expect("a source file").matches("pub static NODE: Node").count())
        .sum();
    assert_eq!(declared, registry().nodes().len(), "a node's file is missing in its category's list");
}

#[test]
fn nothing_is_left_for_later() {
    let marks = ["TO", "FIX", "HA"].into_iter().zip(["DO", "ME", "CK"]).map(|(a, b)| format!("{a}{b}"));
    let marks: Vec<String> = marks.collect();
    for path in all_sources() {
        let text = std::fs::read_to_string(&path).expect("a source file");
        for mark in &marks {
            assert!(!text.contains(mark.as_str()), "{} has a {mark}", path.display());
        }
    }
}

#[test]
fn no_merge_is_left_half_done() {
    let documents = files(&root().join("docs"), "md").into_iter().chain(files(&root().join("graphs"), "ron"));
    for path in all_sources().into_iter().chain(documents) {
        let text = std::fs::read_to_string(&path).expect("a text file");
        let marked = |line: &str| ["<<<<<<< ", ">>>>>>> "].iter().any(|marker| line.starts_with(marker));
        assert!(!text.lines().any(marked), "{} has markers of a conflict", path.display());
    }
}

#[test]
fn the_readme_explains_the_graph_as_it_is() {
    let text =
        |path: &str| std::fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"));
    let quoted: String = text("graphs/hello.ron").lines().map(|line| format!("    {line}\n")).collect();
    assert!(text("README.md").contains(&quoted), "the README explains another `graphs/hello.ron`");
}

#[test]
fn the_readme_names_the_two_commands() {
    let readme = std::fs::read_to_string(root().join("README.md")).expect("README.md");
    let commands: Vec<&str> = readme
        .lines()
        .map(str::trim)
        .filter(|line| line.starts_with("cargo run ") || line.starts_with("cargo test "))
        .collect();
    assert_eq!(
        commands,
        ["cargo run --release -- run graphs/carve_dem.ron -o out", "cargo test --workspace"],
        "the README has one command for the main job and one for the tests"
    );
}
