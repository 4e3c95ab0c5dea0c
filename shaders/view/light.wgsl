// Lookups in the tables of the sky.

fn sky_from(table: texture_2d<f32>, way: vec3f, cos_turn: f32) -> vec3f {
    let r = 6360.0 + frame.sky.x;
    let latitude = asin(clamp(way.y, -1.0, 1.0)) + acos(6360.0 / r);
    let v = 0.5 + 0.5 * sign(latitude) * sqrt(min(abs(latitude) / (0.5 * PI), 1.0));
    let u = acos(clamp(cos_turn, -1.0, 1.0)) / PI;
    let size = vec2f(192.0, 108.0);
    return textureSampleLevel(table, smooth_sampler, (vec2f(u, v) * (size - 1.0) + 0.5) / size, 0.0).rgb;
}

// Cosine of the angle between the azimuths of a direction and of the sun.
fn cos_turn_of(way: vec3f) -> f32 {
    let both = length(way.xz) * length(frame.sun.xz);
    return select(dot(way.xz, frame.sun.xz) / both, 1.0, both < 1e-6);
}
