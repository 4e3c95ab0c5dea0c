// Erosion spread over the width of the smallest channel; see crates/nodes/src/erosion/hydraulic_pipe/spread.rs.

/// What is to be spread, `HOLE` where nothing may change, and the bed.
@compute @workgroup_size(64)
fn gather(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let land = read_height(i);
    bed[i] = bed_from(land + change[i]);
    let moves = read_erodibility(i) > 0.0 && !is_held(cell.x, cell.y) && !is_hole(land);
    spread[i] = select(HOLE, taken[i], moves);
}

/// The bed beyond a side: lower than all where water runs out.
fn beyond(side: u32) -> f32 { return select(-HOLE, HOLE, side == SIDE_WALL); }

fn floor_in_row(x: i32, y: u32) -> f32 {
    if (p.side_west != SIDE_PERIODIC && x < 0) {
        return beyond(p.side_west);
    }
    if (p.side_west != SIDE_PERIODIC && x >= i32(p.nx)) {
        return beyond(p.side_east);
    }
    return bed[at(column_of(x), y)];
}

fn floor_at(x: i32, y: i32) -> f32 {
    if (p.side_north != SIDE_PERIODIC && y < 0) {
        return beyond(p.side_north);
    }
    if (p.side_north != SIDE_PERIODIC && y >= i32(p.ny)) {
        return beyond(p.side_south);
    }
    return floor_in_row(x, row_of(y));
}

/// Marks the cells that are no higher than all eight neighbours.
@compute @workgroup_size(64)
fn mark(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let here = bed[i];
    var lowest = HOLE;
    for (var dy = -1; dy <= 1; dy++) {
        for (var dx = -1; dx <= 1; dx++) {
            lowest = min(lowest, floor_at(i32(cell.x) + dx, i32(cell.y) + dy));
        }
    }
    hollow[i] = select(1.0, 0.0, lowest < here && !is_hole(here));
}

/// The cell of a side that stands for one beyond its ends: from the other end, or its mirror image.
fn inside(v: i32, count: u32, joined: bool) -> u32 {
    let n = i32(count);
    let period = select(2 * n, n, joined);
    let place = ((v % period) + period) % period;
    return u32(select(2 * n - 1 - place, place, place < n));
}

/// How much ground moves here from a cell at a distance: not from a hollow.
fn more(here: f32, low: f32, there: f32, low_there: f32) -> f32 {
    let gain = there - here;
    let flows = (gain > 0.0 && low == 0.0) || (gain < 0.0 && low_there == 0.0);
    return select(0.0, gain, flows && !is_hole(there));
}

fn from_cell(here: f32, low: f32, cell: vec2<u32>, dx: i32, dy: i32) -> f32 {
    let x = inside(i32(cell.x) + dx * p.k_distance, p.nx, p.side_west == SIDE_PERIODIC);
    let y = inside(i32(cell.y) + dy * p.k_distance, p.ny, p.side_north == SIDE_PERIODIC);
    let there = at(x, y);
    return more(here, low, spread[there], hollow[there]);
}

@compute @workgroup_size(64)
fn average(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let here = spread[i];
    if (is_hole(here)) {
        next[i] = here;
        return;
    }
    let low = hollow[i];
    let beside = (from_cell(here, low, cell, -1, 0) + from_cell(here, low, cell, 1, 0))
        + (from_cell(here, low, cell, 0, -1) + from_cell(here, low, cell, 0, 1));
    let across = (from_cell(here, low, cell, -1, -1) + from_cell(here, low, cell, 1, 1))
        + (from_cell(here, low, cell, 1, -1) + from_cell(here, low, cell, -1, 1));
    next[i] = here + (0.125 * beside + 0.0625 * across);
}
