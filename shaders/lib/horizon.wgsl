// The tangent of the horizon's elevation angle in one direction; see crates/nodes/src/numerics/horizon. It needs
// shaders/lib/lines.

/// A sample along the direction: the distances to columns and rows of two adjacent cells of one of the bound rasters,
/// and the position between them.
struct Look {
    cells: vec4<i32>,
    share: f32,
    per_m: f32,
    land: u32,
    unused: u32,
}

fn land_at(land: u32, i: u32) -> f32 {
    switch (land) {
        case 0u: { return land_0[i]; }
        case 1u: { return land_1[i]; }
        case 2u: { return land_2[i]; }
        default: { return land_3[i]; }
    }
}

/// The tangent of a sample, at most `k_steepest`; 0 beyond the sides of the world.
fn tangent_of(look: Look, cell: vec4<i32>, here: f32) -> f32 {
    let size = vec4<u32>(p.nx, p.ny, p.nx, p.ny);
    var cells = cell + look.cells;
    if (!all(vec4<u32>(cells) < size)) {
        cells.x = cell_in_line(cells.x, p.nx, p.k_wraps_x != 0u);
        cells.y = cell_in_line(cells.y, p.ny, p.k_wraps_y != 0u);
        cells.z = cell_in_line(cells.z, p.nx, p.k_wraps_x != 0u);
        cells.w = cell_in_line(cells.w, p.ny, p.k_wraps_y != 0u);
        if (any(cells < vec4<i32>())) {
            return 0.0;
        }
    }
    let places = vec4<u32>(cells);
    let first = land_at(look.land, at(places.x, places.y));
    let second = land_at(look.land, at(places.z, places.w));
    return min((first + (second - first) * look.share - here) * look.per_m, p.k_steepest);
}

@compute @workgroup_size(64)
fn look(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let around = vec4<i32>(vec4<u32>(cell, cell));
    let here = read_height(i);
    var tangent = 0.0;
    if (p.k_goes_on != 0u) {
        tangent = tangents[i];
    }
    // two at a time, whose cells do not wait for each other; the last may come twice
    let last = p.k_end - 1u;
    for (var k = p.k_first; k <= last; k += 2u) {
        let one = tangent_of(looks[k], around, here);
        let other = tangent_of(looks[min(k + 1u, last)], around, here);
        tangent = max(tangent, max(one, other));
    }
    tangents[i] = tangent;
}
