// One plane of a colour over that of another; see crates/nodes/src/render/blend.rs.

fn blended(a: f32, b: f32) -> f32 {
    switch (p.mode) {
        case MODE_MULTIPLY: { return a * b; }
        case MODE_SCREEN: { return a + b - a * b; }
        case MODE_OVERLAY: {
            if (a < 0.5) {
                return 2.0 * a * b;
            }
            return 1.0 - 2.0 * (1.0 - a) * (1.0 - b);
        }
        case MODE_ADD: { return min(a + b, 1.0); }
        case MODE_SUBTRACT: { return max(a - b, 0.0); }
        case MODE_DARKEN: { return min(a, b); }
        case MODE_LIGHTEN: { return max(a, b); }
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
    let a = read_below(i);
    let whole = blended(a, read_above(i));
    let mask = read_mask(i);
    out_colour[i] = checked(select(whole, a + (whole - a) * mask, mask < 1.0));
}
