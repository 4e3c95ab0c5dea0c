// Heights with the detail above smoothed ones amplified; see crates/nodes/src/filter/sharpen.rs.

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let height = read_height(i);
    let sharp = height + p.amount * (height - before[i]);
    out_height[i] = checked(masked(height, sharp, read_mask(i)));
}
