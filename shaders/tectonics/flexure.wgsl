// The plate of crates/nodes/src/tectonics/flexure.rs in single precision: means of the load on coarser cells, by halves; a
// convolution of a square grid, whose real and imaginary parts are exchanged for the transform back; a cubic interpolation.

/// Whether there is a finer cell, of `k_wide` columns and `k_high` rows; beyond them the load is 0.
fn is_inside(spot: vec2<u32>) -> bool { return spot.x < p.k_wide && spot.y < p.k_high; }

fn load_at(spot: vec2<u32>) -> f32 {
    if (is_inside(spot)) {
        return read_load(at(spot.x, spot.y));
    }
    return 0.0;
}

fn mean_at(spot: vec2<u32>) -> f32 {
    if (is_inside(spot)) {
        return fine[spot.y * p.k_wide + spot.x];
    }
    return 0.0;
}

fn is_beyond_halves(spot: vec2<u32>) -> bool { return 2u * spot.x >= p.k_wide || 2u * spot.y >= p.k_high; }

fn index_of_half(spot: vec2<u32>) -> u32 { return spot.y * ((p.k_wide + 1u) / 2u) + spot.x; }

@compute @workgroup_size(64)
fn halve_load(@builtin(global_invocation_id) id: vec3<u32>) {
    let spot = cell_of(id);
    if (is_beyond_halves(spot)) {
        return;
    }
    let a = 2u * spot;
    let above = load_at(a) + load_at(a + vec2<u32>(1u, 0u));
    let below = load_at(a + vec2<u32>(0u, 1u)) + load_at(a + vec2<u32>(1u, 1u));
    means[index_of_half(spot)] = 0.25 * (above + below);
}

@compute @workgroup_size(64)
fn halve_means(@builtin(global_invocation_id) id: vec3<u32>) {
    let spot = cell_of(id);
    if (is_beyond_halves(spot)) {
        return;
    }
    let a = 2u * spot;
    let above = mean_at(a) + mean_at(a + vec2<u32>(1u, 0u));
    let below = mean_at(a + vec2<u32>(0u, 1u)) + mean_at(a + vec2<u32>(1u, 1u));
    means[index_of_half(spot)] = 0.25 * (above + below);
}

/// The load in the corner of a grid of zeros.
@compute @workgroup_size(64)
fn place_load(@builtin(global_invocation_id) id: vec3<u32>) {
    let spot = cell_of(id);
    if (spot.x < p.k_side && spot.y < p.k_side) {
        grid[spot.y * p.k_side + spot.x] = vec2<f32>(load_at(spot), 0.0);
    }
}

@compute @workgroup_size(64)
fn place_means(@builtin(global_invocation_id) id: vec3<u32>) {
    let spot = cell_of(id);
    if (spot.x < p.k_side && spot.y < p.k_side) {
        grid[spot.y * p.k_side + spot.x] = vec2<f32>(mean_at(spot), 0.0);
    }
}

/// Waves across the grid of a place of a transform.
fn waves(place: u32) -> f32 {
    return select(f32(place), f32(place) - f32(p.k_side), place > p.k_side / 2u);
}

@compute @workgroup_size(64)
fn respond(@builtin(global_invocation_id) id: vec3<u32>) {
    let spot = cell_of(id);
    if (spot.x >= p.k_side || spot.y >= p.k_side) {
        return;
    }
    let m = waves(spot.x);
    let n = waves(spot.y);
    // the square root of the stiffness over the restoring force
    let stiff = min((m * m + n * n) * p.k_stiff, 1e18);
    let i = spot.y * p.k_side + spot.x;
    grid[i] = grid[i].yx * (p.k_local / (1.0 + stiff * stiff));
}

/// The first of four neighbours on the grid, which wraps, and the way from the second to the third.
struct Taps {
    first: u32,
    t: f32,
}

fn taps(cell: u32) -> Taps {
    let whole = 2u * p.k_coarser;
    // twice the way from the centre of the first coarse cell, and one coarse cell more
    let way = 2u * cell + 1u + p.k_coarser;
    return Taps(way / whole + p.k_side - 2u, f32(way % whole) / f32(whole));
}

fn along(row: u32, column: Taps, weights: vec4<f32>) -> f32 {
    let start = (row % p.k_side) * p.k_side;
    let a = grid[start + column.first % p.k_side].y * weights.x;
    let b = grid[start + (column.first + 1u) % p.k_side].y * weights.y;
    let c = grid[start + (column.first + 2u) % p.k_side].y * weights.z;
    let d = grid[start + (column.first + 3u) % p.k_side].y * weights.w;
    return (a + b) + (c + d);
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let column = taps(cell.x);
    let row = taps(cell.y);
    let weights = catmull_rom(column.t);
    let down = catmull_rom(row.t);
    let a = down.x * along(row.first, column, weights);
    let b = down.y * along(row.first + 1u, column, weights);
    let c = down.z * along(row.first + 2u, column, weights);
    let d = down.w * along(row.first + 3u, column, weights);
    out_deflection[at(cell.x, cell.y)] = checked((a + b) + (c + d));
}

/// Without a plate each place floats by itself.
@compute @workgroup_size(64)
fn float_alone(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    out_deflection[i] = checked(p.k_local * read_load(i));
}
