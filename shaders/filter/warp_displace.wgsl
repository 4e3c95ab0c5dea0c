// Displacements in cells, by noise or by wired fields, up to the maximum; see crates/nodes/src/filter/warp.rs.

/// The displacement of a cell to the east and the south in metres.
fn displacement_m(cell: vec2<u32>) -> vec2<f32> {
    let place = vec2<u32>(p.left, p.top) + cell;
    var sum = vec2<f32>(0.0);
    switch (p.pattern) {
        case PATTERN_FIELD: {
            let i = at(cell.x, cell.y);
            return vec2<f32>(read_east(i), read_south(i));
        }
        case PATTERN_CURL: {
            for (var k = 0u; k < p.k_count; k++) {
                let noise = sloped_noise(octaves_of[k], BELL, place);
                sum += vec2<f32>(-noise.z, noise.y);
            }
        }
        default: {
            for (var k = 0u; k < p.k_count; k++) {
                sum.x += lattice_noise(octaves_of[k], BELL, place);
                sum.y += lattice_noise(octaves_of[p.k_count + k], BELL, place);
            }
        }
    }
    return sum;
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let away = displacement_m(cell);
    let length = sqrt(away.x * away.x + away.y * away.y);
    let factor = read_mask(i) * (p.displacement / max(length, p.displacement)) * p.k_per_cell;
    to_east[i] = away.x * factor;
    to_south[i] = away.y * factor;
}
