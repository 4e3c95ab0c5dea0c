// The lowest pass out of each basin: a link between two cells, in the order of the height of the higher cell and the number
// of the link, as in crates/nodes/src/numerics/routing (`passes`, `basins`). `bottom` has the bottom of the basin of each
// cell, `NOWHERE` where it drains out of the world. Heights and numbers are inverted, so that 0 stands for none.

const LEAVES: u32 = 4u;

/// Height of the link to a neighbour, inverted; 0 if both are in one basin.
fn link_height(own: u32, here: u32, j: u32) -> u32 {
    if (j == NOWHERE || bottom[j] == own) {
        return 0u;
    }
    return ~max(here, ordered(read_height(j)));
}

/// Number of the link from a cell in a direction: that of one of its two cells.
fn link_number(i: u32, way: u32, j: u32) -> u32 {
    switch (way) {
        case 0u: { return i << 3u; }
        case 5u: { return (i << 3u) | 1u; }
        case 6u: { return (i << 3u) | 2u; }
        case 7u: { return (i << 3u) | 3u; }
        case 4u: { return j << 3u; }
        case 1u: { return (j << 3u) | 1u; }
        case 2u: { return (j << 3u) | 2u; }
        default: { return (j << 3u) | 3u; }
    }
}

@compute @workgroup_size(64)
fn lowest(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let own = bottom[i];
    if (own == NOWHERE) {
        return;
    }
    let here = ordered(read_height(i));
    var best = 0u;
    for (var way = 0u; way < 8u; way++) {
        best = max(best, link_height(own, here, beside(cell, way)));
    }
    if (outlet_of(cell) == SIDE_OPEN) {
        best = max(best, ~here);
    }
    if (best > atomicLoad(&heights[own])) {
        atomicMax(&heights[own], best);
    }
}

@compute @workgroup_size(64)
fn first_of_lowest(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let own = bottom[i];
    if (own == NOWHERE) {
        return;
    }
    let here = ordered(read_height(i));
    let lowest = atomicLoad(&heights[own]);
    for (var way = 0u; way < 8u; way++) {
        let j = beside(cell, way);
        let height = link_height(own, here, j);
        if (height != 0u && height == lowest) {
            atomicMax(&links[own], ~link_number(i, way, j));
        }
    }
    if (outlet_of(cell) == SIDE_OPEN && ~here == lowest) {
        atomicMax(&links[own], ~((i << 3u) | LEAVES));
    }
}

/// Decides which basins drain through their lowest pass now: all but one of two with the same pass. Those that stay are
/// counted; the others get a height of 1.
@compute @workgroup_size(64)
fn decide(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    if (bottom[i] != i) {
        return;
    }
    let link = atomicLoad(&links[i]);
    let number = ~link & 7u;
    let owner = ~link >> 3u;
    var stays = link == 0u;
    if (!stays && number != LEAVES) {
        let other = beside(cell_at(owner), select(number + 4u, 0u, number == 0u));
        let beyond = select(bottom[owner], bottom[other], bottom[owner] == i);
        stays = beyond != NOWHERE && i < beyond && atomicLoad(&links[beyond]) == link;
    }
    if (stays) {
        atomicAdd(&left[0], 1u);
    }
    atomicStore(&heights[i], select(1u, 0u, stays));
}
