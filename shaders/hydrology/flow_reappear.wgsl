// Where the water of each depression reappears: the first cell beyond the pass. `turned` are the receivers that lead out of
// depressions, `bottom` the bottoms of the basins of those that do not.

@compute @workgroup_size(64)
fn begin(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (!is_outside(cell)) {
        beyond[at(cell.x, cell.y)] = NOWHERE;
    }
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let own = bottom[i];
    if (own == NOWHERE || turned[i] >= PIT) {
        return;
    }
    let j = beside(cell, turned[i]);
    // one cell of each basin drains out of it
    if (bottom[j] != own) {
        beyond[own] = j;
    }
}
