//! Lakes as objects: which cells are one body of water.

use orograph_graph::{Job, NodeError};
use rayon::prelude::*;

use crate::components::components;

/// The number of the lake that each cell is under, 0 on dry land. Cells under water that touch, across a corner too, are
/// one lake; lakes are numbered from 1 by their first cells, row by row from the north-west corner.
///
/// Numbers are exact up to 2^24, the whole numbers that a sample holds.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn numbers(job: &Job<'_>, depth: &[f32]) -> Result<Vec<f32>, NodeError> {
    Ok(components(job, true, |cell| depth[cell] > 0.0)?.of.into_par_iter().map(|number| number as f32).collect())
}
