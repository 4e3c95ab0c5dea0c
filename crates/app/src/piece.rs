//! A raster on its way into a file.

use std::path::Path;

use orograph_graph::{Field, PortType};
use orograph_nodes::raster::{self, Format, GoOn, Meta, RasterError, Sidecar, Writing};
use serde_json::{Map, Value};

/// A file's raster, how it is written, and what to type where it is imported.
#[derive(Clone, Debug)]
pub struct Piece {
    /// The raster.
    pub field: Field,
    /// How it is written.
    pub content: Content,
    /// What to type where an engine imports it, by the engine's own names; empty for no engine.
    pub import: Map<String, Value>,
}

/// How a raster is written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Content {
    /// The numbers of the first plane.
    Numbers(Format, Writing),
    /// A picture of linear red, green and blue.
    Colour,
    /// The same with the alpha of a colour map of Terrain3D.
    Tint,
    /// Unit normals.
    Normal,
    /// Shares of four layers in one picture.
    Weights,
    /// Shares of four layers as a control map of Terrain3D.
    Control,
}

impl Content {
    /// Scalars in a format: masks over 0 to 1, the rest over its own range.
    #[must_use]
    pub fn numbers(ty: PortType, format: Format, dither: bool) -> Self {
        let range = (ty == PortType::Mask).then_some([0.0, 1.0]);
        Self::Numbers(format, Writing { range, dither, red: false })
    }
}

impl Piece {
    /// Writes it, with a sidecar beside numbers and, where `described`, beside anything else too.
    ///
    /// # Errors
    /// As [`raster::write()`].
    pub fn write(&self, path: &Path, meta: &Meta, described: bool, go_on: GoOn<'_>) -> Result<(), RasterError> {
        let field = &self.field;
        match self.content {
            Content::Numbers(format, writing) => {
                return raster::write(path, format, field, writing, meta, go_on).map(|_| ());
            }
            Content::Colour => raster::write_colour(path, field, go_on),
            Content::Tint => raster::write_tint(path, field, go_on),
            Content::Normal => raster::write_normal(path, field, go_on),
            Content::Weights => raster::write_weights(path, field, go_on),
            Content::Control => raster::write_control(path, field, go_on),
        }?;
        if described {
            raster::write_sidecar(path, &Sidecar::of(field.window(), meta), go_on)?;
        }
        Ok(())
    }

    /// Lowest and highest of numbers.
    #[must_use]
    pub fn range(&self) -> Option<[f64; 2]> {
        let range = || self.field.range(0).map(|(lo, hi)| [f64::from(lo), f64::from(hi)]);
        if matches!(self.content, Content::Numbers(..)) { range() } else { None }
    }
}
