// A ridged multifractal; see crates/nodes/src/generate/ridged.rs.

/// Constants of an octave.
struct Layer {
    round: f32,
    half_per_round: f32,
    top: f32,
    height_m: f32,
    fade: f32,
    rest: f32,
    exponent: f32,
    weight_gain: f32,
}

/// 1 − |n|, rounded.
fn crest(layer: Layer, noise: f32) -> f32 {
    let distance = abs(noise);
    let near = min(distance, layer.round);
    return (layer.top - (distance - near)) - near * near * layer.half_per_round;
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let place = vec2<u32>(p.left, p.top) + cell;
    var height = 0.0;
    var weight = 1.0;
    for (var k = 0u; k < p.count; k++) {
        let layer = layers[k];
        let noise = lattice_noise(octaves_of[k], p.basis, place);
        var ridge = max(crest(layer, noise), 0.0);
        if (p.squared != 0u) {
            ridge *= ridge;
        } else {
            ridge = power(ridge, layer.exponent);
        }
        if (layer.fade != 1.0) {
            ridge = layer.rest + layer.fade * ridge;
        }
        ridge *= weight;
        height += layer.height_m * ridge;
        weight = min(layer.weight_gain * ridge, 1.0);
    }
    height += weight * (p.linear + p.square * weight);
    out_height[at(cell.x, cell.y)] = checked(height);
}
