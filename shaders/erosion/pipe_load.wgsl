// Bed and water at the start of a step; see crates/nodes/src/erosion/hydraulic_pipe/flow.rs.

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let height = bed_from(read_height(i) + change[i]);
    bed[i] = height;
    wet[i] = select(water[i] + rain_of[i] * p.k_rain, 0.0, is_hole(height));
}
