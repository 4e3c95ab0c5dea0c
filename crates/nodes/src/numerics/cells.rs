//! Processes cells in blocks, with inputs that are rasters or one number for all cells.

use orograph_graph::{Job, Lane, NodeError};

/// Cells per block: few enough for the first-level cache.
pub const BLOCK: usize = 1024;

/// Returns the samples of a lane for a block of cells that starts at cell `first`.
#[must_use]
pub fn samples<'a>(lane: Lane<'a>, first: usize, len: usize, spare: &'a mut [f32; BLOCK]) -> &'a [f32] {
    match lane.slice(first..first + len) {
        Lane::Samples(samples) => samples,
        Lane::Constant(value) => {
            spare[..len].fill(value);
            &spare[..len]
        }
    }
}

/// Calls `block(cells, first)` for blocks of cells of `out`, in parallel, where `first` is the index of a block's first
/// cell in the field.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn blocks(
    job: &Job<'_>,
    share: [f32; 2],
    out: &mut [f32],
    block: impl Fn(&mut [f32], usize) + Sync,
) -> Result<(), NodeError> {
    let nx = job.window().nx();
    crate::numerics::par::rows_within(job, share, out, |j, row| {
        for (k, cells) in row.chunks_mut(BLOCK).enumerate() {
            block(cells, j * nx + k * BLOCK);
        }
    })
}

/// Returns `new` where the mask is 1, `old` where it is 0 (both exactly), and the weighted mean in between.
#[must_use]
#[inline(always)]
pub fn masked(old: f32, new: f32, mask: f32) -> f32 {
    old * (1.0 - mask) + new * mask
}
