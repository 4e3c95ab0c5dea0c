// Pointers downstream that reach twice as far with each pass. `NOWHERE` is past the last cell of a way.

/// To the receiver; the bottom of a depression points to itself.
@compute @workgroup_size(64)
fn to_bottom(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let own = code[i];
    if (own == PIT) {
        next[i] = i;
    } else if (own == OUTLET) {
        next[i] = NOWHERE;
    } else {
        next[i] = beside(cell, own);
    }
}

/// To the receiver; ways end at the bottom of a depression.
@compute @workgroup_size(64)
fn to_receiver(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let own = code[i];
    next[i] = NOWHERE;
    if (own < PIT) {
        next[i] = beside(cell, own);
    }
}

/// The same; from the bottom of a depression ways go on where its water reappears.
@compute @workgroup_size(64)
fn to_reappear(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let own = code[i];
    if (own == PIT) {
        next[i] = pointer[i];
    } else if (own == OUTLET) {
        next[i] = NOWHERE;
    } else {
        next[i] = beside(cell, own);
    }
}

fn twice(q: u32) -> u32 {
    if (q == NOWHERE) {
        return NOWHERE;
    }
    return pointer[q];
}

/// Twice as far.
@compute @workgroup_size(64)
fn reach(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let far = twice(pointer[i]);
    next[i] = far;
    if (far != pointer[i]) {
        atomicStore(&changed[0], 1u);
    }
}

/// Twice as far; cells that a marked one points to are marked.
@compute @workgroup_size(64)
fn reach_marking(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let q = pointer[i];
    if (q != NOWHERE && atomicLoad(&marks[i]) != 0u) {
        atomicStore(&marks[q], 1u);
    }
    next[i] = twice(q);
}
