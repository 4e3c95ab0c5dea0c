// Takes over a step of the ice, and adds to each cell what it gained as snow, what melted, and what left the world; see
// crates/nodes/src/erosion/glacial/sheet.rs. It needs shaders/lib/ice.

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let spot = cell_of(id);
    if (is_beyond(spot)) {
        return;
    }
    let cell = inside(spot);
    let place = padded(spot.x, spot.y);
    let west = -p.k_over_x * east[west_of(spot.x, spot.y)];
    let right = p.k_over_x * east[west_of(spot.x + 1u, spot.y)];
    let north = -p.k_over_y * south[north_of(spot.x, spot.y)];
    let below = p.k_over_y * south[north_of(spot.x, spot.y + 1u)];
    let snow = p.k_dt * max(balance[cell], 0.0);
    let has = max(thickness[place] - ((west + right) + (north + below)) + snow, 0.0);
    var left = 0.0;
    if (p.side_west != SIDE_PERIODIC) {
        left += select(0.0, west, spot.x == 0u) + select(0.0, right, spot.x + 1u == p.k_nx);
    }
    if (p.side_north != SIDE_PERIODIC) {
        left += select(0.0, north, spot.y == 0u) + select(0.0, below, spot.y + 1u == p.k_ny);
    }
    let stays = next[cell];
    thickness[place] = stays;
    let cells = p.k_nx * p.k_ny;
    book[cell] += snow;
    book[cells + cell] += has - stays;
    book[2u * cells + cell] += left;
}
