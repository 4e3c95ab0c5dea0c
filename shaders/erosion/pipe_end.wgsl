// The results of a storm; see crates/nodes/src/erosion/hydraulic_pipe/storm.rs.

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let land = read_height(i);
    let gain = change[i];
    if (p.wants_height != 0u) {
        out_height[i] = checked(select(land + gain, land, gain == 0.0));
    }
    if (p.wants_deposition != 0u) {
        out_deposition[i] = checked(gain);
    }
    if (p.wants_water != 0u) {
        out_water[i] = checked(water[i]);
    }
    if (p.wants_sediment != 0u) {
        out_sediment[i] = checked(sediment[i]);
    }
    if (p.wants_flow != 0u) {
        out_flow[i] = checked(passed[i] * p.k_per_time);
    }
}
