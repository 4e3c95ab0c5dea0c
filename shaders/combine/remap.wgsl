// Values from one range to another; see crates/nodes/src/combine/remap.rs.

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    var share = (read_value(i) - p.from_x) / (p.from_y - p.from_x);
    if (p.clamp != 0u) {
        share = clamp(share, 0.0, 1.0);
    }
    var value = p.to_x * (1.0 - share) + p.to_y * share;
    if (p.spacing == SPACING_LOGARITHMIC) {
        value = p.to_x * exp_2(p.octaves * share);
    }
    out_value[i] = checked(clamp(value, p.least, p.most));
}
