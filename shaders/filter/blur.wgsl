// Smoothed values, mixed with those before by the mask; see crates/nodes/src/filter/blur.rs.

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    out_value[i] = checked(masked(read_value(i), before[i], read_mask(i)));
}
