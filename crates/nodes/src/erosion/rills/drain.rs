//! Drains all depressions that the model does not have.
//!
//! The correction of the means may block a valley, mostly by centimetres. Each such depression is breached along the
//! flow path from its bottom over its pass (after Lindsay 2016). Lakes of the model remain, at their level or lower.

use orograph_graph::memory::{OutOfMemory, collected, copied, zeroed};

use super::detail::Land;
use crate::{
    numerics::{
        par,
        routing::{Depressions, drainage::Amount},
    },
    prelude::*,
};

/// Lakes of the model.
pub struct Lakes {
    /// Water level over each cell in metres; −∞ on dry cells.
    levels: Vec<f32>,
}

/// Upper limit on the height of a cell: the lowest height upstream.
#[derive(Clone, Copy)]
struct Lowest(f64);

impl Amount for Lowest {
    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        Self(self.0.min(other.0))
    }
}

impl Lakes {
    /// Finds the lakes in the depressions of the model.
    pub fn of(depressions: &Depressions<f64>, model: &[f64]) -> Result<Self, OutOfMemory> {
        let mut filled = copied(model)?;
        depressions.fill(&mut filled);
        let mut levels: Vec<f32> = zeroed(model.len())?;
        par::change_at(&mut levels, |cell, level| {
            *level = if filled[cell] > model[cell] { filled[cell] as f32 } else { f32::NEG_INFINITY };
        });
        Ok(Self { levels })
    }

    /// Breaches all depressions that the model does not have.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn drain(&self, job: &Job<'_>, land: &Land, heights: &mut [f64]) -> Result<(), NodeError> {
        let mut lowest = collected(heights.iter().map(|&height| Lowest(height)))?;
        land.drainage.downstream(job, &land.grid, &land.codes, &mut lowest, |cell, _, Lowest(own)| {
            Lowest(own.max(f64::from(self.levels[cell])))
        })?;
        par::change_with(heights, &lowest, |height, Lowest(lowest)| *height = *lowest);
        Ok(())
    }
}
