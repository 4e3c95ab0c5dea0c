// What a step changes of the thickness of ice; see crates/nodes/src/erosion/glacial/sheet.rs. It needs shaders/lib/ice.

/// A cell that would give so much more than it has and gets is overdrawn: in metres, and as a share of all that it has,
/// gets and gives, of which rounding gives less.
const OVERDRAWN_M: f32 = 1e-5;
const OVERDRAWN: f32 = 4e-7;

var<workgroup> most: atomic<u32>;
var<workgroup> overdrawn: atomic<u32>;

/// Thickness that leaves a cell through its faces in the step, net.
fn outflow(i: u32, j: u32) -> f32 {
    return p.k_over_x * (east[west_of(i + 1u, j)] - east[west_of(i, j)])
        + p.k_over_y * (south[north_of(i, j + 1u)] - south[north_of(i, j)]);
}

/// What the fluxes and the balance would add; no more melts than there is.
@compute @workgroup_size(64)
fn begin(@builtin(global_invocation_id) id: vec3<u32>) {
    let spot = cell_of(id);
    if (is_beyond(spot)) {
        return;
    }
    let cell = inside(spot);
    let out = outflow(spot.x, spot.y);
    let gains = p.k_dt * max(balance[cell], 0.0);
    let melts = -p.k_dt * min(balance[cell], 0.0);
    let has = max(thickness[padded(spot.x, spot.y)] + gains - out, 0.0);
    delta[cell] = gains - out - min(has, melts);
}

/// The thickness that the fluxes and the balance give, the greatest change, and whether a cell is overdrawn.
@compute @workgroup_size(64)
fn apply(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) own: u32) {
    let spot = cell_of(id);
    if (!is_beyond(spot)) {
        let cell = inside(spot);
        let depth = thickness[padded(spot.x, spot.y)];
        let flowed = depth - outflow(spot.x, spot.y) + p.k_dt * max(balance[cell], 0.0);
        let stays = max(max(flowed, 0.0) + p.k_dt * min(balance[cell], 0.0), 0.0);
        next[cell] = stays;
        atomicMax(&most, bitcast<u32>(abs(stays - depth)));
        let passes = p.k_over_x * (abs(east[west_of(spot.x + 1u, spot.y)]) + abs(east[west_of(spot.x, spot.y)]))
            + p.k_over_y * (abs(south[north_of(spot.x, spot.y + 1u)]) + abs(south[north_of(spot.x, spot.y)]));
        if (flowed < -(OVERDRAWN_M + OVERDRAWN * (depth + passes))) {
            atomicStore(&overdrawn, 1u);
        }
    }
    workgroupBarrier();
    if (own == 0u) {
        atomicMax(&found[0], atomicLoad(&most));
        atomicMax(&found[1], atomicLoad(&overdrawn));
    }
}

/// The share that an overdrawn cell gives of what its fluxes take: what it has and gets, for the last time what it has.
@compute @workgroup_size(64)
fn limit(@builtin(global_invocation_id) id: vec3<u32>) {
    let spot = cell_of(id);
    if (is_beyond(spot)) {
        return;
    }
    let cell = inside(spot);
    let through = vec4<f32>(
        -p.k_over_x * east[west_of(spot.x, spot.y)],
        p.k_over_x * east[west_of(spot.x + 1u, spot.y)],
        -p.k_over_y * south[north_of(spot.x, spot.y)],
        p.k_over_y * south[north_of(spot.x, spot.y + 1u)],
    );
    let gives = max(through, vec4<f32>());
    let gets = max(-through, vec4<f32>());
    let out = (gives.x + gives.y) + (gives.z + gives.w);
    var has = thickness[padded(spot.x, spot.y)] + p.k_dt * max(balance[cell], 0.0);
    if (p.k_last == 0u) {
        has += (gets.x + gets.y) + (gets.z + gets.w);
    }
    var share = 1.0;
    if (out > has) {
        share = max(has, 0.0) / out;
    }
    delta[cell] = share;
}

/// The share of the cell that gives ice through a face.
fn share_of(flux: f32, k: u32, cells: u32, is_joined: bool, first: u32, step: u32) -> f32 {
    if (flux > 0.0) {
        if (k == 0u && !is_joined) {
            return 1.0;
        }
        return delta[first + step * select(k - 1u, cells - 1u, k == 0u)];
    }
    if (k == cells && !is_joined) {
        return 1.0;
    }
    return delta[first + step * select(k, 0u, k == cells)];
}

/// Reduces fluxes to these shares.
@compute @workgroup_size(64)
fn give(@builtin(global_invocation_id) id: vec3<u32>) {
    let spot = cell_of(id);
    if (spot.x <= p.k_nx && spot.y < p.k_ny) {
        let face = west_of(spot.x, spot.y);
        let is_joined = p.side_west == SIDE_PERIODIC;
        east[face] *= share_of(east[face], spot.x, p.k_nx, is_joined, spot.y * p.k_nx, 1u);
    }
    if (spot.x < p.k_nx && spot.y <= p.k_ny) {
        let face = north_of(spot.x, spot.y);
        let is_joined = p.side_north == SIDE_PERIODIC;
        south[face] *= share_of(south[face], spot.y, p.k_ny, is_joined, spot.x, p.k_nx);
    }
}
