// Value, simplex and cellular noise; see crates/nodes/src/generate/noise.rs.

fn rank(x: f32, y: f32) -> f32 {
    switch (p.metric) {
        case METRIC_MANHATTAN: { return abs(x) + abs(y); }
        case METRIC_CHEBYSHEV: { return max(abs(x), abs(y)); }
        default: { return x * x + y * y; }
    }
}

fn distance_of(rank: f32) -> f32 {
    if (p.metric == METRIC_EUCLIDEAN) {
        return min(sqrt(rank), 2.0);
    }
    return min(rank, 2.0);
}

/// Factors of the distances to the two nearest of one point in each lattice cell.
fn cellular(octave: Octave, place: vec2<u32>) -> f32 {
    let x = spot(octave.x, place.x);
    let y = spot(octave.y, place.y);
    let least = 0.5 - 0.5 * p.jitter;
    var nearest = 3.4e38;
    var second = 3.4e38;
    for (var row = -2; row <= 2; row++) {
        let row_hash = hash_row(wrap_line(octave.y, y.cell + row), octave.seed);
        for (var column = -2; column <= 2; column++) {
            let hash = hash_point(wrap_line(octave.x, x.cell + column), row_hash);
            let across = least + p.jitter * (f32((hash >> 16u) & 0xffffu) * (1.0 / 65536.0));
            let down_part = least + p.jitter * (f32(hash & 0xffffu) * (1.0 / 65536.0));
            let away = rank((across + f32(column)) - x.fraction, (down_part + f32(row)) - y.fraction);
            second = min(second, max(nearest, away));
            nearest = min(nearest, away);
        }
    }
    return (p.near_part * octave.scale) * distance_of(nearest) + (p.second_part * octave.scale) * distance_of(second);
}

/// Sum of two numbers of 64 bits, the low word first.
fn wide_sum(a: vec2<u32>, b: vec2<u32>) -> vec2<u32> {
    let low = a.x + b.x;
    return vec2<u32>(low, a.y + b.y + select(0u, 1u, low < a.x));
}

fn position(axis: Axis, cell: u32) -> vec2<u32> {
    return wide_sum(vec2<u32>(axis.base_low, axis.base_high), wide_product(cell, axis.step));
}

fn fraction_of(position: vec2<u32>) -> f32 {
    return f32(position.x >> 8u) * (1.0 / 16777216.0);
}

const SKEW: u32 = 1572067138u;
const UNSKEW: f32 = 0.21132487;

/// The contribution of a lattice point at an offset from it.
fn corner(hash: u32, x: f32, y: f32) -> f32 {
    let direction = ((hash >> 8u) * 24u) >> 24u;
    let rest = max(0.5 - x * x - y * y, 0.0);
    let square = rest * rest;
    return square * square * (directions[2u * direction] * x + directions[2u * direction + 1u] * y);
}

fn simplex(octave: Octave, place: vec2<u32>) -> f32 {
    let column = position(octave.x, place.x);
    let row = position(octave.y, place.y);
    let sum = wide_sum(column, row);
    // (sum >> 32) · SKEW, with a sign, and the high word of the rest
    var skew = wide_product(sum.y, SKEW);
    if ((sum.y & 0x80000000u) != 0u) {
        skew.y -= SKEW;
    }
    skew = wide_sum(skew, vec2<u32>(wide_product(sum.x, SKEW).y, 0u));
    let along_x = wide_sum(column, skew);
    let along_y = wide_sum(row, skew);
    let i = i32(along_x.y);
    let j = i32(along_y.y);
    let s = fraction_of(along_x);
    let t = fraction_of(along_y);
    let back = (s + t) * UNSKEW;
    let x = s - back;
    let y = t - back;
    let right = select(0, 1, s > t);
    let near = hash_row(j, octave.seed);
    let far = hash_row(j + 1, octave.seed);
    let across = f32(right);
    let below = 1.0 - across;
    return octave.scale
        * (corner(hash_point(i, near), x, y)
            + corner(hash_point(i + 1, far), (x - 1.0) + 2.0 * UNSKEW, (y - 1.0) + 2.0 * UNSKEW)
            + corner(hash_point(i + right, select(far, near, right == 1)), (x - across) + UNSKEW, (y - below) + UNSKEW));
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let place = vec2<u32>(p.left, p.top) + cell;
    var height = p.start;
    for (var k = 0u; k < p.count; k++) {
        switch (p.kind) {
            case KIND_VALUE: { height += lattice_noise(octaves_of[k], PLAIN, place); }
            case KIND_SIMPLEX: { height += simplex(octaves_of[k], place); }
            default: { height += cellular(octaves_of[k], place); }
        }
    }
    out_height[at(cell.x, cell.y)] = checked(height);
}
