// Closed cells of crates/nodes/src/numerics/repose, whose rise at repose is infinite there: drivers may assume that no number
// is.

/// Rises at repose above this are those of closed cells, or of means with one.
const SHUT: f32 = 1e20;
const CLOSED: f32 = 1e30;
