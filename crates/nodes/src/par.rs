//! Parallel loops over rows that report progress and can be cancelled.

use std::sync::atomic::{AtomicUsize, Ordering};

use orograph_graph::{Job, NodeError};
use rayon::prelude::*;

/// Calls `row(j, samples)` for each row of `out`, in parallel, checking for cancellation at each row. `share` is the
/// part of the job's whole progress that these rows are, from where to where.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn rows_within(
    job: &Job<'_>,
    share: [f32; 2],
    out: &mut [f32],
    row: impl Fn(usize, &mut [f32]) + Sync,
) -> Result<(), NodeError> {
    let nx = job.window().nx();
    let count = out.len().div_ceil(nx.max(1));
    let done = AtomicUsize::new(0);
    out.par_chunks_mut(nx.max(1)).enumerate().try_for_each(|(j, samples)| {
        row(j, samples);
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        if done.is_multiple_of(64) || done == count {
            job.advance(share[0] + (share[1] - share[0]) * done as f32 / count as f32)
        } else {
            job.check()
        }
    })
}

/// [`rows_within`] for rows that are the whole job.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn rows(job: &Job<'_>, out: &mut [f32], row: impl Fn(usize, &mut [f32]) + Sync) -> Result<(), NodeError> {
    rows_within(job, [0.0, 1.0], out, row)
}

/// A raster that is made row by row in the memory of another, whose samples each row has at first; in memory of its own if the
/// other is `kept`.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn rows_from(
    job: &Job<'_>,
    share: [f32; 2],
    from: &mut Vec<f32>,
    kept: bool,
    row: impl Fn(usize, &mut [f32]) + Sync,
) -> Result<Vec<f32>, NodeError> {
    let mut out = if kept { from.clone() } else { std::mem::take(from) };
    rows_within(job, share, &mut out, row)?;
    Ok(out)
}

/// Calls `band(j, rows)` for each band of `height` rows of `out` (the last may be lower), in parallel, where j is the
/// band's first row. For kernels that keep something from row to row.
///
/// # Errors
/// What `band` gives back, or [`NodeError::Cancelled`].
pub fn bands_within(
    job: &Job<'_>,
    share: [f32; 2],
    height: usize,
    out: &mut [f32],
    band: impl Fn(usize, &mut [f32]) -> Result<(), NodeError> + Sync,
) -> Result<(), NodeError> {
    let size = job.window().nx().max(1) * height.max(1);
    let count = out.len().div_ceil(size);
    let done = AtomicUsize::new(0);
    out.par_chunks_mut(size).enumerate().try_for_each(|(k, rows)| {
        band(k * height, rows)?;
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        job.advance(share[0] + (share[1] - share[0]) * done as f32 / count as f32)
    })
}
