// Values between two limits; see crates/nodes/src/combine/clamp.rs.

fn rounding(a: f32, b: f32, radius: f32) -> f32 {
    let overlap = max(radius - abs(a - b), 0.0);
    if (radius > 0.0) {
        return overlap * overlap / (4.0 * radius);
    }
    return 0.0;
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let value = read_value(i);
    let low = read_low(i);
    let high = read_high(i);
    let knee = max(min(p.knee, 0.5 * (high - low)), 0.0);
    let below = min(value, high) - rounding(value, high, knee);
    let inside = max(below, low) + rounding(below, low, knee);
    out_value[i] = checked(masked(value, inside, read_mask(i)));
}
