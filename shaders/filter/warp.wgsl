// Values at displacements in cells; see crates/nodes/src/filter/warp.rs.

/// The weighted sum of four values, within the two in the middle.
fn between(v: vec4<f32>, weights: vec4<f32>) -> f32 {
    let sum = (v.x * weights.x + v.y * weights.y) + (v.z * weights.z + v.w * weights.w);
    return min(max(sum, min(v.y, v.z)), max(v.y, v.z));
}

/// Whether terrain folds over itself: the Jacobian determinant of the place and its displacement is not above 0.
fn folds_at(cell: vec2<u32>) -> bool {
    if (cell.x == 0u || cell.y == 0u || cell.x + 1u >= p.nx || cell.y + 1u >= p.ny) {
        return false;
    }
    let west = at(cell.x - 1u, cell.y);
    let north = at(cell.x, cell.y - 1u);
    let south = at(cell.x, cell.y + 1u);
    let east_x = 0.5 * (to_east[west + 2u] - to_east[west]);
    let east_y = 0.5 * (to_east[south] - to_east[north]);
    let south_x = 0.5 * (to_south[west + 2u] - to_south[west]);
    let south_y = 0.5 * (to_south[south] - to_south[north]);
    return (1.0 + east_x) * (1.0 + south_y) - east_y * south_x <= 0.0;
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let away = vec2<f32>(to_east[i], to_south[i]);
    let whole = floor(away);
    let first = vec2<i32>(cell) + vec2<i32>(whole) - vec2<i32>(1);
    let across = catmull_rom(away.x - whole.x);
    var columns = vec4<u32>(0u);
    for (var k = 0; k < 4; k++) {
        columns[k] = line_index(first.x + k, p.nx, p.k_wraps_x != 0u);
    }
    var along = vec4<f32>(0.0);
    for (var k = 0; k < 4; k++) {
        let row = line_index(first.y + k, p.ny, p.k_wraps_y != 0u);
        let v = vec4<f32>(
            read_value(at(columns.x, row)), read_value(at(columns.y, row)),
            read_value(at(columns.z, row)), read_value(at(columns.w, row)),
        );
        along[k] = between(v, across);
    }
    out_value[i] = checked(between(along, catmull_rom(away.y - whole.y)));
    if (folds_at(cell)) {
        atomicAdd(&folds[0], 1u);
    }
}
