//! No pits but those of the model.
//!
//! What puts the means right may close a valley, mostly by centimetres. Each such pit is drained by a cut along the path from its
//! bottom over its pass (as Lindsay 2016 breaches depressions); water that stood in the model stays, at its level or lower.

use orograph_graph::memory::{OutOfMemory, collected, copied, zeroed};
use rayon::prelude::*;

use super::detail::Land;
use crate::{
    numerics::routing::{Depressions, drainage::Amount},
    prelude::*,
};

/// The standing water of the model.
pub struct Lakes {
    /// Level of the water over each cell in metres; below everything where there is none.
    levels: Vec<f32>,
}

/// A height that rivers cut down to.
#[derive(Clone, Copy)]
struct Lowest(f64);

impl Amount for Lowest {
    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        Self(self.0.min(other.0))
    }
}

impl Lakes {
    /// The water in the depressions of the model.
    pub fn of(depressions: &Depressions<f64>, model: &[f64]) -> Result<Self, OutOfMemory> {
        let mut filled = copied(model)?;
        depressions.fill(&mut filled);
        let mut levels: Vec<f32> = zeroed(model.len())?;
        levels.par_iter_mut().zip(filled).zip(model).for_each(|((level, filled), &model)| {
            *level = if filled > model { filled as f32 } else { f32::NEG_INFINITY };
        });
        Ok(Self { levels })
    }

    /// Cuts ways out of all depressions that the model did not have.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn drain(&self, job: &Job<'_>, land: &Land, heights: &mut [f64]) -> Result<(), NodeError> {
        let mut lowest = collected(heights.iter().map(|&height| Lowest(height)))?;
        land.drainage.downstream(job, &land.grid, &land.codes, &mut lowest, |cell, _, Lowest(own)| {
            Lowest(own.max(f64::from(self.levels[cell])))
        })?;
        heights.par_iter_mut().zip(lowest).for_each(|(height, Lowest(lowest))| *height = lowest);
        Ok(())
    }
}
