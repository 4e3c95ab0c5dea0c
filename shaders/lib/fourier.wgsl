// Fourier transforms of lines of complex numbers in single precision, for crates/nodes/src/numerics/fourier/device.rs: the
// algorithm of T. G. Stockham (1966), which leaves the result in natural order. A pass of `by_2` to `by_8` combines that many
// transforms of `k_part` places to one. Adjacent invocations have adjacent numbers, whether lines are rows or columns.

/// A line, and one of the numbers that count along it.
struct Spot {
    line: u32,
    along: u32,
}

/// What an invocation of `along` numbers for each line does.
fn spot_of(id: vec3<u32>) -> Spot {
    let place = cell_of(id);
    if (p.k_down != 0u) {
        return Spot(place.x, place.y);
    }
    return Spot(place.y, place.x);
}

fn is_beyond(spot: Spot, along: u32) -> bool { return spot.line >= p.k_lines || spot.along >= along; }

/// Index of a place of a line.
fn place_of(line: u32, place: u32) -> u32 {
    if (p.k_down != 0u) {
        return place * p.k_pitch + line;
    }
    return line * p.k_pitch + place;
}

fn times(a: vec2<f32>, b: vec2<f32>) -> vec2<f32> {
    return vec2<f32>(a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x);
}

/// A quarter turn backwards.
fn quarter(v: vec2<f32>) -> vec2<f32> { return vec2<f32>(v.y, -v.x); }

/// The values that an invocation combines: the line, the place of the first, the step to the next, the twiddle of the
/// second, and where the results go.
struct Join {
    line: u32,
    first: u32,
    step: u32,
    turn: u32,
    goal: u32,
}

fn join_of(spot: Spot, radix: u32) -> Join {
    let step = p.k_length / radix;
    let k = spot.along % p.k_part;
    return Join(spot.line, spot.along, step, k * (step / p.k_part), (spot.along - k) * radix + k);
}

/// Value `m` of those that are combined, with its twiddle.
fn value(join: Join, m: u32) -> vec2<f32> {
    return times(source[place_of(join.line, join.first + m * join.step)], factors[m * join.turn]);
}

fn keep(join: Join, m: u32, v: vec2<f32>) {
    result[place_of(join.line, join.goal + m * p.k_part)] = v;
}

@compute @workgroup_size(64)
fn by_2(@builtin(global_invocation_id) id: vec3<u32>) {
    let spot = spot_of(id);
    if (is_beyond(spot, p.k_length / 2u)) {
        return;
    }
    let join = join_of(spot, 2u);
    let a = source[place_of(join.line, join.first)];
    let b = value(join, 1u);
    keep(join, 0u, a + b);
    keep(join, 1u, a - b);
}

@compute @workgroup_size(64)
fn by_3(@builtin(global_invocation_id) id: vec3<u32>) {
    let spot = spot_of(id);
    if (is_beyond(spot, p.k_length / 3u)) {
        return;
    }
    let join = join_of(spot, 3u);
    let a = source[place_of(join.line, join.first)];
    let b = value(join, 1u);
    let c = value(join, 2u);
    let sum = b + c;
    let even = a - 0.5 * sum;
    let odd = quarter(b - c) * 0.8660254;
    keep(join, 0u, a + sum);
    keep(join, 1u, even + odd);
    keep(join, 2u, even - odd);
}

/// The transform of four values.
struct Four {
    a: vec2<f32>,
    b: vec2<f32>,
    c: vec2<f32>,
    d: vec2<f32>,
}

fn four(a: vec2<f32>, b: vec2<f32>, c: vec2<f32>, d: vec2<f32>) -> Four {
    let ac = a + c;
    let bd = b + d;
    let even = a - c;
    let odd = quarter(b - d);
    return Four(ac + bd, even + odd, ac - bd, even - odd);
}

@compute @workgroup_size(64)
fn by_4(@builtin(global_invocation_id) id: vec3<u32>) {
    let spot = spot_of(id);
    if (is_beyond(spot, p.k_length / 4u)) {
        return;
    }
    let join = join_of(spot, 4u);
    let sums = four(
        source[place_of(join.line, join.first)], value(join, 1u), value(join, 2u), value(join, 3u),
    );
    keep(join, 0u, sums.a);
    keep(join, 1u, sums.b);
    keep(join, 2u, sums.c);
    keep(join, 3u, sums.d);
}

@compute @workgroup_size(64)
fn by_5(@builtin(global_invocation_id) id: vec3<u32>) {
    let spot = spot_of(id);
    if (is_beyond(spot, p.k_length / 5u)) {
        return;
    }
    let join = join_of(spot, 5u);
    let a = source[place_of(join.line, join.first)];
    let b = value(join, 1u);
    let c = value(join, 2u);
    let d = value(join, 3u);
    let e = value(join, 4u);
    let outer = b + e;
    let inner = c + d;
    let outer_odd = quarter(b - e);
    let inner_odd = quarter(c - d);
    // cosines and sines of a fifth of a turn and of two
    let even_once = a + outer * 0.309017 - inner * 0.809017;
    let even_twice = a - outer * 0.809017 + inner * 0.309017;
    let odd_once = outer_odd * 0.95105654 + inner_odd * 0.58778524;
    let odd_twice = outer_odd * 0.58778524 - inner_odd * 0.95105654;
    keep(join, 0u, a + outer + inner);
    keep(join, 1u, even_once + odd_once);
    keep(join, 2u, even_twice + odd_twice);
    keep(join, 3u, even_twice - odd_twice);
    keep(join, 4u, even_once - odd_once);
}

@compute @workgroup_size(64)
fn by_8(@builtin(global_invocation_id) id: vec3<u32>) {
    let spot = spot_of(id);
    if (is_beyond(spot, p.k_length / 8u)) {
        return;
    }
    let join = join_of(spot, 8u);
    let even = four(
        source[place_of(join.line, join.first)], value(join, 2u), value(join, 4u), value(join, 6u),
    );
    let odd = four(value(join, 1u), value(join, 3u), value(join, 5u), value(join, 7u));
    let b = times(odd.b, vec2<f32>(0.70710677, -0.70710677));
    let c = quarter(odd.c);
    let d = times(odd.d, vec2<f32>(-0.70710677, -0.70710677));
    keep(join, 0u, even.a + odd.a);
    keep(join, 1u, even.b + b);
    keep(join, 2u, even.c + c);
    keep(join, 3u, even.d + d);
    keep(join, 4u, even.a - odd.a);
    keep(join, 5u, even.b - b);
    keep(join, 6u, even.c - c);
    keep(join, 7u, even.d - d);
}

// Lengths with other factors: a convolution of `k_length` places, after L. I. Bluestein (1970). The real and the imaginary
// part are exchanged for the transform back.

@compute @workgroup_size(64)
fn chirp_begin(@builtin(global_invocation_id) id: vec3<u32>) {
    let spot = spot_of(id);
    if (is_beyond(spot, p.k_length)) {
        return;
    }
    let i = place_of(spot.line, spot.along);
    var v = vec2<f32>(0.0);
    if (spot.along < p.k_part) {
        v = times(source[i], factors[spot.along]);
    }
    result[i] = v;
}

@compute @workgroup_size(64)
fn chirp_turn(@builtin(global_invocation_id) id: vec3<u32>) {
    let spot = spot_of(id);
    if (is_beyond(spot, p.k_length)) {
        return;
    }
    let i = place_of(spot.line, spot.along);
    result[i] = times(source[i], factors[spot.along]).yx;
}

@compute @workgroup_size(64)
fn chirp_end(@builtin(global_invocation_id) id: vec3<u32>) {
    let spot = spot_of(id);
    if (is_beyond(spot, p.k_part)) {
        return;
    }
    let i = place_of(spot.line, spot.along);
    result[i] = times(source[i].yx, factors[spot.along]);
}
