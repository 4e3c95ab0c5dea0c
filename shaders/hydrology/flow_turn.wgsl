// Turns the ways from the bottoms of basins to their passes around, so that their water leaves there.

/// The direction in which a basin drains from a cell of it: 8 if its pass is not there, `OUTLET` if the way leaves the world.
fn exit_at(i: u32, own: u32) -> u32 {
    let link = ~links[own];
    let number = link & 7u;
    let owner = link >> 3u;
    if (number == 4u) {
        return select(8u, OUTLET, owner == i);
    }
    let way = select(number + 4u, 0u, number == 0u);
    if (bottom[owner] == own) {
        return select(8u, way, owner == i);
    }
    return select(8u, opposite(way), beside(cell_at(owner), way) == i);
}

/// Marks the cells before the passes.
@compute @workgroup_size(64)
fn begin(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let own = bottom[i];
    marks[i] = 0u;
    if (own != NOWHERE && heights[own] != 0u && exit_at(i, own) != 8u) {
        marks[i] = 1u;
    }
}

/// Turns marked cells around: each to the marked one that it drained, the first to the pass.
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    var found = code[i];
    if (marks[i] != 0u) {
        found = exit_at(i, bottom[i]);
        for (var way = 0u; way < 8u && found == 8u; way++) {
            let j = beside(cell, way);
            if (j != NOWHERE && marks[j] != 0u && code[j] == opposite(way)) {
                found = way;
            }
        }
    }
    turned[i] = found;
}
