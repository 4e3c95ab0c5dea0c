// What was eroded is replaced by what was spread, and loose ground slides; see
// crates/nodes/src/erosion/hydraulic_pipe/slip.rs.

@compute @workgroup_size(64)
fn replace(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let amount = spread[i];
    let back = select(taken[i] - amount, 0.0, is_hole(amount));
    change[i] += back;
    loose[i] = positive(loose[i] + back);
    taken[i] = 0.0;
}

/// The bed, `HOLE` where nothing slides.
@compute @workgroup_size(64)
fn level(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    bed[i] = select(bed_from(read_height(i) + change[i]), HOLE, is_held(cell.x, cell.y));
}

fn ground(x: i32, y: i32) -> f32 {
    let beyond_x = p.side_west != SIDE_PERIODIC && (x < 0 || x >= i32(p.nx));
    let beyond_y = p.side_north != SIDE_PERIODIC && (y < 0 || y >= i32(p.ny));
    if (beyond_x || beyond_y) {
        return HOLE;
    }
    return bed[at(column_of(x), row_of(y))];
}

/// What slides from one cell to another in a pass, negative the other way.
fn slide(a: f32, b: f32, is_diagonal: bool) -> f32 {
    let fall = a - b;
    let excess = abs(fall) - select(p.k_talus, p.k_talus_diagonal, is_diagonal);
    let rate = select(1.0 / 12.0, 0.5 / 12.0, is_diagonal);
    let moved = select(0.0, rate * excess, excess > 0.0);
    return select(select(-moved, moved, fall > 0.0), 0.0, is_hole(a) || is_hole(b));
}

/// What slides from a cell to each neighbour: east, west, south, north, south-east, south-west, north-west, north-east.
fn fluxes(cell: vec2<u32>) -> array<f32, 8> {
    let x = i32(cell.x);
    let y = i32(cell.y);
    let here = ground(x, y);
    return array<f32, 8>(
        slide(here, ground(x + 1, y), false), slide(here, ground(x - 1, y), false),
        slide(here, ground(x, y + 1), false), slide(here, ground(x, y - 1), false),
        slide(here, ground(x + 1, y + 1), true), slide(here, ground(x - 1, y + 1), true),
        slide(here, ground(x - 1, y - 1), true), slide(here, ground(x + 1, y - 1), true),
    );
}

fn sum(flux: array<f32, 8>, sign: f32) -> f32 {
    let a = positive(sign * flux[0]) + positive(sign * flux[1]);
    let b = positive(sign * flux[2]) + positive(sign * flux[3]);
    let c = positive(sign * flux[4]) + positive(sign * flux[5]);
    return (a + b) + (c + (positive(sign * flux[6]) + positive(sign * flux[7])));
}

/// The fraction of a cell's outgoing flux that is loose.
@compute @workgroup_size(64)
fn supply(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let out = sum(fluxes(cell), 1.0);
    let lying = loose[i];
    var fraction = 1.0;
    if (out > lying) {
        fraction = lying / out;
    }
    share[i] = fraction;
}

fn share_of(x: i32, y: i32) -> f32 { return share[at(column_of(x), row_of(y))]; }

@compute @workgroup_size(64)
fn apply(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let x = i32(cell.x);
    let y = i32(cell.y);
    let own = share[i];
    let flux = fluxes(cell);
    let bounded = array<f32, 8>(
        limited(flux[0], own, share_of(x + 1, y)), limited(flux[1], own, share_of(x - 1, y)),
        limited(flux[2], own, share_of(x, y + 1)), limited(flux[3], own, share_of(x, y - 1)),
        limited(flux[4], own, share_of(x + 1, y + 1)), limited(flux[5], own, share_of(x - 1, y + 1)),
        limited(flux[6], own, share_of(x - 1, y - 1)), limited(flux[7], own, share_of(x + 1, y - 1)),
    );
    let gain = sum(bounded, -1.0) - sum(bounded, 1.0);
    change[i] += gain;
    loose[i] = positive(loose[i] + gain);
}
