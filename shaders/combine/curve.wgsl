// A raster mapped through a curve; see crates/nodes/src/combine/curve.rs.

/// A cubic from x on.
struct Piece {
    x: f32,
    y: f32,
    a: f32,
    b: f32,
    c: f32,
}

fn e_to(x: f32) -> f32 {
    return power(2.7182817, x);
}

fn tangent(x: f32) -> f32 {
    let square = x * x;
    return x * (945.0 - square * (105.0 - square)) / (945.0 - square * (420.0 - 15.0 * square));
}

/// A function from 0..1 to 0..1.
fn bend(inside: f32) -> f32 {
    let x = 2.0 * inside - 1.0;
    switch (p.shape) {
        case SHAPE_EXPONENTIAL: {
            let low = e_to(-1.0);
            return (e_to(x) - low) / (e_to(1.0) - low);
        }
        case SHAPE_QUINTIC: {
            let t = abs(x);
            return 0.5 + 0.5 * copy_sign(t * t * t * (t * (6.0 * t - 15.0) + 10.0), x);
        }
        case SHAPE_ARCTANGENT: { return 0.5 + 0.5 * (arc_tangent(2.0 * x) / arc_tangent(2.0)); }
        case SHAPE_TANGENT: { return 0.5 + 0.5 * (tangent(x) / tangent(1.0)); }
        default: {
            if (p.bent == 1.0) {
                return inside;
            }
            return power(inside, p.bent);
        }
    }
}

fn mapped(value: f32) -> f32 {
    if (p.shape == SHAPE_POINTS) {
        var piece = pieces[0];
        for (var k = 1u; k < p.count; k++) {
            if (value >= pieces[k].x) {
                piece = pieces[k];
            }
        }
        let t = value - piece.x;
        return piece.y + t * (piece.a + t * (piece.b + t * piece.c));
    }
    let place = (value - p.in_low) * p.per_range;
    let inside = clamp(place, 0.0, 1.0);
    var u = bend(inside);
    if (p.beyond != BEYOND_CLAMP) {
        u += place - inside;
    }
    return p.out_low * (1.0 - u) + p.out_high * u;
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let value = read_value(i);
    out_value[i] = checked(masked(value, mapped(value), read_mask(i)));
}
