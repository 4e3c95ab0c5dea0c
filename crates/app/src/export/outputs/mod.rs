//! The files of a build: their names and formats, and how they appear all together or not at all.
//!
//! | output | file |
//! |---|---|
//! | height, mask, other scalar | `NAME.exr` or another format, with `NAME.exr.json` beside it |
//! | vector | the same twice: `NAME.x.exr` (east) and `NAME.y.exr` (south) |
//! | colour, normal, weights | `NAME.png` |
//! | any of these for an engine | its own files ([`Engine::ends`]) with a JSON file each, and import settings |
//! | lines | `NAME.geojson` |
//! | report | `NAME.json` |
//! | height, or areas that lines bound, as a mesh, if requested | `NAME.glb` or `NAME.obj` |
//! | preview of a height | `NAME.preview.png`: shaded relief, tinted over its range, at most 2048 pixels per side |

mod folder;
mod holes;
mod names;
mod options;
#[cfg(test)]
mod tests;
mod writer;

use std::{path::PathBuf, sync::Arc};

use orograph_graph::Report;
use serde_json::Map;

pub use self::{
    folder::OutputFolder,
    holes::{Holes, check as check_holes},
    options::OutputOptions,
    writer::OutputWriter,
};
use super::engine::Engine;

/// A file that was written.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    /// The output; empty for files about all outputs.
    pub output: String,
    /// The file.
    pub path: PathBuf,
    /// Its content: `height`, `mask`, ..., `picture`, `mesh` or `import settings`.
    pub what: &'static str,
    /// Its length in bytes.
    pub bytes: u64,
    /// Minimum and maximum of a raster.
    pub range: Option<[f64; 2]>,
    /// Symbol of its unit.
    pub unit: &'static str,
    /// The import settings for an engine.
    pub import: Option<Import>,
    /// The report in the file.
    pub report: Option<Arc<Report>>,
    /// True if a JSON file beside it describes it.
    pub is_described: bool,
}

/// The import settings of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Import {
    /// The engine.
    pub engine: Engine,
    /// Values by the engine's own names.
    pub settings: Map<String, serde_json::Value>,
}

impl Import {
    /// Names and values in reading order.
    pub fn lines(&self) -> impl Iterator<Item = (&str, String)> {
        let text = |value: &serde_json::Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        self.settings.iter().map(move |(name, value)| (name.as_str(), text(value)))
    }
}
