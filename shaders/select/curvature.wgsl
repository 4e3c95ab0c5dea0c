// Curvature of smoothed ground; see crates/nodes/src/select/curvature.rs.

/// Squared slope below which terrain counts as level.
const LEVEL: f32 = 1e-14;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let x = i32(cell.x);
    let y = i32(cell.y);
    let west = line_index(x - 1, p.nx, p.k_wraps_x != 0u);
    let east = line_index(x + 1, p.nx, p.k_wraps_x != 0u);
    let north = line_index(y - 1, p.ny, p.k_wraps_y != 0u);
    let south = line_index(y + 1, p.ny, p.k_wraps_y != 0u);
    let centre = before[at(cell.x, cell.y)];
    let w = before[at(west, cell.y)] - centre;
    let e = before[at(east, cell.y)] - centre;
    let n = before[at(cell.x, north)] - centre;
    let s = before[at(cell.x, south)] - centre;
    let corners = (before[at(east, south)] - before[at(west, south)]) - (before[at(east, north)] - before[at(west, north)]);
    let per_cell = 1.0 / p.cell_m;
    let slope_x = (e - w) * (0.5 * per_cell);
    let slope_y = (s - n) * (0.5 * per_cell);
    let bend_x = (e + w) * per_cell * per_cell;
    let bend_y = (s + n) * per_cell * per_cell;
    let twist = corners * (0.25 * per_cell) * per_cell;
    let steep = slope_x * slope_x + slope_y * slope_y;
    let stretch = sqrt(1.0 + steep);
    var bend = 0.5 * (bend_x + bend_y);
    if (steep > LEVEL) {
        // weights that add up to 1, so that small squares are not divided
        let xx = slope_x * slope_x / steep;
        let xy = slope_x * slope_y / steep;
        let yy = slope_y * slope_y / steep;
        if (p.kind == KIND_PROFILE) {
            bend = (xx * bend_x + 2.0 * xy * twist + yy * bend_y) / (stretch * stretch * stretch);
        } else if (p.kind == KIND_TANGENTIAL) {
            bend = (yy * bend_x - 2.0 * xy * twist + xx * bend_y) / stretch;
        }
    }
    out_curvature[at(cell.x, cell.y)] = checked(bend);
}
