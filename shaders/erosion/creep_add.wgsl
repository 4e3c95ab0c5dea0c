// What cells have gained, and the terrain at the end; see crates/nodes/src/erosion/creep/device.rs.

/// Takes over what was solved for: the gain in a step, or that since the start.
@compute @workgroup_size(64)
fn add(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    if (p.k_far != 0u) {
        moved[i] = solved[i];
    } else {
        moved[i] += solved[i];
    }
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    if (p.wants_height != 0u) {
        out_height[i] = checked(read_height(i) + moved[i]);
    }
    if (p.wants_moved != 0u) {
        out_moved[i] = checked(moved[i]);
    }
}
