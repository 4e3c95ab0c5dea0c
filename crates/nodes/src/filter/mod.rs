//! Filters: each value becomes a function of its neighbourhood.

pub mod bilateral;
pub mod blur;
pub mod carve;
pub mod despike;
pub mod drain;
pub mod median;
pub mod morphology;
pub mod resample;
pub mod sharpen;
pub mod smear;
pub mod smooth_lines;
pub mod terrace;
pub mod tile;
pub mod transform;
pub mod warp;

use orograph_graph::{Job, Lane, Node, NodeError};

use crate::numerics::cells::{BLOCK, blocks, masked, samples};

/// The nodes of this category, in palette order.
pub static NODES: &[&Node] = &[
    &blur::NODE,
    &bilateral::NODE,
    &median::NODE,
    &despike::NODE,
    &sharpen::NODE,
    &smear::NODE,
    &terrace::NODE,
    &warp::NODE,
    &carve::NODE,
    &drain::NODE,
    &smooth_lines::NODE,
    &transform::NODE,
    &resample::NODE,
    &tile::NODE,
    &morphology::NODE,
];

/// Blends the filtered values with the old ones: `old` where the mask is 0, `new` where it is 1, the weighted mean in
/// between.
fn mix(job: &Job<'_>, old: &[f32], new: &mut [f32], mask: Lane<'_>) -> Result<(), NodeError> {
    if mask.constant() == Some(1.0) {
        return Ok(());
    }
    blocks(job, [0.9, 1.0], new, |cells, first| {
        let mut spare = [0.0; BLOCK];
        let mask = samples(mask, first, cells.len(), &mut spare);
        for ((new, &old), &mask) in cells.iter_mut().zip(&old[first..]).zip(mask) {
            *new = masked(old, *new, mask);
        }
    })
}
