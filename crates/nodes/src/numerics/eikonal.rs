//! The upwind scheme of the eikonal equation |∇T| = 1.

/// The distance of a cell, given the smaller distance of its neighbours along a row and of those along a column,
/// infinite where there is none: the first-order scheme of J. A. Sethian (1996), A fast marching level set method for
/// monotonically advancing fronts. Distances are in cells.
#[must_use]
#[inline(always)]
pub fn upwind(along: f32, across: f32) -> f32 {
    let apart = along - across;
    if apart.abs() < 1.0 { 0.5 * (along + across + (2.0 - apart * apart).sqrt()) } else { along.min(across) + 1.0 }
}
