// Two rasters combined cell by cell; see crates/nodes/src/combine/combine.rs.

fn rounding(a: f32, b: f32) -> f32 {
    let overlap = max(p.radius - abs(a - b), 0.0);
    if (p.radius > 0.0) {
        return overlap * overlap / (4.0 * p.radius);
    }
    return 0.0;
}

fn combined(a: f32, b: f32) -> f32 {
    let full = p.full;
    switch (p.mode) {
        case MODE_ADD: { return a + b; }
        case MODE_SUBTRACT: { return a - b; }
        case MODE_MULTIPLY: { return a * b; }
        case MODE_MIN: { return min(a, b); }
        case MODE_MAX: { return max(a, b); }
        case MODE_SMOOTH_MIN: { return min(a, b) - rounding(a, b); }
        case MODE_SMOOTH_MAX: { return max(a, b) + rounding(a, b); }
        case MODE_AVERAGE: { return (a + b) * 0.5; }
        case MODE_DIFFERENCE: { return abs(a - b); }
        case MODE_SCREEN: { return full - (full - a) * (full - b) / full; }
        case MODE_OVERLAY: {
            if (a + a < full) {
                return 2.0 * a * b / full;
            }
            return full - 2.0 * (full - a) * (full - b) / full;
        }
        case MODE_POWER: { return copy_sign(full * power(abs(a) / full, b), a); }
        default: { return b; }
    }
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let a = read_a(i);
    let b = read_b(i);
    var mask = read_mask(i) * (1.0 - read_keep(i));
    if (p.mode == MODE_HEIGHT_BLEND) {
        let above = clamp((b - a) / max(p.radius, 1.17549435e-38), -1e9, 1e9);
        mask = clamp(mask + 2.0 * mask * (1.0 - mask) * above, 0.0, 1.0);
    }
    var value = masked(a, combined(a, b), mask);
    if (p.clamp != 0u) {
        value = clamp(value, 0.0, p.full);
    }
    out_value[i] = checked(value);
}
