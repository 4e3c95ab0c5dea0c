// Reflected light; see crates/nodes/src/render/hillshade.

/// The part of the sun that a cell sees.
fn lit_part(i: u32) -> f32 {
    let part = (p.k_hidden - tangents[i] * p.exaggeration) / (p.k_hidden - p.k_seen);
    return 1.0 - p.shadows * (1.0 - clamp(part, 0.0, 1.0));
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    var lit = 1.0;
    var sky = 1.0;
    if (p.k_casts != 0u) {
        lit = lit_part(i);
        sky = 1.0 - min(sums[i] * p.k_share, 1.0);
    }
    let slope = horn(cell) * p.exaggeration;
    let steepness = slope.x * slope.x + slope.y * slope.y;
    let length = sqrt(1.0 + steepness);
    // avoids a division of zero by zero on level ground, which has no oblique light
    let level = 1e-12;
    var single = 0.0;
    var oblique = 0.0;
    for (var k = 0u; k < 5u; k++) {
        let toward = suns[k];
        let facing = (p.k_sin - p.k_cos * (slope.x * toward.x + slope.y * toward.y)) / length;
        let light = max(facing, 0.0);
        if (k == 0u) {
            single = light * lit;
        } else {
            let across = slope.x * toward.y - slope.y * toward.x;
            oblique += (across * across + level) * light;
        }
    }
    oblique = oblique / (2.0 * steepness + 4.0 * level) * sky;
    out_shade[i] = checked(min(single + (oblique - single) * p.k_oblique, 1.0));
}
