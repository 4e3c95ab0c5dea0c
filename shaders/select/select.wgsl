// A mask of a range of values; see crates/nodes/src/select/select.rs.

/// The decimal logarithm, or a value below all others for values that have none.
fn order(value: f32) -> f32 {
    if (value > 0.0) {
        return log_2(value) * 0.30103;
    }
    return -1e6;
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    var value = read_value(i);
    if (p.scale == SCALE_LOGARITHMIC) {
        value = order(value);
    }
    var mask = within(value, p.low, p.high, p.falloff);
    if (p.invert != 0u) {
        mask = 1.0 - mask;
    }
    out_mask[i] = checked(mask);
}
