// The tangent of the horizon's elevation angle in one direction; see crates/nodes/src/numerics/horizon. It needs
// shaders/lib/lines.

/// A sample along the direction: two adjacent cells of one of the bound rasters, and the position between them.
struct Look {
    land: u32,
    first_x: i32,
    first_y: i32,
    second_x: i32,
    second_y: i32,
    share: f32,
    per_m: f32,
}

fn land_at(land: u32, i: u32) -> f32 {
    switch (land) {
        case 0u: { return land_0[i]; }
        case 1u: { return land_1[i]; }
        case 2u: { return land_2[i]; }
        default: { return land_3[i]; }
    }
}

@compute @workgroup_size(64)
fn look(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let x = i32(cell.x);
    let y = i32(cell.y);
    let here = read_height(i);
    var tangent = 0.0;
    if (p.k_goes_on != 0u) {
        tangent = tangents[i];
    }
    for (var k = p.k_first; k < p.k_end; k++) {
        let look = looks[k];
        let first_x = cell_in_line(x + look.first_x, p.nx, p.k_wraps_x != 0u);
        let first_y = cell_in_line(y + look.first_y, p.ny, p.k_wraps_y != 0u);
        let second_x = cell_in_line(x + look.second_x, p.nx, p.k_wraps_x != 0u);
        let second_y = cell_in_line(y + look.second_y, p.ny, p.k_wraps_y != 0u);
        if (min(min(first_x, first_y), min(second_x, second_y)) < 0) {
            continue;
        }
        let first = land_at(look.land, at(u32(first_x), u32(first_y)));
        let second = land_at(look.land, at(u32(second_x), u32(second_y)));
        let height = first + (second - first) * look.share;
        tangent = max(tangent, min((height - here) * look.per_m, p.k_steepest));
    }
    tangents[i] = tangent;
}
