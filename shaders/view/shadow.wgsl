// Shadows: heights below which the sun is hidden in part and in whole, along lines away from the sun (shade.wgsl).

fn swept_load(map: texture_2d<f32>, line: i32, step: i32) -> vec2f {
    let last = vec2i(textureDimensions(map)) - 1;
    return textureLoad(map, clamp(vec2i(line, step), vec2i(0), last), 0).xy;
}

// The shadow heights at a position in cells, from a map of this sweep.
fn swept(map: texture_2d<f32>, sweep: vec4f, lines: vec4i, cell: vec2f) -> vec2f {
    let at = cell / sweep.w;
    let x_first = lines.x == 0;
    let major = select(at.y, at.x, x_first);
    let minor = select(at.x, at.y, x_first);
    let last = f32(lines.z - 1);
    let step = clamp(select(last - major, major, lines.y == 1), 0.0, last);
    let line = minor - sweep.x * step + sweep.z;
    let l = i32(floor(line));
    let s = i32(floor(step));
    let part = vec2f(line, step) - floor(vec2f(line, step));
    let near = mix(swept_load(map, l, s), swept_load(map, l + 1, s), part.x);
    let far = mix(swept_load(map, l, s + 1), swept_load(map, l + 1, s + 1), part.x);
    return mix(near, far, part.y);
}
