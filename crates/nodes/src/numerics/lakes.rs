//! Lakes as connected components.

use orograph_graph::{Job, NodeError};

use super::components::components;
use crate::numerics::par;

/// Returns the number of the lake at each cell, 0 where it is dry. Adjacent wet cells, diagonals included, belong to
/// one lake; lakes are numbered from 1 by their first cells, row by row from the north-west corner.
///
/// Numbers are exact up to 2^24, the limit of consecutive integers in single precision.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn numbers(job: &Job<'_>, depth: &[f32]) -> Result<Vec<f32>, NodeError> {
    Ok(par::map_of(&components(job, true, |cell| depth[cell] > 0.0)?.of, |&number| number as f32))
}
