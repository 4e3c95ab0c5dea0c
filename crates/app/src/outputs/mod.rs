//! The files of a build: their names and formats, and how they appear all together or not at all.
//!
//! | output | file |
//! |---|---|
//! | height, mask, other scalar | `NAME.exr` or another format, with `NAME.exr.json` beside it |
//! | vector | the same twice: `NAME.x.exr` (east) and `NAME.y.exr` (south) |
//! | colour, normal, weights | `NAME.png` |
//! | any of these for an engine | its own files ([`Engine::ends`]), each with a JSON file, and a text of what to type there |
//! | lines | `NAME.geojson` |
//! | report | `NAME.json` |
//! | height as a mesh, where asked for | `NAME.glb` or `NAME.obj` |
//! | height, to look at | `NAME.preview.png`: shaded relief, tinted over its range, at most 2048 pixels a side |

mod folder;
mod form;
mod names;
#[cfg(test)]
mod tests;
mod writer;

use std::path::PathBuf;

use serde_json::Map;

pub use self::{folder::OutputFolder, form::Form, writer::OutputWriter};
use crate::engine::Engine;

/// A file that was written.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    /// The output; empty for what is about all of them.
    pub output: String,
    /// The file.
    pub path: PathBuf,
    /// What it holds: `height`, `mask`, ..., `picture`, `mesh` or `what to type`.
    pub what: &'static str,
    /// Its length in bytes.
    pub bytes: u64,
    /// Lowest and highest value of a raster.
    pub range: Option<[f64; 2]>,
    /// Symbol of their unit.
    pub unit: &'static str,
    /// What to type where an engine imports it.
    pub import: Option<Import>,
}

/// What to type where an engine imports a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Import {
    /// The engine.
    pub engine: Engine,
    /// Values by the engine's own names.
    pub settings: Map<String, serde_json::Value>,
}

impl Import {
    /// Names and values as they are read.
    pub fn lines(&self) -> impl Iterator<Item = (&str, String)> {
        let text = |value: &serde_json::Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        self.settings.iter().map(move |(name, value)| (name.as_str(), text(value)))
    }
}
