// The terrain: tiles of a quadtree whose odd vertices slide to their even neighbours (crates/app/src/view/lod.rs), and
// walls from its edges down to the base.

const TILE = 16u;

struct Tile {
    @location(0) origin: vec2u,
    @location(1) level_and_side: vec2u,
    @location(2) slide: vec2f,
}

struct Vertex {
    @builtin(position) clip: vec4f,
    @location(0) place: vec3f, // relative to the camera
    @location(1) uv: vec2f,
    @location(2) @interpolate(flat) level: u32,
    @location(3) @interpolate(flat) side: u32,
}

// The surface at a grid line. With one line per cell, line g runs through the centre of cell g - 1, and the outermost
// lines along the edge of the terrain; denser lines run in between. Lines beyond the edge are on it.
fn surface_at(line: vec2u) -> vec3f {
    let first = vec2u(frame.lines.z);
    let g = clamp(line, first, frame.lines.xy);
    let edge = (select(vec2f(0.0), vec2f(1.0), g == first) - select(vec2f(0.0), vec2f(1.0), g == frame.lines.xy)) * frame.grid.z;
    let at = (vec2f(vec2i(g) - frame.eye_line) - frame.eye_part + edge) * frame.grid.y;
    let top = relief((vec2f(g) + edge) * frame.grid.x - 1.0, at);
    return vec3f(at.x, top * frame.exaggeration - frame.eye.y, at.y);
}

fn vertex_at(tile: Tile, corner: vec2u) -> vec3f {
    let level = tile.level_and_side.x;
    let here = surface_at(tile.origin + (corner << vec2u(level)));
    let away = length(vec3f(here.x, frame.eye.w, here.z));
    let way = clamp((away - tile.slide.x) * tile.slide.y, 0.0, 1.0);
    if way <= 0.0 {
        return here;
    }
    let even = surface_at(tile.origin + ((corner & vec2u(~1u)) << vec2u(level)));
    // exactly the neighbour's vertex at the end, however `mix` is computed
    return select(mix(here, even, way), even, way >= 1.0);
}

fn as_vertex(place: vec3f, level: u32, side: u32) -> Vertex {
    let extent = vec2f(frame.cells) * frame.cell_m;
    let uv = (place.xz + frame.eye.xz) / extent;
    return Vertex(frame.projection * vec4f(place, 1.0), place, uv, level, side);
}

@vertex
fn surface_vertex(@builtin(vertex_index) index: u32, tile: Tile) -> Vertex {
    let corner = vec2u(index % (TILE + 1u), index / (TILE + 1u));
    return as_vertex(vertex_at(tile, corner), tile.level_and_side.x, 0u);
}

// Pairs of vertices along the edge: one on the surface, one below it on the base.
@vertex
fn wall_vertex(@builtin(vertex_index) index: u32, tile: Tile) -> Vertex {
    let side = tile.level_and_side.y;
    let along = index >> 1u;
    // columns beyond the edge are on it; the last one is even, so it never slides away
    let across = select(0u, TILE, (side & 1u) == 1u);
    let corner = select(vec2u(along, across), vec2u(across, along), side < 2u);
    var place = vertex_at(tile, corner);
    if (index & 1u) == 1u {
        place.y = frame.heights.w - frame.eye.y;
    }
    return as_vertex(place, tile.level_and_side.x, side);
}

fn level_colour(level: u32) -> vec3f {
    return 0.25 + 0.5 * vec3f(vec3u(level & 1u, (level >> 1u) & 1u, (level >> 2u) & 1u));
}

// Colour of bare ground: tints by height, rock on steep slopes. Snow is for mountains: it needs a relief of 2.6 km, or
// of a fifth of the extent of a small terrain.
fn natural(height: f32, slope: f32) -> vec3f {
    let range = max(frame.heights.y - frame.heights.x, min(2600.0, 0.2 * frame.grid.w));
    let at = clamp((height - frame.heights.x) / range, 0.0, 1.0);
    let soft = textureSampleLevel(tint_map, smooth_sampler, vec2f(at, 0.5 / 3.0), 0.0).rgb;
    let rock = textureSampleLevel(tint_map, smooth_sampler, vec2f(0.35 + 0.5 * at, 1.5 / 3.0), 0.0).rgb;
    return mix(soft, rock, smoothstep(0.55, 0.95, slope));
}

fn albedo_at(uv: vec2f, height: f32, slope: f32, tone: f32) -> vec3f {
    switch frame.flags.x {
        case 0u: { return textureSample(colour_map, slant_sampler, uv).rgb; }
        // rock shows through the grass in patches
        case 1u: { return natural(height, slope + 0.35 * tone) * (1.0 + 0.5 * tone); }
        case 2u: {
            let at = clamp((height - frame.heights.x) / max(frame.heights.y - frame.heights.x, 1.0), 0.0, 1.0);
            return textureSampleLevel(tint_map, smooth_sampler, vec2f(at, 2.5 / 3.0), 0.0).rgb;
        }
        default: { return vec3f(0.32, 0.31, 0.295); }
    }
}

// The fraction of a pixel that a contour line covers; lines are 1.3 pixels wide, every fifth 2.2.
fn contour(height: f32) -> f32 {
    let interval = frame.overlay.x;
    if interval <= 0.0 {
        return 0.0;
    }
    let count = height / interval;
    let width = max(fwidth(count), 1e-6);
    let line = abs(fract(count - 0.5) - 0.5) / width;
    let heavy = abs(fract(count * 0.2 - 0.5) - 0.5) * 5.0 / width;
    let thin = clamp(1.15 - line, 0.0, 1.0) * 0.7;
    let thick = clamp(1.6 - heavy, 0.0, 1.0);
    // lines less than a few pixels apart blend to a tone
    return max(thin * smoothstep(0.35, 0.15, width), thick * smoothstep(1.5, 0.7, width)) * frame.overlay.y;
}

// The visible fraction of the sun at a point of the surface: exact for cells that are large on the screen, averaged
// over cells for small ones. Four samples around the point hide the rows of cells at the edge of a shadow.
fn seen_at(uv: vec2f, top: f32, gradient: vec2f) -> f32 {
    if frame.flags.z == 0u {
        return 1.0;
    }
    let cell = uv * vec2f(frame.cells) - 0.5;
    let far = textureSample(seen_map, slant_sampler, uv).x;
    let spread = max(length(dpdx(cell)), length(dpdy(cell)));
    if spread > 1.0 {
        return far;
    }
    var near = 0.0;
    for (var k = 0; k < 4; k++) {
        let aside = select(vec2f(0.2, 0.45), vec2f(-0.45, 0.2), (k & 1) == 1) * select(1.0, -1.0, k > 1);
        near += 0.25 * sun_seen(cell + aside, top + dot(gradient, aside) * frame.cell_m);
    }
    return mix(near, far, smoothstep(0.5, 1.0, spread));
}

fn lit(albedo: vec3f, normal: vec3f, seen: f32, open: f32) -> vec3f {
    let sun = sun_light() * max(dot(normal, frame.sun.xyz), 0.0) * seen;
    return albedo * (sun + ambient_light(normal) * open);
}

// Water over a bed that reflects this light: absorption and scattering in the water, reflections of sky and sun.
// Absorption of clear water by J. T. O. Kirk, 1994; Fresnel reflection after C. Schlick, 1994; glitter by GGX.
fn through_water(bed: vec3f, depth: f32, normal: vec3f, way: vec3f, seen: f32, open: f32, rough: f32) -> vec3f {
    const TAKEN = vec3f(0.35, 0.08, 0.05);
    let facing = max(dot(-way, normal), 0.03);
    let fresnel = 0.02 + 0.98 * pow(1.0 - facing, 5.0);
    let refracted = sqrt(1.0 - (1.0 - facing * facing) / 1.769);
    let path = depth * (1.0 + 1.0 / refracted);
    let sun = sun_light() * seen;
    let inside = (sun * max(frame.sun.y, 0.0) * 0.7 + ambient_light(vec3f(0.0, 1.0, 0.0)) * open);
    let murk = vec3f(0.014, 0.038, 0.043) * inside * (1.0 - exp(-0.3 * depth));
    var up = reflect(way, normal);
    up.y = abs(up.y) + 0.01;
    let mirrored = sky_light(normalize(up)) * mix(0.6, 1.0, open);
    let half_way = normalize(frame.sun.xyz - way);
    let square = rough * rough;
    let n_h = max(dot(normal, half_way), 0.0);
    let spread = n_h * n_h * (square - 1.0) + 1.0;
    let glitter = square / (PI * spread * spread);
    let schlick = 0.02 + 0.98 * pow(1.0 - max(dot(half_way, frame.sun.xyz), 0.0), 5.0);
    let glint = PI * sun * glitter * schlick * 0.25 / max(facing, 0.2) * step(0.0, frame.sun.y);
    return (bed * exp(-TAKEN * path) + murk) * (1.0 - fresnel) + mirrored * fresnel + min(glint, vec3f(6.0));
}

fn noise(at: vec2f) -> f32 {
    let cell = floor(at);
    let part = at - cell;
    let s = part * part * (3.0 - 2.0 * part);
    let a = hash(cell);
    let b = hash(cell + vec2f(1.0, 0.0));
    let c = hash(cell + vec2f(0.0, 1.0));
    let d = hash(cell + 1.0);
    return mix(mix(a, b, s.x), mix(c, d, s.x), s.y);
}

fn hash(cell: vec2f) -> f32 {
    var h = (bitcast<u32>(i32(cell.x)) * 0x9e3779b9u) ^ (bitcast<u32>(i32(cell.y)) * 0x85ebca6bu);
    h = (h ^ (h >> 15u)) * 0x2c1b3c6du;
    h = (h ^ (h >> 12u)) * 0x297a2d39u;
    return f32(h >> 8u) / 16777216.0;
}

// Slope of small waves at a position in metres; fades out for waves of less than a few pixels.
fn ripples(at: vec2f, spread: f32) -> vec2f {
    var slope = vec2f(0.0);
    for (var k = 0; k < 3; k++) {
        let size = 9.0 / f32(1u << u32(k));
        let strength = 0.05 * smoothstep(0.5, 0.1, spread / size);
        let drift = vec2f(0.6, 0.8) * frame.seconds * sqrt(size) * select(1.0, -1.0, k == 1);
        let p = (at + drift) / size;
        let e = 0.2;
        let n = noise(p);
        slope += strength * vec2f(noise(p + vec2f(e, 0.0)) - n, noise(p + vec2f(0.0, e)) - n) / e;
    }
    return slope;
}

// Ground below the size of a cell: its slope, and its tone around 0. The terrain's own roughness goes on in octaves of
// half the length and height, larger on steep ground; lengths are powers of two metres, so that parts with finer cells
// agree, and turned against each other, so that their lattices do not show. Octaves fade out below a few pixels.
fn ground_texture(at: vec2f, slope: f32, spread: f32) -> vec3f {
    var sum = vec3f(0.0);
    let steep = smoothstep(0.3, 0.9, slope);
    var size = frame.sky.z;
    var turn = vec2f(0.8, 0.6);
    for (var k = 0; k < 7; k++) {
        let strength = frame.sky.y * smoothstep(0.4, 0.1, spread / size);
        if strength > 0.0 {
            let p = vec2f(turn.x * at.x - turn.y * at.y, turn.y * at.x + turn.x * at.y) / size + 17.0 * f32(k);
            let e = 0.15;
            let n = noise(p);
            let rise = vec2f(noise(p + vec2f(e, 0.0)) - n, noise(p + vec2f(0.0, e)) - n) / e;
            let back = vec2f(turn.x * rise.x + turn.y * rise.y, turn.x * rise.y - turn.y * rise.x);
            sum += strength * vec3f(back * mix(0.09, 0.3, steep), (n - 0.5) * mix(0.3, 0.45, steep));
        }
        size *= 0.5;
        turn = vec2f(turn.x * 0.36 - turn.y * 0.93, turn.y * 0.36 + turn.x * 0.93);
    }
    return sum;
}

// The fraction of the sunlight that clouds let through to a point at a position in metres and an exaggerated height. A
// low sun moves their shadows no farther aside than one at 9°.
fn past_clouds(at: vec2f, height: f32) -> f32 {
    if frame.clouds.x > 1.0 {
        return 1.0;
    }
    const OCTAVES = 6;
    var p = (at + frame.sun.xz / max(frame.sun.y, 0.15) * (frame.clouds.z - height)) * frame.clouds.y;
    var sum = 0.0;
    var strength = 0.5;
    for (var k = 0; k < OCTAVES; k++) {
        sum += strength * noise(p);
        p = 2.0 * vec2f(0.8 * p.x - 0.6 * p.y, 0.6 * p.x + 0.8 * p.y) + 13.7;
        strength *= 0.5;
    }
    return 1.0 - 0.8 * smoothstep(-0.05, 0.05, sum - frame.clouds.x);
}

fn top_at(uv: vec2f) -> f32 {
    let land = ground_and_water(uv);
    return land.x + max(land.y, 0.0);
}

@fragment
fn surface_fragment(in: Vertex) -> @location(0) vec4f {
    return surface(in);
}

// The same for tiles across the edge of the inset. Pixels beyond the edge are shaded before they are discarded, because
// their neighbours need them for derivatives.
@fragment
fn split_fragment(in: Vertex) -> @location(0) vec4f {
    let inset = frame.lines.w == 2u;
    let inside = min(in.place.xz - frame.inset.xy, frame.inset.zw - in.place.xz);
    let near = 2.0 * fwidth(in.place.xz);
    if select(all(inside > near), any(inside < -near), inset) {
        discard;
    }
    let light = surface(in);
    if is_in_inset(in.place.xz) != inset {
        discard;
    }
    return light;
}

fn surface(in: Vertex) -> vec4f {
    let uv = clamp(in.uv, vec2f(0.0), vec2f(1.0));
    let land = ground_and_water(uv);
    let gradient = textureSample(gradient_map, slant_sampler, uv).xy * frame.exaggeration;
    let spread = max(length(dpdx(in.place.xz)), length(dpdy(in.place.xz)));
    let at = uv * vec2f(frame.cells) * frame.cell_m + frame.corner.xy;
    let texture = ground_texture(at, length(gradient) / frame.exaggeration, spread);
    let normal = normalize(vec3f(-gradient.x - texture.x, 1.0, -gradient.y - texture.y));
    var albedo = albedo_at(uv, land.x, length(gradient) / frame.exaggeration, texture.z);
    let overlay = textureSample(overlay_map, smooth_sampler, uv).xy;
    albedo = mix(albedo, vec3f(0.75, 0.16, 0.05), overlay.x * frame.overlay.z);
    albedo = mix(albedo, vec3f(0.01, 0.12, 0.5), overlay.y);
    if frame.flags.y == 1u {
        albedo = level_colour(in.level);
    }
    albedo *= 1.0 - contour(land.x);
    let depth = max(land.y, 0.0);
    let wet = smoothstep(0.02, 0.3, depth);
    let top = (land.x + depth) * frame.exaggeration;
    let seen = seen_at(uv, top, gradient * (1.0 - wet)) * past_clouds(at, top);
    let open = pow(textureSample(open_map, smooth_sampler, uv * frame.over.zw + frame.over.xy).x, 1.6);
    var light = lit(albedo, normal, seen, open);
    if wet > 0.0 {
        let step = vec2f(1.0) / vec2f(frame.cells);
        let east = top_at(uv + vec2f(step.x, 0.0)) - top_at(uv - vec2f(step.x, 0.0));
        let south = top_at(uv + vec2f(0.0, step.y)) - top_at(uv - vec2f(0.0, step.y));
        let slope = vec2f(east, south) * frame.exaggeration / (2.0 * frame.cell_m);
        let waves = ripples(at, spread);
        let surface = normalize(vec3f(-slope.x - waves.x, 1.0, -slope.y - waves.y));
        let rough = mix(0.06, 0.16, smoothstep(1.0, 20.0, spread));
        light = mix(light, through_water(light, depth, surface, normalize(in.place), seen, open, rough), wet);
    }
    return vec4f(light, 1.0);
}

// The walls of the block: bare earth, slightly darker towards the plain, and water where it is above the ground.
@fragment
fn wall_fragment(in: Vertex) -> @location(0) vec4f {
    var normal = vec3f(0.0);
    switch in.side {
        case 0u: { normal.x = -1.0; }
        case 1u: { normal.x = 1.0; }
        case 2u: { normal.z = -1.0; }
        default: { normal.z = 1.0; }
    }
    let land = ground_and_water(clamp(in.uv, vec2f(0.0), vec2f(1.0)));
    let height = in.place.y + frame.eye.y;
    let ground = land.x * frame.exaggeration;
    let bottom = frame.heights.w;
    let up = clamp((height - bottom) / max(ground - bottom, 1e-3), 0.0, 1.0);
    var albedo = mix(vec3f(0.16, 0.15, 0.14), vec3f(0.24, 0.22, 0.2), up);
    var open = mix(0.55, 0.9, up);
    // dry ground has no water on top, wherever a pixel at the edge is sampled
    if land.y > 0.0 && height > ground {
        albedo = vec3f(0.02, 0.075, 0.095);
        open = 1.0;
    }
    return vec4f(lit(albedo, normal, 1.0, open), 1.0);
}
