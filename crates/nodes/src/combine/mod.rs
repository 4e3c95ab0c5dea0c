//! Arithmetic and curves over fields.

#[expect(clippy::module_inception, reason = "a node's file has the name of the node")]
pub mod combine;
pub mod curve;
pub mod remap;

use orograph_graph::{Job, Lane, Node};

/// The nodes of this category, in palette order.
pub static NODES: &[&Node] = &[&combine::NODE, &curve::NODE, &remap::NODE];

/// Cells that are worked on at once: few enough for the first-level cache.
const BLOCK: usize = 1024;

/// The samples of a lane, one per cell of a block that starts at cell `first`.
fn samples<'a>(lane: Lane<'a>, first: usize, len: usize, spare: &'a mut [f32; BLOCK]) -> &'a [f32] {
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
fn blocks(
    job: &Job<'_>,
    out: &mut [f32],
    block: impl Fn(&mut [f32], usize) + Sync,
) -> Result<(), orograph_graph::NodeError> {
    let nx = job.window().nx();
    crate::par::rows(job, out, |j, row| {
        for (k, cells) in row.chunks_mut(BLOCK).enumerate() {
            block(cells, j * nx + k * BLOCK);
        }
    })
}

/// `new` where the mask is 1, `old` where it is 0, the weighted mean between; exactly so at 0 and 1.
#[inline(always)]
fn masked(old: f32, new: f32, mask: f32) -> f32 {
    old * (1.0 - mask) + new * mask
}
