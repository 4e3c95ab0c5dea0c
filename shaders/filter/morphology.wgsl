// The highest value within a disc, and what follows from it; see crates/nodes/src/filter/morphology.rs. `line` has the
// highest value of `k_span` cells from each eastward; the lowest is the highest of the values turned by a sign.

@compute @workgroup_size(64)
fn begin(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let value = before[i] * p.k_sign;
    line[i] = value;
    best[i] = value;
}

fn higher(a: f32, b: f32) -> f32 { return select(b, a, a > b); }

/// The value of `line` at a column inside the row, or beyond its ends in a world that wraps.
fn line_at(x: i32, y: u32) -> f32 { return line[at(u32(cell_in_line(x, p.nx, true)), y)]; }

/// Lines of the disc that two of the length `k_span` cover. Beside the sides of the world they are shorter.
@compute @workgroup_size(64)
fn raise(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let x = i32(cell.x);
    var high = best[at(cell.x, cell.y)];
    for (var shift = -p.k_rows; shift <= p.k_rows; shift++) {
        let half = halves[abs(shift)];
        var first = x - half;
        var last = x + half;
        let row = cell_in_line(i32(cell.y) + shift, p.ny, p.k_wraps_y != 0u);
        if (p.k_wraps_x == 0u) {
            first = max(first, 0);
            last = min(last, i32(p.nx) - 1);
        }
        let length = last - first + 1;
        if (row < 0 || length < p.k_span || length >= 2 * p.k_span) {
            continue;
        }
        high = higher(line_at(first, u32(row)), high);
        high = higher(line_at(last + 1 - p.k_span, u32(row)), high);
    }
    best[at(cell.x, cell.y)] = high;
}

@compute @workgroup_size(64)
fn double(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let beyond = cell_in_line(i32(cell.x) + p.k_span, p.nx, p.k_wraps_x != 0u);
    var high = line[i];
    if (beyond >= 0) {
        high = higher(line[at(u32(beyond), cell.y)], high);
    }
    next[i] = high;
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let value = read_value(i);
    var result = before[i] * p.k_sign;
    if (p.operation == OPERATION_OUTLINE) {
        // the lowest values are those of `best`, turned
        result = result + best[i];
    } else if (p.operation == OPERATION_TOP_HAT) {
        result = value - result;
    } else if (p.operation == OPERATION_BOTTOM_HAT) {
        result = result - value;
    }
    out_value[i] = checked(masked(value, result, read_mask(i)));
}
