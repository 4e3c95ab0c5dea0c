// The ends of a slide on the device; see crates/nodes/src/erosion/thermal/device.rs. The slide itself is
// shaders/lib/repose_sweep. It needs shaders/lib/repose.

/// Ground and rise at repose of each cell of a grid of `k_wide` by `k_high` cells; beyond the window it is closed.
@compute @workgroup_size(64)
fn load(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (cell.x >= p.k_wide || cell.y >= p.k_high) {
        return;
    }
    var loaded = vec2<f32>(0.0, CLOSED);
    if (!is_outside(cell)) {
        let here = at(cell.x, cell.y);
        let rise = tangents[here * p.k_tangents] * p.cell_m / max(clamp(read_mask(here), 0.0, 1.0), 1e-25);
        let height = read_height(here);
        let is_ground = (bitcast<u32>(height) & 0x7fffffffu) < bitcast<u32>(p.k_highest);
        if (is_ground && rise < SHUT) {
            loaded = vec2<f32>(height, rise);
        }
    }
    land[cell.y * p.k_wide + cell.x] = loaded;
}

/// What the `k_part` cells of a part of a row have gained, times `k_share`, and lost.
@compute @workgroup_size(64)
fn sums(@builtin(global_invocation_id) id: vec3<u32>) {
    let spot = cell_of(id);
    let parts = (p.nx + p.k_part - 1u) / p.k_part;
    if (spot.x >= parts || spot.y >= p.ny) {
        return;
    }
    var total = vec2<f32>(0.0, 0.0);
    for (var x = spot.x * p.k_part; x < min((spot.x + 1u) * p.k_part, p.nx); x++) {
        let gained = moved[spot.y * p.k_wide + x];
        total += vec2<f32>(max(gained, 0.0) * p.k_share, max(-gained, 0.0));
    }
    changes[spot.y * parts + spot.x] = total;
}
