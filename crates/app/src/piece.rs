//! A raster as an engine imports it.

use orograph_graph::Field;
pub use orograph_nodes::raster::Content;
use serde_json::{Map, Value};

/// A file's raster, how it is written, and what to type where it is imported.
#[derive(Clone, Debug)]
pub struct Piece {
    /// The raster.
    pub field: Field,
    /// How it is written.
    pub content: Content,
    /// What to type where an engine imports it, by the engine's own names.
    pub import: Map<String, Value>,
}
