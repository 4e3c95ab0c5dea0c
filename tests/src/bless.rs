//! Golden files: compared in tests, updated by `cargo bless`.

use std::path::PathBuf;

/// Returns true if golden files should be updated instead of compared.
#[must_use]
pub fn blessing() -> bool {
    std::env::var_os("OROGRAPH_BLESS").is_some()
}

/// The folder of the golden files.
#[must_use]
pub fn golden_folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("golden")
}

/// Writes a golden file.
///
/// # Panics
/// When it cannot be written.
pub fn write_golden(name: &str, bytes: &[u8]) {
    let path = golden_folder().join(name);
    std::fs::create_dir_all(golden_folder()).expect("golden folder");
    std::fs::write(&path, bytes).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
}
