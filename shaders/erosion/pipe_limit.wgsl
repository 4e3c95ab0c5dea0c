// Discharge limited to the water that cells can supply; see crates/nodes/src/erosion/hydraulic_pipe/flow.rs.

/// The fraction of its outflow that each cell can supply.
@compute @workgroup_size(64)
fn supply(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let to_east = west_at(cell.x + 1u, cell.y);
    let to_south = north_at(cell.x, cell.y + 1u);
    let out = (positive(to_east) + positive(-west[i])) + (positive(to_south) + positive(-north[i]));
    let out_m = out * p.k_step;
    let most_m = wet[i] * (1.0 - 1e-5);
    share[i] = select(1.0, most_m * inverse(out_m), out_m > max(most_m, 1e-30));
}

/// The share of a cell, of the nearest beyond the sides to the west and the east, and all beyond the others.
fn share_at(x: i32, y: i32) -> f32 {
    if (p.side_north != SIDE_PERIODIC && (y < 0 || y >= i32(p.ny))) {
        return 1.0;
    }
    return share[at(column_of(x), row_of(y))];
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let x = i32(cell.x);
    let y = i32(cell.y);
    let own = share[i];
    west[i] = limited(west[i], share_at(x - 1, y), own);
    north[i] = limited(north[i], share_at(x, y - 1), own);
    if (cell.x + 1u == p.nx) {
        rim[face_east(cell.y)] = limited(rim[face_east(cell.y)], own, share_at(x + 1, y));
    }
    if (cell.y + 1u == p.ny) {
        rim[face_south(cell.x)] = limited(rim[face_south(cell.x)], own, share_at(x, y + 1));
    }
}
