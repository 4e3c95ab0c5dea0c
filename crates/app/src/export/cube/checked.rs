//! Which terrains of a cube were held against the expectations of the file, and what they missed.
//!
//! A terrain that is in the store but was not measured, because the program was stopped in between, is built again.

use std::{collections::BTreeMap, fs, io};

use serde_json::json;

use super::{Cube, text};
use crate::report::failure::{Failure, reason};

/// The file in the store.
pub const CHECKED: &str = "expectations.json";

/// The terrains that were measured, by name, and what they missed.
#[derive(Debug)]
pub struct Checked(BTreeMap<String, Option<String>>);

impl Checked {
    /// The name of a terrain with these values.
    #[must_use]
    pub fn name(label: &str) -> String {
        if label.is_empty() { "the only terrain".to_owned() } else { label.to_owned() }
    }

    /// Those of the runs that this one continues.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn read(cube: &Cube) -> Result<Self, Failure> {
        let path = cube.folder().join(CHECKED);
        let wrong = |what: String| {
            Failure::unable(format!("`{}`: {what}", path.display()))
                .hint("remove it; the same command then builds all terrains again")
        };
        match fs::read(&path) {
            Ok(found) => serde_json::from_slice(&found).map(Self).map_err(|error| wrong(error.to_string())),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Self(BTreeMap::new())),
            Err(error) => Err(wrong(reason(&error).to_string())),
        }
    }

    /// Returns true if a terrain was measured.
    #[must_use]
    pub fn has(&self, terrain: &str) -> bool {
        self.0.contains_key(terrain)
    }

    /// Notes that a terrain was measured, and what it missed.
    ///
    /// # Errors
    /// When the store cannot be written to.
    pub fn note(&mut self, cube: &Cube, terrain: &str, missed: Option<String>) -> Result<(), Failure> {
        self.0.insert(terrain.to_owned(), missed);
        cube.write(&cube.folder().join(CHECKED), &text(&json!(self.0)))
    }

    /// Number of terrains that missed an expectation.
    #[must_use]
    pub fn missed(&self) -> usize {
        self.0.values().flatten().count()
    }
}
