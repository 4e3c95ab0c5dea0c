// Lattice noise of crates/nodes/src/numerics/noise (`lattice`, `basis`): positions equal those of the CPU bit for bit, as
// they are integers. It needs shaders/lib/hash.

/// An axis of the lattice of an octave: 32.32 fixed-point numbers in wavelengths, and a period in lattice cells.
struct Axis {
    base_low: u32,
    base_high: u32,
    step: u32,
    period: i32,
}

/// An octave. `value_step` and `value_least` scale the value at a lattice point, `scale` its gradient and twist.
struct Octave {
    x: Axis,
    y: Axis,
    seed: u32,
    scale: f32,
    value_step: f32,
    value_least: f32,
}

/// A position on an axis: the lattice cell, and the fraction in it to 24 bits, exactly.
struct Spot {
    cell: i32,
    fraction: f32,
}

/// The product of two numbers in two words, the low one first.
fn wide_product(a: u32, b: u32) -> vec2<u32> {
    let low = (a & 0xffffu) * (b & 0xffffu);
    let mid_a = (a >> 16u) * (b & 0xffffu);
    let mid_b = (a & 0xffffu) * (b >> 16u);
    let middle = (low >> 16u) + (mid_a & 0xffffu) + (mid_b & 0xffffu);
    let high = (a >> 16u) * (b >> 16u) + (mid_a >> 16u) + (mid_b >> 16u) + (middle >> 16u);
    return vec2<u32>((low & 0xffffu) | (middle << 16u), high);
}

/// The position of the centre of a cell of the world.
fn spot(axis: Axis, cell: u32) -> Spot {
    let way = wide_product(cell, axis.step);
    let low = axis.base_low + way.x;
    let carry = select(0u, 1u, low < axis.base_low);
    let high = axis.base_high + way.y + carry;
    return Spot(i32(high), f32(low >> 8u) * (1.0 / 16777216.0));
}

/// The index of a lattice line modulo the period.
fn wrap_line(axis: Axis, line: i32) -> i32 {
    if (axis.period == 0) {
        return line;
    }
    let rest = line % axis.period;
    return select(rest, rest + axis.period, rest < 0);
}

const BELL: u32 = 0u;
const CLASSIC: u32 = 1u;
const PLAIN: u32 = 2u;

/// The unit vectors at (k + ½) · 11.25° in the first quadrant.
const QUADRANT = array<vec2<f32>, 8>(
    vec2<f32>(0.9951847, 0.09801714), vec2<f32>(0.95694035, 0.29028466), vec2<f32>(0.8819213, 0.47139674),
    vec2<f32>(0.77301043, 0.6343933), vec2<f32>(0.6343933, 0.77301043), vec2<f32>(0.47139674, 0.8819213),
    vec2<f32>(0.29028466, 0.95694035), vec2<f32>(0.09801714, 0.9951847),
);

fn turned(v: vec2<f32>, quarters: u32) -> vec2<f32> {
    switch (quarters) {
        case 0u: { return v; }
        case 1u: { return vec2<f32>(-v.y, v.x); }
        case 2u: { return -v; }
        default: { return vec2<f32>(v.y, -v.x); }
    }
}

/// The draw at a lattice point: value, gradient, twist.
fn draw(octave: Octave, basis: u32, hash: u32) -> vec4<f32> {
    let value = f32(hash & 0xffffffu) * octave.value_step + octave.value_least;
    let class_of = hash >> 26u;
    if (basis == BELL) {
        var quadrant = QUADRANT;
        let gradient = turned(quadrant[(class_of / 2u) % 8u], class_of / 16u);
        let twist = select(-1.4142135, 1.4142135, (class_of & 1u) == 0u);
        return vec4<f32>(value, vec3<f32>(gradient, twist) * octave.scale);
    }
    if (basis == CLASSIC) {
        let straight = (class_of / 8u) % 2u == 0u;
        let gradient = turned(select(vec2<f32>(0.70710677), vec2<f32>(1.0, 0.0), straight), class_of / 16u);
        return vec4<f32>(value, vec3<f32>(gradient, 0.0) * octave.scale);
    }
    return vec4<f32>(value, 0.0, 0.0, 0.0);
}

/// φ(s), ψ(s), φ(s − 1) and ψ(s − 1).
fn weights(basis: u32, s: f32) -> vec4<f32> {
    let r = s - 1.0;
    if (basis == BELL) {
        let ss = s * s;
        let rs = 1.0 - ss;
        let cs = rs * rs * rs;
        let rr = r * r;
        let tr = 1.0 - rr;
        let cr = tr * tr * tr;
        return vec4<f32>(cs * (1.0 + 1.25 * ss), s * cs, cr * (1.0 + 1.25 * rr), r * cr);
    }
    let fade = s * s * s * (s * (s * 6.0 - 15.0) + 10.0);
    return vec4<f32>(1.0 - fade, s * (1.0 - fade), fade, r * fade);
}

/// The derivatives of the weights with respect to s.
fn rates(basis: u32, s: f32) -> vec4<f32> {
    let r = s - 1.0;
    if (basis == BELL) {
        let ss = s * s;
        let ts = 1.0 - ss;
        let qs = ts * ts;
        let rr = r * r;
        let tr = 1.0 - rr;
        let qr = tr * tr;
        return vec4<f32>(
            -s * qs * (3.5 + 10.0 * ss), qs * (1.0 - 7.0 * ss), -r * qr * (3.5 + 10.0 * rr), qr * (1.0 - 7.0 * rr),
        );
    }
    let fade = s * s * s * (s * (s * 6.0 - 15.0) + 10.0);
    let rate = 30.0 * (s * r) * (s * r);
    return vec4<f32>(-rate, (1.0 - fade) - s * rate, rate, fade + r * rate);
}

/// The draws at the corners (0, 0), (1, 0), (0, 1) and (1, 1) of a lattice cell.
struct Corners {
    a: vec4<f32>,
    b: vec4<f32>,
    c: vec4<f32>,
    d: vec4<f32>,
}

fn corners(octave: Octave, basis: u32, column: i32, row: i32) -> Corners {
    let above = hash_row(wrap_line(octave.y, row), octave.seed);
    let below = hash_row(wrap_line(octave.y, row + 1), octave.seed);
    let near = wrap_line(octave.x, column);
    let far = wrap_line(octave.x, column + 1);
    return Corners(
        draw(octave, basis, hash_point(near, above)),
        draw(octave, basis, hash_point(far, above)),
        draw(octave, basis, hash_point(near, below)),
        draw(octave, basis, hash_point(far, below)),
    );
}

/// The factors of φ and of ψ of the row, from two draws and the weights of the column.
fn along(near: vec4<f32>, far: vec4<f32>, s: vec4<f32>) -> vec2<f32> {
    return vec2<f32>(
        (near.x * s.x + near.y * s.y) + (far.x * s.z + far.y * s.w),
        (near.z * s.x + near.w * s.y) + (far.z * s.z + far.w * s.w),
    );
}

fn down(above: vec2<f32>, below: vec2<f32>, t: vec4<f32>) -> f32 {
    return (above.x * t.x + above.y * t.y) + (below.x * t.z + below.y * t.w);
}

/// The noise of an octave at a cell of the world.
fn lattice_noise(octave: Octave, basis: u32, cell: vec2<u32>) -> f32 {
    let x = spot(octave.x, cell.x);
    let y = spot(octave.y, cell.y);
    let k = corners(octave, basis, x.cell, y.cell);
    let s = weights(basis, x.fraction);
    return down(along(k.a, k.b, s), along(k.c, k.d, s), weights(basis, y.fraction));
}

/// The noise of an octave at a cell of the world, and its slopes along x and y per wavelength.
fn sloped_noise(octave: Octave, basis: u32, cell: vec2<u32>) -> vec3<f32> {
    let x = spot(octave.x, cell.x);
    let y = spot(octave.y, cell.y);
    let k = corners(octave, basis, x.cell, y.cell);
    let s = weights(basis, x.fraction);
    let t = weights(basis, y.fraction);
    let above = along(k.a, k.b, s);
    let below = along(k.c, k.d, s);
    let ds = rates(basis, x.fraction);
    let dt = rates(basis, y.fraction);
    return vec3<f32>(down(above, below, t), down(along(k.a, k.b, ds), along(k.c, k.d, ds), t), down(above, below, dt));
}
