// The tables of the sky: S. Hillaire, 2020, A scalable and production ready sky and atmosphere rendering technique.
// Lengths are in kilometres. Sunlight is scaled so that a matt white surface without air in between has a radiance of
// 1. There is no table of aerial perspective: the haze over the terrain is ray-marched instead (haze.wgsl).

@group(1) @binding(0) var clear_table: texture_2d<f32>; // transmittance to the top of the atmosphere
@group(1) @binding(1) var again_table: texture_2d<f32>; // multiple scattering
@group(1) @binding(2) var sky_table: texture_2d<f32>;   // radiance of the sky by direction

const GROUND = 6360.0;
const TOP = 6460.0;
const RAYLEIGH = vec3f(0.005802, 0.013558, 0.0331);
const MIE = 0.003996;
const MIE_EXTINCTION = 0.00444;
const OZONE = vec3f(0.00065, 0.001881, 0.000085);
const GROUND_ALBEDO = 0.2;

struct Air {
    rayleigh: vec3f,
    mie: f32,
    extinction: vec3f,
}

fn air_at(altitude: f32) -> Air {
    let rayleigh = RAYLEIGH * exp(-altitude / 8.0);
    let thin = exp(-altitude / 1.2);
    let ozone = OZONE * max(0.0, 1.0 - abs(altitude - 25.0) / 15.0);
    return Air(rayleigh, MIE * thin, rayleigh + MIE_EXTINCTION * thin + ozone);
}

// Distance to the top of the atmosphere from radius r within it; mu is the cosine of the angle to the zenith.
fn to_top(r: f32, mu: f32) -> f32 {
    return -r * mu + sqrt(max(r * r * mu * mu + (TOP - r) * (TOP + r), 0.0));
}

// Distance to the ground; negative for a ray that misses it.
fn to_ground(r: f32, mu: f32) -> f32 {
    let under = r * r * mu * mu + (GROUND - r) * (GROUND + r);
    if mu >= 0.0 || under < 0.0 {
        return -1.0;
    }
    return max(-r * mu - sqrt(under), 0.0);
}

fn rayleigh_phase(c: f32) -> f32 {
    return 3.0 / (16.0 * PI) * (1.0 + c * c);
}

// Phase function of Cornette and Shanks, 1992.
fn mie_phase(c: f32) -> f32 {
    const G = 0.8;
    let spread = 1.0 + G * G - 2.0 * G * c;
    return 3.0 / (8.0 * PI) * (1.0 - G * G) * (1.0 + c * c) / ((2.0 + G * G) * spread * sqrt(spread));
}

const REACH = 1132.2544; // sqrt(TOP² - GROUND²)

fn clear_to_sun(r: f32, mu: f32) -> vec3f {
    let rho = sqrt(max((r - GROUND) * (r + GROUND), 0.0));
    let nearest = TOP - r;
    let uv = vec2f((to_top(r, mu) - nearest) / (rho + REACH - nearest), rho / REACH);
    let size = vec2f(256.0, 64.0);
    let clear = textureSampleLevel(clear_table, smooth_sampler, (uv * (size - 1.0) + 0.5) / size, 0.0).rgb;
    // the sun sets below the horizon
    let horizon = -rho / r;
    return clear * smoothstep(-0.008, 0.004, mu - horizon);
}

fn scattered_again(r: f32, mu: f32) -> vec3f {
    let uv = vec2f(mu * 0.5 + 0.5, (r - GROUND) / (TOP - GROUND));
    return textureSampleLevel(again_table, smooth_sampler, (uv * 31.0 + 0.5) / 32.0, 0.0).rgb;
}

@vertex
fn table_vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return whole_picture(index);
}

@fragment
fn clear_fragment(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let uv = (at.xy - 0.5) / vec2f(255.0, 63.0);
    let rho = uv.y * REACH;
    let r = sqrt(rho * rho + GROUND * GROUND);
    let nearest = TOP - r;
    let way = nearest + uv.x * (rho + REACH - nearest);
    let mu = select(clamp((REACH * REACH - rho * rho - way * way) / (2.0 * r * way), -1.0, 1.0), 1.0, way <= 0.0);
    const STEPS = 40;
    var depth = vec3f(0.0);
    for (var k = 0; k < STEPS; k++) {
        let t = (f32(k) + 0.5) / f32(STEPS) * way;
        depth += air_at(sqrt(r * r + t * t + 2.0 * r * mu * t) - GROUND).extinction;
    }
    return vec4f(exp(-depth * way / f32(STEPS)), 1.0);
}

struct Marched {
    light: vec3f,
    again: vec3f, // what the ray would scatter of a uniform light of 1 from all sides
}

// Light scattered along a ray from radius r. With `even`, phase functions are uniform and scattering is single.
fn march(r: f32, mu: f32, sun_mu: f32, toward_sun: f32, steps: i32, even: bool) -> Marched {
    let ground = to_ground(r, mu);
    let way = select(to_top(r, mu), ground, ground >= 0.0);
    let phases = select(vec2f(rayleigh_phase(toward_sun), mie_phase(toward_sun)), vec2f(0.25 / PI), even);
    var out = Marched(vec3f(0.0), vec3f(0.0));
    var clear = vec3f(1.0);
    var before = 0.0;
    for (var k = 0; k < steps; k++) {
        // steps grow with distance
        let part = (f32(k) + 1.0) / f32(steps);
        let end = way * part * part;
        let step = end - before;
        let t = before + 0.4 * step;
        before = end;
        let at = sqrt(r * r + t * t + 2.0 * r * mu * t);
        let at_sun_mu = clamp((r * sun_mu + t * toward_sun) / at, -1.0, 1.0);
        let air = air_at(at - GROUND);
        let sun = clear_to_sun(at, at_sun_mu);
        var source = (air.rayleigh * phases.x + air.mie * phases.y) * sun * PI;
        if !even {
            source += (air.rayleigh + air.mie) * scattered_again(at, at_sun_mu) * PI;
        }
        let through = exp(-air.extinction * step);
        let taken = (1.0 - through) / max(air.extinction, vec3f(1e-7));
        out.light += clear * source * taken;
        out.again += clear * (air.rayleigh + air.mie) * taken;
        clear *= through;
    }
    if ground >= 0.0 {
        let at_sun_mu = clamp((r * sun_mu + way * toward_sun) / GROUND, -1.0, 1.0);
        out.light += clear * GROUND_ALBEDO * max(at_sun_mu, 0.0) * clear_to_sun(GROUND + 0.01, at_sun_mu);
    }
    return out;
}

@fragment
fn again_fragment(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let uv = (at.xy - 0.5) / 31.0;
    let sun_mu = uv.x * 2.0 - 1.0;
    let r = GROUND + 0.01 + uv.y * (TOP - GROUND - 0.02);
    let sun = vec3f(sqrt(max(1.0 - sun_mu * sun_mu, 0.0)), sun_mu, 0.0);
    var light = vec3f(0.0);
    var again = vec3f(0.0);
    for (var k = 0; k < 64; k++) {
        let up = 1.0 - 2.0 * (f32(k / 8) + 0.5) / 8.0;
        let turn = 2.0 * PI * (f32(k % 8) + 0.5) / 8.0;
        let level = sqrt(1.0 - up * up);
        let way = vec3f(level * cos(turn), up, level * sin(turn));
        let one = march(r, up, sun_mu, dot(way, sun), 20, true);
        light += one.light / 64.0;
        again += one.again / 64.0;
    }
    // the sum of all further orders, a geometric series
    return vec4f(light / PI / (1.0 - again), 1.0);
}

fn eye_radius() -> f32 {
    return GROUND + frame.sky.x;
}

@fragment
fn sky_fragment(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let uv = (at.xy - 0.5) / vec2f(191.0, 107.0);
    let r = eye_radius();
    let v = uv.y * 2.0 - 1.0;
    let latitude = clamp(sign(v) * v * v * 0.5 * PI - acos(GROUND / r), -0.5 * PI, 0.5 * PI);
    let turn = uv.x * PI;
    let way = vec3f(cos(latitude) * cos(turn), sin(latitude), cos(latitude) * sin(turn));
    let sun = vec3f(sqrt(max(1.0 - frame.sun.y * frame.sun.y, 0.0)), frame.sun.y, 0.0);
    return vec4f(march(r, way.y, sun.y, dot(way, sun), 32, false).light, 1.0);
}

// Light of the whole sky on a matt white surface with the normal of this texel: azimuth from the sun, and height.
@fragment
fn ambient_fragment(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let turn = (at.x - 0.5) / 15.0 * PI;
    let up = (at.y - 0.5) / 15.0 * 2.0 - 1.0;
    let level = sqrt(max(1.0 - up * up, 0.0));
    let normal = vec3f(level * cos(turn), up, level * sin(turn));
    var sum = vec3f(0.0);
    for (var k = 0; k < 16 * 32; k++) {
        let y = 1.0 - 2.0 * (f32(k / 32) + 0.5) / 16.0;
        let angle = 2.0 * PI * (f32(k % 32) + 0.5) / 32.0;
        let flat = sqrt(1.0 - y * y);
        let way = vec3f(flat * cos(angle), y, flat * sin(angle));
        sum += max(dot(way, normal), 0.0) * sky_from(sky_table, way, cos(angle));
    }
    return vec4f(sum * 4.0 / 512.0, 1.0);
}
