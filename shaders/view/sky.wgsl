// What is seen where there is no land.

@vertex
fn sky_vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return whole_picture(index);
}

@fragment
fn sky_fragment(@builtin(position) at: vec4f) -> @location(0) vec4f {
    if frame.background.w == 0.0 {
        return frame.background;
    }
    let way = normalize(way_through(at.xy));
    let up = clamp(way.y, -1.0, 1.0);
    let above = mix(vec3f(0.62, 0.74, 0.88), vec3f(0.16, 0.32, 0.62), pow(max(up, 0.0), 0.5));
    let below = mix(vec3f(0.62, 0.68, 0.74), vec3f(0.32, 0.33, 0.34), smoothstep(0.0, 0.5, -up));
    return vec4f(select(below, above, up > 0.0), 1.0);
}
