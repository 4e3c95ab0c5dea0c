// Compass direction of descent, and a mask of a range of directions; see crates/nodes/src/select/aspect.rs.

/// The direction of descent, given the slopes to the east and to the south.
fn facing(east: f32, south: f32) -> f32 {
    if (east == 0.0 && south == 0.0) {
        return -1.0;
    }
    // clockwise from north: y is towards the west slope's descent, x towards the south slope's
    let y = -east;
    let x = south;
    var angle = 0.0;
    if (abs(y) > abs(x)) {
        angle = copy_sign(1.5707964, y) - arc_tangent(x / y);
    } else if (x > 0.0) {
        angle = arc_tangent(y / x);
    } else {
        angle = arc_tangent(y / x) + copy_sign(3.1415927, y);
    }
    let degrees = angle * 57.29578;
    if (degrees < 0.0) {
        return min(degrees + 360.0, 359.99997);
    }
    return degrees;
}

/// The angle between two directions, 0° to 180°.
fn apart(a: f32, b: f32) -> f32 {
    let difference = a - b;
    let turn = difference - 360.0 * floor(difference / 360.0);
    return min(turn, 360.0 - turn);
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let gradient = horn(cell);
    let aspect = facing(gradient.x, gradient.y);
    let i = at(cell.x, cell.y);
    if (p.wants_aspect != 0u) {
        out_aspect[i] = checked(aspect);
    }
    if (p.wants_mask != 0u) {
        let outside = max(apart(aspect, p.azimuth) - 0.5 * p.width, 0.0);
        var chosen = 1.0;
        if (outside > 0.0) {
            chosen = smooth_step(1.0 - outside / max(p.falloff, 1e-30));
        }
        let slope = sqrt(gradient.x * gradient.x + gradient.y * gradient.y);
        var sloping = 1.0;
        if (slope < p.steep) {
            sloping = smooth_step(slope / p.steep);
        }
        out_mask[i] = checked(select(chosen * sloping, 0.0, aspect < 0.0));
    }
}
