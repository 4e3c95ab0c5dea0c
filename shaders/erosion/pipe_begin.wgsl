// The start of a storm; see crates/nodes/src/erosion/hydraulic_pipe/device.rs.

/// By how much the land beyond a side is lower than the cell at it.
fn drop_from(near: f32, second: f32) -> f32 {
    let drop = second - near;
    let slight = 1e-3 * p.cell_m;
    return select(slight, drop, drop > slight);
}

fn land_at(x: u32, y: u32) -> f32 { return read_height(at(x, y)); }

/// Notes by how much the land beyond the sides is lower than that of a cell at them.
fn fall_at_sides(cell: vec2<u32>, land: f32) {
    if (cell.x == 0u) {
        rim[rim_west(cell.y)] = drop_from(land, land_at(min(1u, p.nx - 1u), cell.y));
    }
    if (cell.x + 1u == p.nx) {
        rim[rim_east(cell.y)] = drop_from(land, land_at(max(p.nx, 2u) - 2u, cell.y));
    }
    if (cell.y == 0u) {
        rim[rim_north(cell.x)] = drop_from(land, land_at(cell.x, min(1u, p.ny - 1u)));
    }
    if (cell.y + 1u == p.ny) {
        rim[rim_south(cell.x)] = drop_from(land, land_at(cell.x, max(p.ny, 2u) - 2u));
    }
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let place = cell.y * p.nx + cell.x;
    let land = read_height(i);
    loose[i] = positive(read_regolith(i));
    var fall = positive(read_rain(i));
    if (p.k_springs != 0u) {
        fall += spring[place];
    }
    rain_of[i] = select(fall, 0.0, is_hole(land));
    var depth = 0.0;
    if (p.k_warm != 0u) {
        depth = warm[place];
    }
    water[i] = depth;
    fall_at_sides(cell, land);
}

/// The sides alone, after strokes have changed the land.
@compute @workgroup_size(64)
fn sides(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    fall_at_sides(cell, land_at(cell.x, cell.y));
}
