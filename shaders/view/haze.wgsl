// Light scattered towards the camera by the haze over the terrain, including the terrain's shadows in it: ray-marched
// at half resolution, with a different start in each pixel, and then blurred across pixels at similar distances.

@group(3) @binding(0) var depth_map: texture_depth_multisampled_2d;

const STEPS = 12;

@vertex
fn haze_vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return whole_picture(index);
}

// J. Jimenez, 2014, Next generation post processing in Call of Duty: Advanced Warfare: interleaved gradient noise.
fn grain(pixel: vec2f) -> f32 {
    return fract(52.9829189 * fract(dot(pixel, vec2f(0.06711056, 0.00583715))));
}

// Light, and the distance of the terrain in units of its extent; 0 for pixels without terrain.
@fragment
fn haze_fragment(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let last = vec2i(textureDimensions(depth_map)) - 1;
    let pixel = min(vec2i(at.xy) * 2, last);
    let depth = textureLoad(depth_map, pixel, 0);
    if depth <= 0.0 || frame.air.y <= 0.0 {
        return vec4f(0.0);
    }
    let ahead = way_through(vec2f(pixel) + 0.5);
    let far = length(ahead) * frame.forward.w / depth;
    let way = normalize(ahead);
    let near = min(frame.air.x, far);
    let step = (far - near) / f32(STEPS);
    let sun = sun_light();
    let toward_sun = dot(way, frame.sun.xyz);
    var light = vec3f(0.0);
    for (var k = 0; k < STEPS; k++) {
        let t = near + (f32(k) + grain(floor(at.xy))) * step;
        let place = frame.eye.xyz + way * t;
        let height = max(place.y - frame.heights.w, 0.0) / frame.air.z;
        let cell = place.xz / frame.cell_m - 0.5;
        var seen = 1.0;
        if all(cell > vec2f(-0.5)) && all(cell < vec2f(frame.cells) - 0.5) {
            seen = sun_seen(cell, place.y);
        }
        light += exp(-haze_depth(way, t)) * haze_source(toward_sun, sun * seen, exp(-height / 3.0), exp(-height));
    }
    return vec4f(light * step, far * frame.air.w);
}
