// Light on the terrain: sun through the atmosphere, shadows, and sky.

@group(2) @binding(0) var sky_map: texture_2d<f32>;     // radiance of the sky by direction
@group(2) @binding(1) var ambient_map: texture_2d<f32>; // light of the whole sky by normal
@group(2) @binding(2) var clear_map: texture_2d<f32>;   // transmittance, see atmosphere.wgsl

fn sky_light(way: vec3f) -> vec3f {
    return sky_from(sky_map, way, cos_turn_of(way));
}

// Light of the sky, and light reflected by sunlit terrain around, which makes shadows less blue than the sky. A quarter
// brighter than physical, because eyes adapt to shadows.
fn ambient_light(normal: vec3f) -> vec3f {
    const LAND = vec3f(0.17, 0.16, 0.145);
    // slopes facing away from the sun receive light from those that face it
    let away = max(-dot(normal.xz, frame.sun.xz), 0.0);
    let around = LAND * sun_light() * (max(frame.sun.y, 0.0) * mix(0.6, 0.25, normal.y * 0.5 + 0.5) + 0.35 * away);
    let sky = sky_on(normal);
    return 1.25 * (mix(sky, vec3f(dot(sky, vec3f(0.2126, 0.7152, 0.0722))), 0.35) + around);
}

fn sky_on(normal: vec3f) -> vec3f {
    let u = acos(clamp(cos_turn_of(normal), -1.0, 1.0)) / PI;
    let v = normal.y * 0.5 + 0.5;
    return textureSampleLevel(ambient_map, smooth_sampler, (vec2f(u, v) * 15.0 + 0.5) / 16.0, 0.0).rgb;
}

// Sunlight on a surface that faces the sun.
fn sun_light() -> vec3f {
    const REACH = 1132.2544;
    let r = 6360.5;
    let rho = sqrt((r - 6360.0) * (r + 6360.0));
    let nearest = 6460.0 - r;
    let mu = frame.sun.y;
    let way = -r * mu + sqrt(max(r * r * mu * mu + (6460.0 - r) * (6460.0 + r), 0.0));
    let uv = vec2f((way - nearest) / (rho + REACH - nearest), rho / REACH);
    let size = vec2f(256.0, 64.0);
    let clear = textureSampleLevel(clear_map, smooth_sampler, (uv * (size - 1.0) + 0.5) / size, 0.0).rgb;
    return clear * smoothstep(-0.012, 0.012, mu);
}

// Haze: two layers of air above the base, a thin high one and a dense low one, that begin at the terrain. Their density
// is chosen for looks from the extent of the terrain (uniforms.rs), so that it separates near from far at any scale.

fn haze_rayleigh() -> vec3f {
    return frame.air.y * 0.8 * vec3f(0.428, 1.0, 2.441);
}

fn haze_mie() -> f32 {
    return frame.air.y;
}

// Optical thickness of a layer whose density falls by a factor of e over `scale` metres, between two distances along a
// ray.
fn layer(height: f32, rise: f32, near: f32, far: f32, scale: f32) -> f32 {
    let low = max(height + rise * near, 0.0) / scale;
    let high = max(height + rise * far, 0.0) / scale;
    let change = high - low;
    let mean = select((exp(-low) - exp(-high)) / change, exp(-0.5 * (low + high)), abs(change) < 1e-3);
    return mean * max(far - near, 0.0);
}

// Optical depth of the haze between the camera and a distance.
fn haze_depth(way: vec3f, far: f32) -> vec3f {
    let height = frame.eye.y - frame.heights.w;
    let near = min(frame.air.x, far);
    return haze_rayleigh() * layer(height, way.y, near, far, 3.0 * frame.air.z)
        + haze_mie() * layer(height, way.y, near, far, frame.air.z);
}

// Light that a metre of haze scatters along a ray, for this sunlight and the densities of the two layers.
fn haze_source(toward_sun: f32, sun: vec3f, thin: f32, thick: f32) -> vec3f {
    const G = 0.7;
    let spread = 1.0 + G * G - 2.0 * G * toward_sun;
    let mie = 0.25 * (1.0 - G * G) / (spread * sqrt(spread));
    let rayleigh = 0.1875 * (1.0 + toward_sun * toward_sun);
    let even = ambient_light(vec3f(0.0, 1.0, 0.0));
    return haze_rayleigh() * thin * (rayleigh * sun + even * 0.6) + haze_mie() * thick * (mie * sun + even * 0.6);
}

// The visible fraction of the sun at an exaggerated height over a position in cells.
fn sun_seen(cell: vec2f, height: f32) -> f32 {
    if frame.flags.z == 0u {
        return 1.0;
    }
    let shade = shade_heights(cell);
    let soft = max(shade.x - shade.y, 0.12 * frame.cell_m);
    return smoothstep(0.0, 1.0, (height - shade.y) / soft);
}

// The heights between which the sun is partly hidden, at a position in cells.
fn shade_heights(cell: vec2f) -> vec2f {
    return swept(shade_map, frame.sweep, frame.sweep_lines, cell);
}
