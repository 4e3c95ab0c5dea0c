// Fractals whose octaves depend on each other; see crates/nodes/src/generate/fractal/rules.rs.

/// Constants of an octave.
struct Layer {
    gain: f32,
    fade: f32,
    round: f32,
    half_per_round: f32,
    top: f32,
    mean: f32,
    mean_square_crest: f32,
    steepness: f32,
    lift: f32,
    first: f32,
    offset: f32,
    damping: f32,
}

fn folded(layer: Layer, noise: f32) -> f32 {
    let distance = abs(noise);
    let near = min(distance, layer.round);
    return (layer.top - (distance - near)) - near * near * layer.half_per_round;
}

/// The smaller of a weight and 1, with a parabolic transition.
fn held(weight: f32) -> f32 {
    let limited = min(weight, 1.15);
    let over = max(limited - 0.85, 0.0);
    return limited - over * over * (0.25 / 0.15);
}

/// Adds an octave to the state of a sample.
fn step_of(layer: Layer, noise: vec3<f32>, state: vec4<f32>) -> vec4<f32> {
    switch (p.kind) {
        case KIND_BILLOW: {
            let crest = layer.fade * (folded(layer, noise.x) - 1.0) + (1.0 - layer.mean);
            return vec4<f32>(state.x + layer.gain * (1.0 - 2.0 * crest), state.yzw);
        }
        case KIND_HYBRID: {
            let signal = state.y * (layer.gain * (layer.fade * noise.x + layer.offset));
            return vec4<f32>(state.x + signal, held(signal * layer.lift), state.zw);
        }
        case KIND_HETEROGENEOUS: {
            let signal = layer.gain * (layer.fade * noise.x + layer.offset);
            return vec4<f32>(state.x + signal * (layer.first + state.x), state.yzw);
        }
        case KIND_ERODED: {
            let slope = state.yz + layer.fade * layer.steepness * noise.yz;
            let square = min(slope.x * slope.x + slope.y * slope.y, 1e30);
            let height = state.x + layer.gain * layer.fade * noise.x / (1.0 + layer.damping * square);
            return vec4<f32>(height, slope, state.w);
        }
        default: {
            let octave = layer.gain * layer.fade * noise.x;
            let fine = 1.0 - layer.first;
            let crest = max(folded(layer, noise.x), 0.0);
            let ridge = state.w * (layer.fade * crest * crest + layer.mean_square_crest);
            return vec4<f32>(
                state.x + layer.first * octave,
                state.y + fine * octave,
                state.z + fine * layer.gain * ridge,
                max(layer.first, min(2.0 * ridge, 1.0)),
            );
        }
    }
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let place = vec2<u32>(p.left, p.top) + cell;
    var state = vec4<f32>(0.0);
    if (p.kind == KIND_HYBRID) {
        state.y = 1.0;
    } else if (p.kind == KIND_BLEND) {
        state.w = 1.0;
    }
    for (var k = 0u; k < p.count; k++) {
        var noise = vec3<f32>(0.0);
        if (p.kind == KIND_ERODED) {
            noise = sloped_noise(octaves_of[k], p.basis, place);
        } else {
            noise.x = lattice_noise(octaves_of[k], p.basis, place);
        }
        state = step_of(layers[k], noise, state);
    }
    for (var k = p.count; k < p.count_all; k++) {
        state = step_of(layers[k], vec3<f32>(0.0), state);
    }
    var height = state.x;
    if (p.kind == KIND_BLEND) {
        let high_part = smooth_step((p.unit_m * state.x - p.low) * p.per_metre);
        height = state.x + state.y + (state.z - state.y) * high_part;
    }
    out_height[at(cell.x, cell.y)] = checked(p.factor * height + p.lift_m);
}
