// Outputs of crates/nodes/src/hydrology/flow, each to a plane that is bound as `plane`.

@compute @workgroup_size(64)
fn direction(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let code = words[i];
    plane[i] = checked(select(-1.0, f32(code), code < PIT));
}

/// -2 where water reappears elsewhere.
@compute @workgroup_size(64)
fn jumping_direction(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let code = words[i];
    let still = select(-1.0, -2.0, code == PIT && more[i] != NOWHERE);
    plane[i] = checked(select(still, f32(code), code < PIT));
}

/// A sum of whole numbers times `k_each`.
@compute @workgroup_size(64)
fn amount(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    plane[i] = checked(f32(words[i]) * p.k_each);
}

/// The same with two words.
@compute @workgroup_size(64)
fn wide_amount(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    plane[i] = checked((f32(more[i]) * 4294967296.0 + f32(words[i])) * p.k_each);
}

/// The terrain, or standing water on it.
@compute @workgroup_size(64)
fn level(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let here = read_height(i);
    let water = from_ordered(words[i]);
    plane[i] = checked(select(here, water, water > here));
}

@compute @workgroup_size(64)
fn depth(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let here = read_height(i);
    let water = from_ordered(words[i]);
    plane[i] = checked(select(0.0, water - here, water > here));
}

/// The number of the first cell of a lake.
@compute @workgroup_size(64)
fn lake(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    var number = 0u;
    if (words[i] != NOWHERE) {
        number = more[words[i]];
    }
    plane[i] = checked(f32(number));
}
