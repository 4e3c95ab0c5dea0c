// Between the grids of crates/nodes/src/numerics/repose (`pyramid`): means of 2 x 2 cells, and gains of coarse cells for
// finer ones. `k_wide` and `k_high` are those of the coarse grid. It needs shaders/lib/lines and shaders/lib/repose.

fn is_beyond(cell: vec2<u32>) -> bool { return cell.x >= p.k_wide || cell.y >= p.k_high; }

fn coarse_place(cell: vec2<u32>) -> u32 { return cell.y * p.k_wide + cell.x; }

/// The place of the north-western of the four fine cells of a coarse one.
fn fine_place(cell: vec2<u32>) -> u32 { return 4u * cell.y * p.k_wide + 2u * cell.x; }

/// Ground and rise at repose, the latter over twice the distance.
@compute @workgroup_size(64)
fn average_land(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_beyond(cell)) {
        return;
    }
    let first = fine_place(cell);
    let second = first + 2u * p.k_wide;
    let mean = 0.25 * ((land[first] + land[first + 1u]) + (land[second] + land[second + 1u]));
    coarse_land[coarse_place(cell)] = vec2<f32>(mean.x, 2.0 * mean.y);
}

/// Thicknesses of loose layers, or gains, of which a copy is kept.
@compute @workgroup_size(64)
fn average(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_beyond(cell)) {
        return;
    }
    let first = fine_place(cell);
    let second = first + 2u * p.k_wide;
    var mean = 0.25 * ((fine[first] + fine[first + 1u]) + (fine[second] + fine[second + 1u]));
    if (p.k_keeps != 0u) {
        if (p.k_quantum > 0.0) {
            mean = floor(mean / p.k_quantum) * p.k_quantum;
        }
        before[coarse_place(cell)] = mean;
    }
    coarse[coarse_place(cell)] = mean;
}

/// The neighbour of a coarse cell, or the cell itself if that is closed.
fn beside(cell: vec2<u32>, step: vec2<i32>) -> u32 {
    let i = cell_in_line(i32(cell.x) + step.x, p.k_wide, p.k_wraps_x != 0u);
    let j = cell_in_line(i32(cell.y) + step.y, p.k_high, p.k_wraps_y != 0u);
    let own = coarse_place(cell);
    if (i < 0 || j < 0) {
        return own;
    }
    let place = u32(j) * p.k_wide + u32(i);
    return select(place, own, coarse_land[place].y > SHUT);
}

fn gain(place: u32) -> f32 { return coarse[place] - before[place]; }

fn surface(place: u32) -> f32 { return coarse_land[place].x + coarse[place]; }

/// Heights on a plane through the middle of four cells: north-west, north-east, south-west, south-east.
fn tilted(tilt: vec2<f32>) -> vec4<f32> {
    return vec4<f32>(-tilt.x - tilt.y, tilt.x - tilt.y, tilt.y - tilt.x, tilt.x + tilt.y);
}

/// Changes gains so that no cell loses more than its layer; they become multiples of the quantum, with that sum.
fn given_by_what_is_there(gains: vec4<f32>, layers: vec4<f32>, sum: f32) -> vec4<f32> {
    var left = layers + gains;
    if (any(left < vec4<f32>(0.0))) {
        let present = max(left, vec4<f32>(0.0));
        let total = ((present.x + present.y) + present.z) + present.w;
        let rest = max(((left.x + left.y) + left.z) + left.w, 0.0);
        left = vec4<f32>(0.0);
        if (total > 0.0) {
            left = present * (rest / total);
        }
    }
    var after = ceil((left - layers) / p.k_quantum) * p.k_quantum;
    var thickest = 0u;
    for (var k = 1u; k < 4u; k++) {
        if (left[k] > left[thickest]) {
            thickest = k;
        }
    }
    after[thickest] = 0.0;
    after[thickest] = sum - (((after.x + after.y) + after.z) + after.w);
    return after;
}

@compute @workgroup_size(64)
fn prolong(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_beyond(cell)) {
        return;
    }
    let own_place = coarse_place(cell);
    let own = gain(own_place);
    if (own == 0.0) {
        return;
    }
    let west = beside(cell, vec2<i32>(-1, 0));
    let east = beside(cell, vec2<i32>(1, 0));
    let north = beside(cell, vec2<i32>(0, -1));
    let south = beside(cell, vec2<i32>(0, 1));
    let first = fine_place(cell);
    let second = first + 2u * p.k_wide;
    let had = vec4<f32>(moved[first], moved[first + 1u], moved[second], moved[second + 1u]);
    // an eighth of the difference over two coarse cells
    let lean = 0.125 * vec2<f32>(gain(east) - gain(west), gain(south) - gain(north));
    let most = max(abs(lean.x) + abs(lean.y), 1.17549435e-38);
    let gains = own + tilted(min(abs(own) / most, 1.0) * lean);
    let a = land[first];
    let b = land[first + 1u];
    let c = land[second];
    let d = land[second + 1u];
    let heights = vec4<f32>(a.x, b.x, c.x, d.x) + (had + gains);
    let repose = 0.25 * (((a.y + b.y) + c.y) + d.y);
    let rises = vec4<f32>(heights.y - heights.x, heights.w - heights.z, heights.z - heights.x, heights.w - heights.y);
    let slope = 0.5 * vec2<f32>(rises.x + rises.y, rises.z + rises.w);
    let sides = max(max(abs(rises.x), abs(rises.y)), max(abs(rises.z), abs(rises.w)));
    let steepest = max(sqrt(slope.x * slope.x + slope.y * slope.y), sides);
    var settled = vec4<f32>(0.0);
    if (steepest > repose) {
        let kept = repose / steepest;
        let leaning = 0.125 * vec2<f32>(surface(east) - surface(west), surface(south) - surface(north));
        let mean = 0.25 * ((heights.x + heights.y) + (heights.z + heights.w));
        settled = tilted(leaning * (1.0 - kept)) - (1.0 - kept * kept) * (heights - mean);
    }
    var after = had + gains + settled;
    if (p.k_quantum > 0.0) {
        let sum = 4.0 * own + (((had.x + had.y) + had.z) + had.w);
        let layers = vec4<f32>(loose[first], loose[first + 1u], loose[second], loose[second + 1u]);
        after = given_by_what_is_there(after, layers, sum);
    }
    moved[first] = after.x;
    moved[first + 1u] = after.y;
    moved[second] = after.z;
    moved[second + 1u] = after.w;
}
