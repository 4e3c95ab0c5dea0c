// The fractions of the sun and of the sky that each cell sees.

@vertex
fn seen_vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return whole_picture(index);
}

@fragment
fn sun_fragment(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let cell = vec2i(at.xy);
    let top = max(ground_at(cell) + water_at(cell), frame.heights.z) * frame.exaggeration;
    return vec4f(sun_seen(vec2f(cell), top), 0.0, 0.0, 1.0);
}

fn mean_height(cell: vec2f, mip: i32) -> f32 {
    let size = vec2i(textureDimensions(height_map, mip));
    let at = cell / f32(1u << u32(mip)) - 0.5;
    let c = vec2i(floor(at));
    let part = at - floor(at);
    let a = textureLoad(height_map, clamp(c, vec2i(0), size - 1), mip).x;
    let b = textureLoad(height_map, clamp(c + vec2i(1, 0), vec2i(0), size - 1), mip).x;
    let d = textureLoad(height_map, clamp(c + vec2i(0, 1), vec2i(0), size - 1), mip).x;
    let e = textureLoad(height_map, clamp(c + 1, vec2i(0), size - 1), mip).x;
    return mix(mix(a, b, part.x), mix(d, e, part.x), part.y);
}

// The visible fraction of the sky: 1 minus the mean over azimuths of the squared sine of the horizon's elevation. More
// distant terrain is read from coarser mip-maps.
@fragment
fn open_fragment(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let cell = at.xy * frame.open.xy; // in cells from the corner
    let last_mip = i32(textureNumLevels(height_map)) - 1;
    let h = mean_height(cell, clamp(i32(log2(frame.open.x)), 0, last_mip));
    var closed = 0.0;
    for (var k = 0; k < 12; k++) {
        let turn = 2.0 * PI * (f32(k) + 0.5) / 12.0;
        let way = vec2f(cos(turn), sin(turn));
        var steepest = 0.0;
        var reach = 1.0 * frame.open.x;
        while reach < frame.open.z {
            let to = cell + way * reach;
            if any(to < vec2f(0.0)) || any(to > vec2f(frame.cells)) {
                break;
            }
            let mip = clamp(i32(log2(reach)) - 1, 0, last_mip);
            steepest = max(steepest, (mean_height(to, mip) - h) / reach);
            reach *= 1.6;
        }
        let slope = steepest * frame.exaggeration / frame.cell_m;
        closed += slope * slope / (1.0 + slope * slope);
    }
    return vec4f(1.0 - closed / 12.0, 0.0, 0.0, 1.0);
}
