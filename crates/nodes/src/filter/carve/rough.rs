//! The roughness of the terrain: what banks keep of it.
//!
//! A bed that blends into the terrain by a weight alone has banks without any form, level beside the bed: they look like
//! a strip that was rolled. What is shorter than the bank is therefore added to the banks again.

use orograph_graph::{Job, NodeError, Sizing};

use super::Params;
use crate::numerics::{gaussian::Gaussian, lines::separable, par, voids};

/// The standard deviation of the filter that separates roughness from terrain, in banks.
const SMOOTHED: f64 = 0.5;

fn sigma_m(params: &Params) -> f64 {
    SMOOTHED * params.bank
}

/// Returns the terrain less its smoothed form. Empty where banks keep none of it.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn of(job: &Job<'_>, land: &[f32], params: &Params) -> Result<Vec<f32>, NodeError> {
    if params.detail <= 0.0 || params.bank <= 0.0 {
        return Ok(Vec::new());
    }
    let filled = voids::filled(job, land)?;
    let mut rough = separable(job, [0.0, 0.3], &filled, &Gaussian::new(sigma_m(params) / job.cell_m()))?;
    par::change_with(&mut rough, &filled, |smooth, land| *smooth = land - *smooth);
    Ok(rough)
}

/// Bytes that [`of`] needs in addition to its result.
pub fn bytes(sizing: &Sizing<'_>, params: &Params) -> u64 {
    if params.detail > 0.0 { Gaussian::bytes(sigma_m(params), &sizing.window) } else { 0 }
}

/// Bytes of its result.
pub fn kept_bytes(sizing: &Sizing<'_>, params: &Params) -> u64 {
    if params.detail > 0.0 && params.bank > 0.0 { sizing.cells(4.0) } else { 0 }
}
