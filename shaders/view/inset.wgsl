// An inset: a part of the land at finer cells, which over a band along its edge goes over into the land around it
// (crates/app/src/view/inset.rs).

// How much of the inset there is at a place in its cells.
fn inset_share(at: vec2f) -> f32 {
    let near = min(at - frame.sides.xy, frame.sides.zw - at);
    let t = clamp(min(near.x, near.y) * frame.corner.z, 0.0, 1.0);
    return t * t * (3.0 - 2.0 * t);
}

// A place in the inset's cells as one in the cells of the land around it, both counted from cell centres.
fn in_cells_around(cell: vec2f, around: vec2f) -> vec2f {
    return ((cell + 0.5) / vec2f(frame.cells) * frame.over.zw + frame.over.xy) * around - 0.5;
}
