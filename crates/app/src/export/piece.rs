//! A raster for import in an engine.

use orograph_graph::Field;
pub use orograph_nodes::raster::Content;
use serde_json::{Map, Value};

/// The raster of a file, or of several tiles, its format, and the import settings.
#[derive(Clone, Debug)]
pub struct Piece {
    /// The raster.
    pub field: Field,
    /// Its format.
    pub content: Content,
    /// The import settings, by the engine's own names.
    pub import: Map<String, Value>,
    /// The samples that neighbouring tiles share along their common edge: one of vertices, none of pixels.
    pub shared: u32,
}
