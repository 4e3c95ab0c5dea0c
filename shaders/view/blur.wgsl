// Blurs the haze along one axis, across pixels at similar distances.

@group(1) @binding(0) var haze: texture_2d<f32>;

@vertex
fn blur_vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return whole_picture(index);
}

fn blurred(at: vec2i, axis: vec2i) -> vec4f {
    const RADIUS = 5;
    let last = vec2i(textureDimensions(haze)) - 1;
    let middle = textureLoad(haze, at, 0);
    var sum = vec4f(0.0);
    for (var k = -RADIUS; k <= RADIUS; k++) {
        let one = textureLoad(haze, clamp(at + axis * k, vec2i(0), last), 0);
        let apart = (one.a - middle.a) / max(middle.a, 1e-6) * 30.0;
        let near = f32(k) / 2.5;
        sum += vec4f(one.rgb, 1.0) * exp(-0.5 * near * near - apart * apart);
    }
    return vec4f(sum.rgb / sum.a, middle.a);
}

@fragment
fn across_fragment(@builtin(position) at: vec4f) -> @location(0) vec4f {
    return blurred(vec2i(at.xy), vec2i(1, 0));
}

@fragment
fn down_fragment(@builtin(position) at: vec4f) -> @location(0) vec4f {
    return blurred(vec2i(at.xy), vec2i(0, 1));
}
