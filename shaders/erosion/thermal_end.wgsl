// The outputs of a slide; see crates/nodes/src/erosion/thermal/device.rs.

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let here = at(cell.x, cell.y);
    let place = cell.y * p.k_wide + cell.x;
    var slid = moved[place];
    // gains and losses add up to nothing
    slid = select(slid, slid * p.k_share, slid > 0.0);
    var failed = 0.0;
    var layer = 0.0;
    if (p.k_layered != 0u) {
        failed = rock[here];
        layer = loose[place];
    }
    let swelled = p.k_swelling * failed;
    let start = read_height(here);
    let ground = select(start + swelled, start, swelled == 0.0);
    if (p.wants_height != 0u) {
        out_height[here] = checked(select(ground + slid, ground, slid == 0.0));
    }
    if (p.wants_moved != 0u) {
        out_moved[here] = checked(swelled + slid);
    }
    if (p.wants_debris != 0u) {
        out_debris[here] = checked(max(layer + slid, 0.0));
    }
    if (p.wants_crumbled != 0u) {
        out_crumbled[here] = checked(failed);
    }
}
