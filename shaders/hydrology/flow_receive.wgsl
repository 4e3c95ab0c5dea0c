// One receiver for each cell: the neighbour of steepest descent, as in crates/nodes/src/numerics/routing/receivers.rs.

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
    for (var way = 0u; way < 8u; way++) {
        let j = beside(cell, way);
        if (j != NOWHERE) {
            let slope = (here - read_height(j)) * select(1.0, 0.70710677, (way & 1u) == 1u);
            if (slope > steepest) {
                steepest = slope;
                found = way;
            }
        }
    }
    let outlet = outlet_of(cell);
    if (outlet == SIDE_BASE || (outlet == SIDE_OPEN && found == PIT) || here < p.k_sea) {
        found = OUTLET;
    }
    code[i] = found;
}
