// The surface that the mesh follows: that of the inset within its rectangle, that of the whole terrain elsewhere.

@group(3) @binding(0) var whole_height: texture_2d<f32>;
@group(3) @binding(1) var whole_water: texture_2d<f32>;
@group(3) @binding(2) var inset_height: texture_2d<f32>;
@group(3) @binding(3) var inset_water: texture_2d<f32>;

// The bilinear value at a position in cells; the centre of the first cell is at 0.
fn between(map: texture_2d<f32>, at: vec2f) -> f32 {
    let last = vec2i(textureDimensions(map)) - 1;
    let cell = vec2i(floor(at));
    let part = at - floor(at);
    let a = textureLoad(map, clamp(cell, vec2i(0), last), 0).x;
    if all(part == vec2f(0.0)) || all(last == vec2i(0)) {
        return a;
    }
    let b = textureLoad(map, clamp(cell + vec2i(1, 0), vec2i(0), last), 0).x;
    let c = textureLoad(map, clamp(cell + vec2i(0, 1), vec2i(0), last), 0).x;
    let d = textureLoad(map, clamp(cell + 1, vec2i(0), last), 0).x;
    return mix(mix(a, b, part.x), mix(c, d, part.x), part.y);
}

fn is_in_inset(at: vec2f) -> bool {
    return all(at >= frame.inset.xy) && all(at < frame.inset.zw);
}

// The height of the surface, not exaggerated, at a position in cells of the whole terrain and in metres relative to the
// camera.
fn relief(cell: vec2f, at: vec2f) -> f32 {
    var ground = 0.0;
    var water = 0.0;
    if is_in_inset(at) {
        let own = (at - frame.inset_cells.xy) * frame.inset_cells.z - 0.5;
        ground = between(inset_height, own);
        water = between(inset_water, own);
    } else {
        ground = between(whole_height, cell);
        water = between(whole_water, cell);
    }
    return max(ground + max(water, 0.0), frame.heights.z);
}
