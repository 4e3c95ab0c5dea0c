// What lies beyond the sides of the ice grid; see `Grid::surround` in crates/nodes/src/erosion/glacial/grid.rs. It needs
// shaders/lib/ice.

fn surface_at(place: u32) -> f32 { return bed[place] + thickness[place]; }

/// Sets two cells beyond one end of a line. `step` leads along the line, `ground` from a place on the line to that with
/// the level of the ground.
fn set_beyond(side: u32, border: u32, step: i32, count: u32, ground: i32) {
    let last = i32(count) - 1;
    let next = u32(i32(border) + step * min(1, last));
    for (var out = 1; out <= 2; out++) {
        let ghost = u32(i32(border) - step * out);
        switch (side) {
            case SIDE_WALL: {
                let mirror = u32(i32(border) + step * min(out - 1, last));
                thickness[ghost] = thickness[mirror];
                bed[ghost] = bed[mirror];
            }
            case SIDE_BASE: {
                thickness[ghost] = 0.0;
                bed[ghost] = bed[u32(i32(border) + ground)];
            }
            case SIDE_PERIODIC: {
                let opposite = u32(i32(border) + step * (((2 * i32(count) - out) % i32(count))));
                thickness[ghost] = thickness[opposite];
                bed[ghost] = bed[opposite];
            }
            default: {
                let fall = max(surface_at(next) - surface_at(border), 0.0);
                thickness[ghost] = thickness[border];
                bed[ghost] = bed[border] - f32(out) * fall;
            }
        }
    }
}

/// West and east of the rows.
@compute @workgroup_size(64)
fn beside(@builtin(global_invocation_id) id: vec3<u32>) {
    let j = id.x;
    if (j >= p.k_ny) {
        return;
    }
    set_beyond(p.side_west, padded(0u, j), 1, p.k_nx, 0);
    set_beyond(p.side_east, padded(p.k_nx - 1u, j), -1, p.k_nx, 0);
}

/// North and south of the columns, those beyond the sides too.
@compute @workgroup_size(64)
fn above(@builtin(global_invocation_id) id: vec3<u32>) {
    let x = id.x;
    if (x >= stride()) {
        return;
    }
    // the ground beyond a corner is that of the nearest cell inside
    var inside = clamp(i32(x), i32(PAD), i32(p.k_nx + PAD) - 1);
    if (p.side_west == SIDE_PERIODIC) {
        inside = i32(PAD) + (i32(x) - i32(PAD) + 2 * i32(p.k_nx)) % i32(p.k_nx);
    }
    let ground = inside - i32(x);
    let step = i32(stride());
    set_beyond(p.side_north, PAD * stride() + x, step, p.k_ny, ground);
    set_beyond(p.side_south, (p.k_ny + 1u) * stride() + x, -step, p.k_ny, ground);
}
