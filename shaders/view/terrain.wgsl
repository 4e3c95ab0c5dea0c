// The land: tiles of a quadtree whose odd vertices slide to their even neighbours (crates/app/src/view/lod.rs), and walls
// from its edges down to the base.

const TILE = 16u;

struct Tile {
    @location(0) origin: vec2u,
    @location(1) level_and_side: vec2u,
    @location(2) slide: vec2f,
}

struct Vertex {
    @builtin(position) clip: vec4f,
    @location(0) place: vec3f, // relative to the eye
    @location(1) uv: vec2f,
    @location(2) @interpolate(flat) level: u32,
    @location(3) @interpolate(flat) side: u32,
}

// The surface at a grid line: line g lies half a cell before the centre of cell g, the outermost on the land's edge.
fn surface_at(line: vec2u) -> vec3f {
    let last = frame.cells + 1u;
    let g = min(line, last);
    let cell = vec2i(g) - 1;
    let top = max(ground_at(cell) + water_at(cell), frame.heights.z);
    let edge = select(vec2f(0.0), vec2f(0.5), g == vec2u(0u)) - select(vec2f(0.0), vec2f(0.5), g == last);
    let at = (vec2f(vec2i(g) - frame.eye_cell) - frame.eye_part + edge) * frame.cell_m;
    return vec3f(at.x, top * frame.exaggeration - frame.eye.y, at.y);
}

fn vertex_at(tile: Tile, corner: vec2u) -> vec3f {
    let level = tile.level_and_side.x;
    let here = surface_at(tile.origin + (corner << vec2u(level)));
    let away = length(vec3f(here.x, frame.eye.w, here.z));
    let way = clamp((away - tile.slide.x) * tile.slide.y, 0.0, 1.0);
    let even = surface_at(tile.origin + ((corner & vec2u(~1u)) << vec2u(level)));
    // exactly the neighbour's vertex at the end of the way, however `mix` is computed
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

// Pairs along the edge: on the surface, and below it on the base.
@vertex
fn wall_vertex(@builtin(vertex_index) index: u32, tile: Tile) -> Vertex {
    let side = tile.level_and_side.y;
    let along = index >> 1u;
    // columns beyond the edge all lie on it; the last is even, so it never slides away
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

// Colour of bare land: tints by height, rock where it is steep.
fn natural(height: f32, slope: f32) -> vec3f {
    let relief = max(frame.heights.y - frame.heights.x, 1.0);
    let at = clamp((height - frame.heights.x) / relief, 0.0, 1.0);
    let soft = textureSampleLevel(tint_map, smooth_sampler, vec2f(at, 0.5 / 3.0), 0.0).rgb;
    let rock = textureSampleLevel(tint_map, smooth_sampler, vec2f(0.35 + 0.5 * at, 1.5 / 3.0), 0.0).rgb;
    return mix(soft, rock, smoothstep(0.55, 0.95, slope));
}

fn albedo_at(uv: vec2f, height: f32, slope: f32) -> vec3f {
    switch frame.flags.x {
        case 0u: { return textureSample(colour_map, slant_sampler, uv).rgb; }
        case 1u: { return natural(height, slope); }
        case 2u: {
            let at = clamp((height - frame.heights.x) / max(frame.heights.y - frame.heights.x, 1.0), 0.0, 1.0);
            return textureSampleLevel(tint_map, smooth_sampler, vec2f(at, 2.5 / 3.0), 0.0).rgb;
        }
        default: { return vec3f(0.42, 0.41, 0.39); }
    }
}

// How much of a contour line a pixel holds; lines are 1.3 pixels wide, every fifth 2.2.
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
    // lines closer than a few pixels are a tone, not lines
    return max(thin * smoothstep(0.35, 0.15, width), thick * smoothstep(1.5, 0.7, width)) * frame.overlay.y;
}

fn lit(albedo: vec3f, normal: vec3f) -> vec3f {
    let sun = max(dot(normal, frame.sun.xyz), 0.0) * vec3f(3.1, 2.8, 2.4) * smoothstep(-0.05, 0.1, frame.sun.y);
    let sky = mix(vec3f(0.25, 0.24, 0.22), vec3f(0.5, 0.62, 0.85), normal.y * 0.5 + 0.5);
    return albedo * (sun + sky);
}

@fragment
fn surface_fragment(in: Vertex) -> @location(0) vec4f {
    let land = ground_and_water(in.uv);
    let gradient = textureSample(gradient_map, slant_sampler, in.uv).xy * frame.exaggeration;
    let normal = normalize(vec3f(-gradient.x, 1.0, -gradient.y));
    var albedo = albedo_at(in.uv, land.x, length(gradient) / frame.exaggeration);
    let mask = textureSample(mask_map, smooth_sampler, in.uv).x * frame.overlay.z;
    albedo = mix(albedo, vec3f(0.75, 0.16, 0.05), mask);
    if frame.flags.y == 1u {
        albedo = level_colour(in.level);
    }
    albedo *= 1.0 - contour(land.x);
    return vec4f(lit(albedo, normal), 1.0);
}

@fragment
fn wall_fragment(in: Vertex) -> @location(0) vec4f {
    var normal = vec3f(0.0);
    switch in.side {
        case 0u: { normal.x = -1.0; }
        case 1u: { normal.x = 1.0; }
        case 2u: { normal.z = -1.0; }
        default: { normal.z = 1.0; }
    }
    return vec4f(lit(vec3f(0.16, 0.145, 0.13), normal), 1.0);
}
