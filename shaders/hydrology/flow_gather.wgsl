// Sums and greatest values along ways downstream, with pointers that reach twice as far with each pass. Sums are whole
// numbers of one word or two, so that no order of additions matters.

@compute @workgroup_size(64)
fn ones(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    atomicStore(&sum[at(cell.x, cell.y)], 1u);
}

@compute @workgroup_size(64)
fn own_height(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    atomicStore(&sum[i], ordered(read_height(i)));
}

/// Passes on a pointer; notes if there is one left.
fn pass_on(i: u32, q: u32) {
    var far = NOWHERE;
    if (q != NOWHERE) {
        far = pointer[q];
    }
    next[i] = far;
    if (far != NOWHERE) {
        atomicStore(&changed[0], 1u);
    }
}

@compute @workgroup_size(64)
fn add(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let q = pointer[i];
    atomicAdd(&sum[i], low[i]);
    if (q != NOWHERE) {
        atomicAdd(&sum[q], low[i]);
    }
    pass_on(i, q);
}

/// The greatest value on the way of each cell, which starts with its own.
@compute @workgroup_size(64)
fn greatest(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let q = pointer[i];
    var value = low[i];
    if (q != NOWHERE) {
        value = max(value, low[q]);
    }
    atomicStore(&sum[i], value);
    pass_on(i, q);
}
