// A raster with rows and columns exchanged, or back, tile by tile, so that what is read and what is written are runs of
// cells; see crates/nodes/src/erosion/creep/device.rs.

const SIDE = 32u;

/// With a place left out after each row.
var<workgroup> tile: array<f32, 1056>;

fn place_in(cell: vec2<u32>, is_turned: bool) -> u32 { return select(at(cell.x, cell.y), cell.x * p.ny + cell.y, is_turned); }

/// What is taken over: a raster, or the gains since the start after a step, of which that or the gain in it is solved for.
fn taken(i: u32) -> f32 {
    if (p.k_adds != 0u) {
        return moved[i] + solved[i];
    }
    return solved[i];
}

@compute @workgroup_size(64)
fn turn(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) own: u32) {
    let corner = vec2<u32>(group.x, group.y + p.row) * SIDE;
    let back = p.k_back != 0u;
    for (var k = own; k < SIDE * SIDE; k += 64u) {
        let along = vec2<u32>(k % SIDE, k / SIDE);
        let spot = select(along, along.yx, back);
        if (!is_outside(corner + spot)) {
            tile[spot.y * (SIDE + 1u) + spot.x] = taken(place_in(corner + spot, back));
        }
    }
    workgroupBarrier();
    for (var k = own; k < SIDE * SIDE; k += 64u) {
        let along = vec2<u32>(k % SIDE, k / SIDE);
        let spot = select(along.yx, along, back);
        if (!is_outside(corner + spot)) {
            turned[place_in(corner + spot, !back)] = tile[spot.y * (SIDE + 1u) + spot.x];
        }
    }
}
