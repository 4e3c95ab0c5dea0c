// The background: the sky with the sun's disc, and a matt plain on which the block of terrain stands, with its shadow,
// fading into the sky.

@vertex
fn sky_vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return whole_picture(index);
}

const PLAIN = vec3f(0.2, 0.202, 0.202);

// The visible fraction of the sun at a point of the plain, seen along `look` from a distance `far`. Its ray to the sun
// enters the terrain at some height above the edge; the shadow there, extended to the plain, is the shadow on the point.
fn plain_sun(point: vec2f, look: vec3f, far: f32) -> f32 {
    let extent = vec2f(frame.cells) * frame.cell_m;
    let level = length(frame.sun.xz);
    if frame.flags.z == 0u || level < 1e-4 || frame.sun.y < 0.003 {
        return 1.0;
    }
    let way = frame.sun.xz / level;
    // the distance from the sides of the shadow, where the block ends; a point outside of them is moved inside, because
    // an edge that is soft over some pixels begins outside
    let aside = vec2f(-way.y, way.x);
    let across = dot(point - 0.5 * extent, aside);
    let inside = 0.5 * dot(abs(aside), extent) - abs(across);
    let place = point - aside * sign(across) * max(1e-3 * length(extent) - inside, 0.0);
    // where the ray enters the terrain
    let safe = select(way, vec2f(1e-9), abs(way) < vec2f(1e-9));
    let a = -place / safe;
    let b = (extent - place) / safe;
    let enter = max(max(min(a.x, b.x), min(a.y, b.y)), 0.0);
    let leave = min(max(a.x, b.x), max(a.y, b.y));
    // a margin against rounding: on the edge itself the ray leaves the terrain at once
    if enter > leave - 1e-4 * length(extent) {
        return 1.0;
    }
    let edge = clamp((place + way * enter) / frame.cell_m - 0.5, vec2f(0.0), vec2f(frame.cells) - 1.0);
    let land = ground_and_water((edge + 0.5) / vec2f(frame.cells));
    let top = (land.x + max(land.y, 0.0)) * frame.exaggeration;
    // the rays to the lower and the upper limb
    let shade = max(shade_heights(edge), vec2f(top)) - enter * frame.sweep_fall.xy;
    let soft = max(shade.x - shade.y, frame.cell_m);
    let seen = smoothstep(0.0, 1.0, (frame.heights.w - shade.y) / soft);
    // a pixel on the plain, across the side of the shadow
    let ahead = look.xz / max(length(look.xz), 1e-6);
    let stretch = abs(dot(aside, ahead)) / max(-look.y, 1e-3) + abs(dot(aside, vec2f(-ahead.y, ahead.x)));
    let pixel = 2.0 * far * length(frame.up.xyz) / frame.size.y * stretch;
    return mix(1.0, seen, clamp(0.5 + inside / max(1.5 * pixel, 0.0093 * enter), 0.0, 1.0));
}

fn plain_light(way: vec3f, far: f32) -> vec3f {
    let extent = vec2f(frame.cells) * frame.cell_m;
    var place = frame.eye.xz + way.xz * far;
    if all(place > vec2f(0.0)) && all(place < extent) {
        // a pixel on the lower edge of a wall: the visible plain is in front of the wall
        let back = -way.xz;
        let safe = select(back, vec2f(1e-9), abs(back) < vec2f(1e-9));
        let out = max(-place / safe, (extent - place) / safe);
        place += back * min(out.x, out.y);
    }
    let off = max(max(-place, place - extent), vec2f(0.0));
    let wall = max(frame.heights.y * frame.exaggeration - frame.heights.w, 1e-3);
    let near = exp(-length(off) / (0.5 * wall));
    let sun = sun_light();
    let light = sun * max(frame.sun.y, 0.0) * plain_sun(place, way, far) + ambient_light(vec3f(0.0, 1.0, 0.0)) * (1.0 - 0.5 * near);
    let clear = exp(-haze_depth(way, far));
    let source = haze_source(dot(way, frame.sun.xyz), sun, 1.0, 1.0);
    let thickness = haze_rayleigh() + haze_mie();
    return PLAIN * light * clear + source / max(thickness, vec3f(1e-12)) * (1.0 - clear);
}

@fragment
fn sky_fragment(@builtin(position) at: vec4f) -> @location(0) vec4f {
    if frame.background.w == 0.0 {
        return frame.background;
    }
    let way = normalize(way_through(at.xy));
    let sky = sky_light(way);
    if way.y < 0.0 && frame.eye.y > frame.heights.w {
        let far = (frame.heights.w - frame.eye.y) / way.y;
        let extent = length(vec2f(frame.cells)) * frame.cell_m;
        let horizon = sky_light(normalize(vec3f(way.x, 0.004, way.z)));
        let plain = plain_light(way, min(far, 40.0 * extent));
        return vec4f(mix(plain, horizon, smoothstep(0.08, 0.75, log2(1.0 + far / extent) / 3.6)), 1.0);
    }
    let away = acos(clamp(dot(way, frame.sun.xyz), -1.0, 1.0));
    let disc = smoothstep(0.0056, 0.0046, away) * 40.0;
    return vec4f(sky + disc * sun_light(), 1.0);
}
