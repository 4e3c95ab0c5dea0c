// From light to the screen: exposure, tone curve, the screen's codes, a grain below one code against bands.

@group(1) @binding(0) var light: texture_multisampled_2d<f32>;

@vertex
fn finish_vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return whole_picture(index);
}

fn tone(light: vec3f) -> vec3f {
    let x = light * exp2(frame.exposure);
    return x / (1.0 + x);
}

@fragment
fn finish_fragment(@builtin(position) at: vec4f) -> @location(0) vec4f {
    var sum = vec3f(0.0);
    for (var k = 0; k < 4; k++) {
        sum += tone(textureLoad(light, vec2i(at.xy), k).rgb);
    }
    var colour = pow(sum * 0.25, vec3f(1.0 / 2.2));
    if frame.flags.w == 0u {
        colour = pow(colour, vec3f(2.2));
    }
    return vec4f(colour, 1.0);
}
