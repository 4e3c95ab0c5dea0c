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
    /// Column and row of the tile; those of a whole raster are 0.
    pub tile: [u32; 2],
    /// Values by the engine's own names.
    pub settings: Map<String, serde_json::Value>,
}

impl Import {
    /// Names and values in reading order, without those of `like`.
    pub fn lines(&self, like: Option<&Self>) -> impl Iterator<Item = (&str, String)> {
        let text = |value: &serde_json::Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        let differs = move |name: &str, value| like.is_none_or(|like| like.settings.get(name) != Some(value));
        let own = self.settings.iter().filter(move |(name, value)| differs(name, value));
        own.map(move |(name, value)| (name.as_str(), text(value)))
    }

    /// The files with import settings that are not those of the first tile of the same raster, and those settings.
    pub fn of(files: &[Written]) -> impl Iterator<Item = (&Written, &Self, Vec<(&str, String)>)> {
        let mut first = None;
        files.iter().filter_map(move |file| {
            let import = file.import.as_ref()?;
            if import.tile == [0, 0] {
                first = Some(import);
            }
            let lines: Vec<_> = import.lines(first.filter(|first| first.tile != import.tile)).collect();
            (!lines.is_empty()).then_some((file, import, lines))
        })
    }
}
