//! What `docs/validation.md` rests on.

use std::path::{Path, PathBuf};

use orograph_nodes::measure::compare::Kind;

/// The elevation models of `tests/data/dems`.
pub const MODELS: [&str; 7] = ["bigtujunga", "dales", "frontrange", "glencoe", "jacksboro", "mandakini", "norfolk"];

/// The preset graphs, with the kind whose windows they expect.
pub const PRESETS: [(&str, Kind); 4] =
    [("alps", Kind::Alps), ("himalaya", Kind::Himalaya), ("highlands", Kind::Highlands), ("canyon", Kind::Canyon)];

/// The folder of the repository.
#[must_use]
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The hash of everything that the page of validation depends on: models, references, presets, the kernels that these
/// use, and the code of measures, without comments.
///
/// # Panics
/// If a file cannot be read.
#[must_use]
pub fn validation_hash() -> String {
    let mut files = vec![root().join("tests/data/dems/expected.json")];
    files.extend(MODELS.map(|model| root().join(format!("tests/data/dems/{model}.tif"))));
    files.extend(PRESETS.map(|(preset, _)| root().join(format!("graphs/{preset}.ron"))));
    for folder in ["metrics", "compare"] {
        let entries = std::fs::read_dir(root().join("crates/nodes/src/measure").join(folder)).expect("a folder");
        let paths = entries.map(|entry| entry.expect("an entry").path());
        files.extend(paths.filter(|path| path.file_name().is_some_and(|name| name != "tests.rs" && name != "page.md")));
    }
    files.sort();
    let mut hasher = blake3::Hasher::new();
    let read = |file: &Path| std::fs::read(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    for file in &files {
        let bytes = read(file);
        if file.extension().is_some_and(|name| name == "rs" || name == "ron") {
            // a sentence that reads better changes no figure
            let code = String::from_utf8_lossy(&bytes);
            for line in code.lines().filter(|line| !line.trim_start().starts_with("//")) {
                hasher.update(line.as_bytes());
            }
        } else {
            hasher.update(&bytes);
        }
    }
    // the golden hashes of the nodes that presets use
    let graphs: String = PRESETS
        .iter()
        .map(|(preset, _)| String::from_utf8_lossy(&read(&root().join(format!("graphs/{preset}.ron")))).into_owned())
        .collect();
    let golden = String::from_utf8_lossy(&read(&root().join("tests/golden/hashes.txt"))).into_owned();
    for line in golden.lines() {
        let node = line.split_whitespace().next().unwrap_or_default();
        if graphs.contains(&format!(" {node}(")) {
            hasher.update(line.as_bytes());
        }
    }
    hasher.finalize().to_hex()[..16].to_owned()
}
