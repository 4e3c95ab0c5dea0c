//! Filters: what a field becomes by its surroundings.

pub mod blur;
pub mod extremes;
pub mod gaussian;
pub mod lines;
pub mod morphology;
pub mod sharpen;
pub mod terrace;
pub mod warp;

use orograph_graph::{Job, Lane, Node, NodeError};

use crate::cells::{BLOCK, blocks, masked, samples};

/// The nodes of this category, in palette order.
pub static NODES: &[&Node] = &[&blur::NODE, &sharpen::NODE, &terrace::NODE, &warp::NODE, &morphology::NODE];

/// Replaces `new` by `old` where the mask is 0, by the weighted mean of both between 0 and 1.
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
