// Discs, rectangles and polygons by their signed distance; see crates/nodes/src/generate/shape.rs.

/// The signed distance to a polygon; its corners are relative to the first cell of the window.
fn to_polygon(x: f32, y: f32) -> f32 {
    var nearest = 3.4e38;
    var sign_of = 1.0;
    for (var k = 0u; k < p.corners; k++) {
        let next = (k + 1u) % p.corners;
        let from_x = path_of[2u * k];
        let from_y = path_of[2u * k + 1u];
        let to_x = path_of[2u * next];
        let to_y = path_of[2u * next + 1u];
        let ex = to_x - from_x;
        let ey = to_y - from_y;
        let square = ex * ex + ey * ey;
        let dx = x - from_x;
        let dy = y - from_y;
        var t = 0.0;
        if (square > 0.0) {
            t = clamp((dx * ex + dy * ey) / square, 0.0, 1.0);
        }
        let px = dx - t * ex;
        let py = dy - t * ey;
        nearest = min(nearest, px * px + py * py);
        if ((from_y > y) != (to_y > y) && x < from_x + dy / ey * ex) {
            sign_of = -sign_of;
        }
    }
    return sign_of * sqrt(nearest) - p.rounding;
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let x = f32(cell.x) * p.cell_m;
    let y = f32(cell.y) * p.cell_m;
    let dx = x + p.from_centre_x;
    let dy = y + p.from_centre_y;
    let across = abs(dx * p.cosine + dy * p.sine);
    let length_of = abs(dx * p.sine - dy * p.cosine);
    var distance_m = 0.0;
    switch (p.figure) {
        case FIGURE_POLYGON: { distance_m = to_polygon(x, y); }
        case FIGURE_RECTANGLE: {
            let out_x = across - p.inner_x;
            let out_y = length_of - p.inner_y;
            let beyond = vec2<f32>(max(out_x, 0.0), max(out_y, 0.0));
            distance_m = sqrt(beyond.x * beyond.x + beyond.y * beyond.y) + min(max(out_x, out_y), 0.0) - p.cut;
        }
        default: { distance_m = sqrt(across * across + length_of * length_of) - p.radius; }
    }
    let i = at(cell.x, cell.y);
    if (p.wants_distance != 0u) {
        out_distance[i] = checked(distance_m);
    }
    if (p.wants_mask != 0u) {
        out_mask[i] = checked(smooth_step(0.5 - distance_m * p.per_softness));
    }
}
