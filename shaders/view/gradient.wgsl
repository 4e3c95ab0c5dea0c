// Slopes of the ground, by central differences (the terrain is level beyond its edge), and mip-maps of any map by
// averaging four texels. The mean of slopes is the slope of the mean, so distant terrain keeps its mean slope and does
// not shimmer.

@group(1) @binding(0) var source: texture_2d<f32>;
@group(2) @binding(0) var around: texture_2d<f32>; // slopes of the terrain around an inset

@vertex
fn map_vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return whole_picture(index);
}

fn source_at(cell: vec2i) -> vec4f {
    return textureLoad(source, clamp(cell, vec2i(0), vec2i(textureDimensions(source)) - 1), 0);
}

fn gradient_at(cell: vec2i) -> vec2f {
    let x = vec2i(1, 0);
    let y = vec2i(0, 1);
    // Horn's weights, which are less noisy than two cells alone
    let east = source_at(cell + x - y).x + 2.0 * source_at(cell + x).x + source_at(cell + x + y).x;
    let west = source_at(cell - x - y).x + 2.0 * source_at(cell - x).x + source_at(cell - x + y).x;
    let south = source_at(cell + y - x).x + 2.0 * source_at(cell + y).x + source_at(cell + y + x).x;
    let north = source_at(cell - y - x).x + 2.0 * source_at(cell - y).x + source_at(cell - y + x).x;
    return vec2f(east - west, south - north) / (8.0 * frame.cell_m);
}

@fragment
fn gradient_fragment(@builtin(position) at: vec4f) -> @location(0) vec4f {
    return vec4f(gradient_at(vec2i(at.xy)), 0.0, 0.0);
}

// Slopes of an inset, blended on its edge with those of the terrain around it.
@fragment
fn inset_gradient_fragment(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let cell = vec2i(at.xy);
    let last = vec2i(textureDimensions(around)) - 1;
    let there = in_cells_around(vec2f(cell), vec2f(textureDimensions(around)));
    let corner = vec2i(floor(there));
    let part = there - floor(there);
    let a = textureLoad(around, clamp(corner, vec2i(0), last), 0).xy;
    let b = textureLoad(around, clamp(corner + vec2i(1, 0), vec2i(0), last), 0).xy;
    let c = textureLoad(around, clamp(corner + vec2i(0, 1), vec2i(0), last), 0).xy;
    let d = textureLoad(around, clamp(corner + 1, vec2i(0), last), 0).xy;
    let outer = mix(mix(a, b, part.x), mix(c, d, part.x), part.y);
    return vec4f(mix(outer, gradient_at(cell), inset_share(vec2f(cell) + 0.5)), 0.0, 0.0);
}

@fragment
fn halved_fragment(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let cell = vec2i(at.xy) * 2;
    return 0.25 * (source_at(cell) + source_at(cell + vec2i(1, 0)) + source_at(cell + vec2i(0, 1)) + source_at(cell + 1));
}
