//! Rock at depth: a column of layers and the surface that they follow.

use std::sync::Arc;

use crate::{field::Field, memory::OutOfMemory, param::Layer, world::Window};

/// Layers of rock from the top down.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// The layers; at least one.
    pub layers: Vec<Layer>,
    /// The [stratigraphic height](Strata) of the top of the first layer, in metres.
    pub top_m: f64,
    /// True if the layers repeat above and below; otherwise the first and the last one continue.
    pub repeats: bool,
    /// Cosine of the dip: how much of a metre upwards is a metre across the layers.
    pub cosine: f64,
}

impl Column {
    /// A message on what is not rock: no layers, or a number outside of its range. Returns None when there is nothing.
    pub(crate) fn fault(&self) -> Option<String> {
        let Self { layers, top_m, cosine, .. } = self;
        if layers.is_empty() || !top_m.is_finite() || !(0.0..=1.0).contains(cosine) {
            return Some("returned strata without layers or with a number that is not finite".to_owned());
        }
        if layers.len() > Layer::MOST {
            return Some(format!("returned strata with more than {} layers", Layer::MOST));
        }
        let within = |value: f64, [low, high]: [f64; 2]| value >= low && value <= high;
        let is_rock = |layer: &Layer| {
            layer.thickness > 0.0
                && layer.thickness.is_finite()
                && within(layer.hardness, Layer::HARDNESSES)
                && within(layer.repose, Layer::REPOSES)
        };
        let odd = layers.iter().position(|layer| !is_rock(layer))?;
        Some(format!("returned strata whose layer {} is outside of the range of layers", odd + 1))
    }
}

/// Rock at depth: what lies at any elevation of every cell.
///
/// The rock at the elevation z of a cell is that of the column at the stratigraphic height ζ = z cos(dip) − offset,
/// measured across the layers. So the size does not depend on the number of layers, nor on how far the rock has risen.
#[derive(Clone, Debug, PartialEq)]
pub struct Strata {
    column: Arc<Column>,
    offset: Field,
}

impl Strata {
    /// Layers that follow a surface.
    ///
    /// # Panics
    /// When there is no layer, or the offset has more than one plane.
    #[must_use]
    pub fn new(column: Arc<Column>, offset: Field) -> Self {
        assert!(!column.layers.is_empty() && offset.planes() == 1, "strata have layers and one offset");
        Self { column, offset }
    }

    /// The layers.
    #[must_use]
    pub fn column(&self) -> &Column {
        &self.column
    }

    /// What is subtracted in the stratigraphic height of each cell, in metres: dip, folds, faults and uplift.
    #[must_use]
    pub const fn offset(&self) -> &Field {
        &self.offset
    }

    /// The same layers on another offset.
    #[must_use]
    pub fn on(&self, offset: Field) -> Self {
        Self::new(Arc::clone(&self.column), offset)
    }

    /// The part on a window.
    ///
    /// # Errors
    /// When there is no memory for it.
    pub fn try_crop(&self, window: &Window) -> Result<Self, OutOfMemory> {
        Ok(self.on(self.offset.try_crop(window)?))
    }

    /// Size in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.offset.bytes() + size_of::<Column>() + size_of_val(&self.column.layers[..])
    }
}
