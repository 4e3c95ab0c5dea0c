// Bed and water of cells, also of those one beyond the sides, from the rasters `bed` and `wet` and the `rim`; it needs
// shaders/lib/pipe.

fn lower(height: f32, drop: f32) -> f32 { return select(height - drop, HOLE, is_hole(height)); }

fn bed_in_row(x: i32, y: u32) -> f32 {
    if (x >= 0 && x < i32(p.nx)) {
        return bed[at(u32(x), y)];
    }
    let before = x < 0;
    let side = select(p.side_east, p.side_west, before);
    if (side == SIDE_PERIODIC) {
        return bed[at(select(0u, p.nx - 1u, before), y)];
    }
    if (side == SIDE_WALL) {
        return HOLE;
    }
    if (before) {
        return lower(bed[at(0u, y)], rim[rim_west(y)]);
    }
    return lower(bed[at(p.nx - 1u, y)], rim[rim_east(y)]);
}

fn bed_at(x: i32, y: i32) -> f32 {
    if (y >= 0 && y < i32(p.ny)) {
        return bed_in_row(x, u32(y));
    }
    let before = y < 0;
    let side = select(p.side_south, p.side_north, before);
    if (side == SIDE_PERIODIC) {
        return bed_in_row(x, select(0u, p.ny - 1u, before));
    }
    if (side == SIDE_WALL) {
        return HOLE;
    }
    let column = u32(clamp(x, 0, i32(p.nx) - 1));
    if (before) {
        return lower(bed_in_row(x, 0u), rim[rim_north(column)]);
    }
    return lower(bed_in_row(x, p.ny - 1u), rim[rim_south(column)]);
}

fn wet_in_row(x: i32, y: u32) -> f32 {
    if (x >= 0 && x < i32(p.nx)) {
        return wet[at(u32(x), y)];
    }
    let before = x < 0;
    let side = select(p.side_east, p.side_west, before);
    if (side == SIDE_PERIODIC) {
        return wet[at(select(0u, p.nx - 1u, before), y)];
    }
    if (side == SIDE_OPEN) {
        return wet[at(select(p.nx - 1u, 0u, before), y)];
    }
    return 0.0;
}

fn wet_at(x: i32, y: i32) -> f32 {
    if (y >= 0 && y < i32(p.ny)) {
        return wet_in_row(x, u32(y));
    }
    let before = y < 0;
    let side = select(p.side_south, p.side_north, before);
    if (side == SIDE_PERIODIC) {
        return wet_in_row(x, select(0u, p.ny - 1u, before));
    }
    if (side == SIDE_OPEN) {
        return wet_in_row(x, select(p.ny - 1u, 0u, before));
    }
    return 0.0;
}
