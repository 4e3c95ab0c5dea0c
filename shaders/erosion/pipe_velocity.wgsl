// The velocity of the water at the end of a storm; see crates/nodes/src/erosion/hydraulic_pipe/run.rs.

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let depth = water[i];
    let across = 0.5 * (west[i] + west_at(cell.x + 1u, cell.y));
    let down = 0.5 * (north[i] + north_at(cell.x, cell.y + 1u));
    let over = max(depth, 1e-6);
    out_velocity[i] = checked(across / over * film_of(depth));
    out_velocity_1[i] = checked(down / over * film_of(depth));
}
