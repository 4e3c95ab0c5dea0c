// Slope angle, and a mask of a range of slopes; see crates/nodes/src/select/slope.rs.

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    var gradient = vec2<f32>(0.0);
    if (p.method == METHOD_HORN) {
        gradient = horn(cell);
    } else {
        gradient = central(cell);
    }
    let slope = arc_tangent(sqrt(gradient.x * gradient.x + gradient.y * gradient.y)) * 57.29578;
    let i = at(cell.x, cell.y);
    if (p.wants_slope != 0u) {
        out_slope[i] = checked(slope);
    }
    if (p.wants_mask != 0u) {
        out_mask[i] = checked(within(slope, p.from_of, p.to, p.falloff));
    }
}
