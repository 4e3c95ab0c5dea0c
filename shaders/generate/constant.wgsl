// The same value in every cell.

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    out_value[at(cell.x, cell.y)] = checked(p.value);
}
