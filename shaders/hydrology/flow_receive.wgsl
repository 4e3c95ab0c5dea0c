// One receiver for each cell: the neighbour of steepest descent, as in crates/nodes/src/numerics/routing/receivers.rs.

// True where the terrain is not known.
fn is_void(i: u32) -> bool {
    return p.k_voids != 0u && !(read_data(i) >= 0.5);
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let here = read_height(i);
    var steepest = 0.0;
    var found = PIT;
    var leaves = outlet_of(cell) == SIDE_OPEN;
    for (var way = 0u; way < 8u; way++) {
        let j = beside(cell, way);
        if (j != NOWHERE) {
            leaves = leaves || is_void(j);
            let slope = (here - read_height(j)) * select(1.0, 0.70710677, (way & 1u) == 1u);
            if (slope > steepest) {
                steepest = slope;
                found = way;
            }
        }
    }
    if (outlet_of(cell) == SIDE_BASE || (leaves && found == PIT) || here < p.k_sea || is_void(i)) {
        found = OUTLET;
    }
    code[i] = found;
}
