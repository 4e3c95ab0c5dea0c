// The distance to the nearest selected cell, in whole numbers; see crates/nodes/src/select/distance.rs. `column` has
// the distance along the column in cells, `squared` and `other` that in the plane.

const FAR: u32 = 0xffffffffu;

@compute @workgroup_size(64)
fn begin(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let is_selected = read_selection(i) >= p.k_threshold;
    column[i] = select(FAR, 0u, is_selected == (p.k_side != 0u));
}

fn reached(x: u32, y: i32) -> u32 {
    let row = cell_in_line(y, p.ny, p.k_wraps_y != 0u);
    if (row < 0) {
        return FAR;
    }
    let found = column[at(x, u32(row))];
    return select(found + p.k_step, FAR, found >= FAR - p.k_step);
}

/// One power of two in the distance along the column.
@compute @workgroup_size(64)
fn step_on(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let y = i32(cell.y);
    let by = i32(p.k_step);
    next[i] = min(column[i], min(reached(cell.x, y - by), reached(cell.x, y + by)));
}

/// The square of the distance through a column of the row.
fn through(x: i32, y: u32, square: u32) -> u32 {
    let place = cell_in_line(x, p.nx, p.k_wraps_x != 0u);
    if (place < 0) {
        return FAR;
    }
    let along = column[at(u32(place), y)];
    if (along > p.k_limit) {
        return FAR;
    }
    let sum = along * along + square;
    return select(sum, FAR, sum < square);
}

@compute @workgroup_size(64)
fn across(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let x = i32(cell.x);
    var best = through(x, cell.y, 0u);
    for (var k = 1u; k <= min(p.k_limit, p.k_widest); k++) {
        let square = k * k;
        if (square >= best) {
            break;
        }
        best = min(best, min(through(x - i32(k), cell.y, square), through(x + i32(k), cell.y, square)));
    }
    squared[at(cell.x, cell.y)] = select(best, FAR, best > p.k_limit * p.k_limit);
}

fn metres(square: u32) -> f32 {
    if (square == 0u) {
        return 0.0;
    }
    if (square == FAR) {
        return p.limit;
    }
    return min((sqrt(f32(square)) - 0.5) * p.cell_m, p.limit);
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    var distance = 0.0;
    var share = 0.0;
    if (p.side == SIDE_OUTSIDE) {
        distance = metres(squared[i]);
        share = 1.0 - distance / p.limit;
    } else if (p.side == SIDE_INSIDE) {
        distance = -metres(other[i]);
        share = 1.0 + distance / p.limit;
    } else {
        distance = metres(squared[i]) - metres(other[i]);
        share = 0.5 - 0.5 * distance / p.limit;
    }
    if (p.wants_distance != 0u) {
        out_distance[i] = checked(distance);
    }
    if (p.wants_mask != 0u) {
        out_mask[i] = checked(smooth_step(share));
    }
}
