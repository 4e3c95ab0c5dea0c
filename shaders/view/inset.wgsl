// An inset: a part of the terrain at finer cells, blended with the terrain around it over a band along its edge
// (crates/app/src/view/inset.rs).

// The weight of the inset at a position in its cells.
fn inset_share(at: vec2f) -> f32 {
    let near = min(at - frame.sides.xy, frame.sides.zw - at);
    let t = clamp(min(near.x, near.y) * frame.corner.z, 0.0, 1.0);
    return t * t * (3.0 - 2.0 * t);
}

// Converts a position in cells of the inset to cells of the terrain around it, both counted from cell centres.
fn in_cells_around(cell: vec2f, around: vec2f) -> vec2f {
    return ((cell + 0.5) / vec2f(frame.cells) * frame.over.zw + frame.over.xy) * around - 0.5;
}
