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

/// The highest of a value and, if two lines of the length `k_span` cover it, of a line of the disc: that of the row which
/// begins at `row`, at a distance from the cell's own. Beside the west side of the world it is shorter; beside the east
/// side those of `line` are.
fn raised(high: f32, row: u32, x: i32, distance: u32, rows: vec2<u32>) -> f32 {
    if (distance < rows.x || distance > rows.y) {
        return high;
    }
    let half = halves[distance];
    var first = x - half;
    var second = x + half + 1 - p.k_span;
    if (p.k_wraps_x != 0u) {
        first = cell_in_line(first, p.nx, true);
        second = cell_in_line(second, p.nx, true);
    } else {
        first = max(first, 0);
        let length = x + half + 1 - first;
        if (length < p.k_span || length >= 2 * p.k_span) {
            return high;
        }
        second = min(second, i32(p.nx) - 1);
    }
    return higher(line[row + u32(second)], higher(line[row + u32(first)], high));
}

/// Rows of a tile, which an invocation computes together: in each row around them, they read cells beside each other.
const TOGETHER = 4;

@compute @workgroup_size(64)
fn raise(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) own: u32) {
    let x = i32(64u * group.x + own);
    let y = TOGETHER * i32(group.y + p.row);
    if (x >= i32(p.nx)) {
        return;
    }
    // lines that are shorter beside the west side may be of any row of the disc
    var rows = vec2<u32>(p.k_from, p.k_to);
    if (p.k_wraps_x == 0u && i32(64u * group.x) < halves[0]) {
        rows = vec2<u32>(0u, u32(p.k_rows));
    }
    let nearest = i32(rows.x);
    let last = i32(rows.y) + TOGETHER;
    var high = vec4<f32>(-3.4028235e38);
    for (var shift = -i32(rows.y); shift < last; shift++) {
        if (shift > TOGETHER - 1 - nearest && shift < nearest) {
            // rows of longer lines
            shift = nearest;
        }
        let place = cell_in_line(y + shift, p.ny, p.k_wraps_y != 0u);
        if (place < 0) {
            continue;
        }
        let row = at(0u, u32(place));
        high.x = raised(high.x, row, x, u32(abs(shift)), rows);
        high.y = raised(high.y, row, x, u32(abs(shift - 1)), rows);
        high.z = raised(high.z, row, x, u32(abs(shift - 2)), rows);
        high.w = raised(high.w, row, x, u32(abs(shift - 3)), rows);
    }
    put(x, y, high.x);
    put(x, y + 1, high.y);
    put(x, y + 2, high.z);
    put(x, y + 3, high.w);
}

fn put(x: i32, y: i32, high: f32) {
    if (y < i32(p.ny)) {
        let i = at(u32(x), u32(y));
        best[i] = higher(high, best[i]);
    }
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
