// Fluxes of ice through the faces of one direction, and how they change with the thickness on either side; see
// crates/nodes/src/erosion/glacial/kernels.rs. It needs shaders/lib/ice.

/// How far the surface of a cell is above that of another, from differences that keep their digits on high ground.
fn drop_of(a: u32, b: u32) -> f32 { return (bed[a] - bed[b]) + (thickness[a] - thickness[b]); }

/// The same, at most the thickness of the higher cell.
fn limited(a: u32, b: u32) -> f32 { return max(min(drop_of(a, b), thickness[a]), -thickness[b]); }

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let spot = cell_of(id);
    let columns = p.k_columns != 0u;
    let count = vec2<u32>(p.k_nx, p.k_ny) + select(vec2<u32>(1u, 0u), vec2<u32>(0u, 1u), columns);
    if (spot.x >= count.x || spot.y >= count.y) {
        return;
    }
    let place = select(west_of(spot.x, spot.y), north_of(spot.x, spot.y), columns);
    flux[place] = 0.0;
    gain[place] = 0.0;
    loss[place] = 0.0;
    let after = padded(spot.x, spot.y);
    let step = select(1u, stride(), columns);
    let before = after - step;
    let along = select(spot.x, spot.y, columns);
    let cells = select(p.k_nx, p.k_ny, columns);
    let is_first = along == 0u;
    let is_last = along == cells;
    let side = side_of(columns, is_last);
    let is_border = is_first || is_last;
    if ((thickness[before] <= 0.0 && thickness[after] <= 0.0) || (is_border && side == SIDE_WALL)) {
        return;
    }
    let drop = drop_of(before, after);
    let forward = drop > 0.0;
    let up = thickness[select(after, before, forward)];
    let down = thickness[select(before, after, forward)];
    let behind = thickness[select(after + step, before - step, forward)];
    let rise = up - behind;
    let fall = down - up;
    let product = rise * fall;
    var slope = 0.0;
    if (product > 0.0) {
        slope = product / (rise + fall);
    }
    let depth = max(up + slope, 0.0);
    if (depth <= 0.0) {
        return;
    }
    let inverse = 1.0 / select(p.k_dx, p.k_dy, columns);
    let cross = select(stride(), 1u, columns);
    let half = 0.5 / select(p.k_dy, p.k_dx, columns);
    let tilt = 0.5 * half * ((limited(before - cross, before) + limited(before, before + cross))
        + (limited(after - cross, after) + limited(after, after + cross)));
    let normal = drop * inverse;
    let own = normal * normal;
    var square = own + tilt * tilt;
    let squared = depth * depth;
    let yields = squared * square > p.k_yield * p.k_yield;
    if (yields) {
        square = p.k_yield * p.k_yield / squared;
    }
    let shear = p.k_deformation * depth;
    let conductance = squared * squared * (shear + p.k_sliding);
    let diffusivity = conductance * square;
    let growth = select(2.0 * own * conductance, 0.0, yields);
    let powers = select(5.0 * shear + 4.0 * p.k_sliding, 3.0 * shear + 2.0 * p.k_sliding, yields);
    let stiff = (diffusivity + growth) * inverse;
    let wave = powers * squared * depth * square * abs(normal);
    flux[place] = diffusivity * normal;
    var gains = stiff + select(0.0, wave, forward);
    var losses = stiff + select(wave, 0.0, forward);
    if (is_border && side == SIDE_OPEN) {
        // what lies beyond rises and falls with the border, so that only what follows from thickness stays
        let more = select(-wave, wave, forward);
        gains = max(more, 0.0);
        losses = max(-more, 0.0);
    }
    // two cells that are joined twice have no tridiagonal system
    if (side_of(columns, false) == SIDE_PERIODIC && cells < 3u) {
        gains = 0.0;
        losses = 0.0;
    }
    gain[place] = gains;
    loss[place] = losses;
}
