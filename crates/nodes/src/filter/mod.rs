//! Filters: what a field becomes by its surroundings.

pub mod blur;
pub mod gaussian;
pub mod lines;
pub mod sharpen;
pub mod terrace;

use orograph_graph::{Job, Lane, Node, NodeError};

/// The nodes of this category, in palette order.
pub static NODES: &[&Node] = &[&blur::NODE, &sharpen::NODE, &terrace::NODE];

/// Replaces `new` by `old` where the mask is 0, by the weighted mean of both between 0 and 1.
fn mix(job: &Job<'_>, old: &[f32], new: &mut [f32], mask: Lane<'_>) -> Result<(), NodeError> {
    if mask.constant() == Some(1.0) {
        return Ok(());
    }
    let nx = job.window().nx();
    crate::par::rows_within(job, [0.9, 1.0], new, |j, row| {
        let mask = mask.slice(j * nx..j * nx + row.len());
        for (i, (new, &old)) in row.iter_mut().zip(&old[j * nx..]).enumerate() {
            let share = mask.at(i);
            *new = old * (1.0 - share) + *new * share;
        }
    })
}
