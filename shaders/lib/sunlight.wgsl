// Sunlight on cells between moments; see crates/nodes/src/numerics/sunlight.

/// The position of the sun at one moment: the bound tangents of two azimuths, the position between them, the tangent of
/// the sun, and the unit vector towards it times the flux.
struct Moment {
    first: u32,
    second: u32,
    share: f32,
    tangent: f32,
    east: f32,
    south: f32,
    up: f32,
}

/// The time between two moments.
struct Interval {
    before: Moment,
    now: Moment,
    step_s: f32,
}

/// The height of the sun above the horizon, as a difference of tangents, and the flux without shadows.
fn sight(moment: Moment, tangents: vec4<f32>, slope: vec2<f32>, upright: f32) -> vec2<f32> {
    var of_ray = tangents;
    let first = of_ray[moment.first];
    let second = of_ray[moment.second];
    let above = moment.tangent - (first + (second - first) * moment.share);
    let facing = (moment.up - (slope.x * moment.east + slope.y * moment.south)) * upright;
    return vec2<f32>(above, max(facing, 0.0));
}

@compute @workgroup_size(64)
fn shine(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let slope = horn(cell);
    let upright = 1.0 / sqrt(1.0 + (slope.x * slope.x + slope.y * slope.y));
    let tangents = vec4<f32>(tangents_0[i], tangents_1[i], tangents_2[i], tangents_3[i]);
    var time = lit[i];
    var joules = energy[i];
    for (var k = p.k_first; k < p.k_end; k++) {
        let interval = intervals[k];
        let before = sight(interval.before, tangents, slope, upright);
        let now = sight(interval.now, tangents, slope, upright);
        let high = max(before.x, now.x);
        let low = min(before.x, now.x);
        if (high > 0.0) {
            var part = 1.0;
            if (low < 0.0) {
                part = high / (high - low);
            }
            time += part * interval.step_s;
            joules += part * interval.step_s * 0.5 * (before.y + now.y);
        }
    }
    lit[i] = time;
    energy[i] = joules;
}
