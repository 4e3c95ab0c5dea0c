// A linear ramp between two values; see crates/nodes/src/generate/gradient.rs.

const TURN: f32 = 6.2831855;

/// The angle of a direction in turns, 0 to 1, from `x` towards `y`.
fn turns(y: f32, x: f32) -> f32 {
    var angle = 0.0;
    if (abs(y) > abs(x)) {
        angle = copy_sign(1.5707964, y) - arc_tangent(x / y);
    } else if (x > 0.0) {
        angle = arc_tangent(y / x);
    } else if (x < 0.0) {
        angle = arc_tangent(y / x) + copy_sign(3.1415927, y);
    }
    let part = angle / TURN;
    return part - floor(part);
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let dx = p.from_centre_x + f32(cell.x) * p.cell_m;
    let dy = p.from_centre_y + f32(cell.y) * p.cell_m;
    let ahead = dx * p.sine - dy * p.cosine;
    let right = dx * p.cosine + dy * p.sine;
    var way = 0.0;
    switch (p.form) {
        case FORM_LINEAR: { way = 0.5 + ahead / p.length; }
        case FORM_RADIAL: { way = sqrt(dx * dx + dy * dy) / p.length; }
        default: {
            way = turns(right, ahead);
            if (p.beyond == BEYOND_MIRROR) {
                way *= 2.0;
            }
        }
    }
    var share = 0.0;
    switch (p.beyond) {
        case BEYOND_HOLD: { share = clamp(way, 0.0, 1.0); }
        case BEYOND_REPEAT: { share = way - floor(way); }
        default: { share = 1.0 - abs(way - 2.0 * floor(0.5 * way) - 1.0); }
    }
    out_value[at(cell.x, cell.y)] = checked(p.start + p.change * share);
}
