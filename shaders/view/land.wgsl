// The textures of the terrain, and their values at a position.

@group(1) @binding(0) var height_map: texture_2d<f32>;
@group(1) @binding(1) var water_map: texture_2d<f32>;
@group(1) @binding(2) var gradient_map: texture_2d<f32>; // of the ground, rise per metre to the east and to the south
@group(1) @binding(3) var colour_map: texture_2d<f32>;
@group(1) @binding(4) var overlay_map: texture_2d<f32>;  // a mask, coverage by lines
@group(1) @binding(5) var tint_map: texture_2d<f32>;     // rows: alpine, rock, map
@group(1) @binding(6) var seen_map: texture_2d<f32>;     // visible fraction of the sun
@group(1) @binding(7) var open_map: texture_2d<f32>;     // visible fraction of the sky
@group(1) @binding(8) var shade_map: texture_2d<f32>;    // see shade.wgsl

fn ground_at(cell: vec2i) -> f32 {
    return textureLoad(height_map, clamp(cell, vec2i(0), vec2i(frame.cells) - 1), 0).x;
}

// Depth of the water fields of the terrain; the map has a single cell if there is none.
fn water_at(cell: vec2i) -> f32 {
    return max(textureLoad(water_map, clamp(cell, vec2i(0), vec2i(textureDimensions(water_map)) - 1), 0).x, 0.0);
}

// Height of the ground and depth of the water on it at a position of the map (0 to 1), bilinear between cell centres.
fn ground_and_water(uv: vec2f) -> vec2f {
    let at = uv * vec2f(frame.cells) - 0.5;
    let cell = vec2i(floor(at));
    let part = at - floor(at);
    let h = vec4f(ground_at(cell), ground_at(cell + vec2i(1, 0)), ground_at(cell + vec2i(0, 1)), ground_at(cell + 1));
    var w = vec4f(0.0);
    if textureDimensions(water_map).x > 1u {
        w = vec4f(water_at(cell), water_at(cell + vec2i(1, 0)), water_at(cell + vec2i(0, 1)), water_at(cell + 1));
    }
    let weight = vec4f((1.0 - part.x) * (1.0 - part.y), part.x * (1.0 - part.y), (1.0 - part.x) * part.y, part.x * part.y);
    let ground = dot(h, weight);
    return vec2f(ground, max(dot(w, weight), frame.heights.z - ground));
}
