// Lakes as connected components, as in crates/nodes/src/numerics/lakes.rs: each wet cell points to one before it in the same
// lake, in the end to the first. First cells are counted in blocks of 64 cells of a row, and numbered in order.

fn is_wet(i: u32) -> bool { return from_ordered(level[i]) > read_height(i); }

@compute @workgroup_size(64)
fn begin(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    atomicStore(&first[i], select(NOWHERE, i, is_wet(i)));
}

/// Joins the trees of neighbours.
@compute @workgroup_size(64)
fn join(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let own = atomicLoad(&first[i]);
    if (own == NOWHERE) {
        return;
    }
    var least = own;
    for (var way = 0u; way < 8u; way++) {
        let j = beside(cell, way);
        if (j != NOWHERE) {
            least = min(least, atomicLoad(&first[j]));
        }
    }
    if (least < own) {
        atomicMin(&first[own], least);
        atomicMin(&first[i], least);
        atomicStore(&changed[0], 1u);
    }
}

/// Shortens the ways to first cells.
@compute @workgroup_size(64)
fn shorten(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let own = atomicLoad(&first[i]);
    if (own != NOWHERE) {
        atomicMin(&first[i], atomicLoad(&first[own]));
    }
}

var<workgroup> is_first: array<u32, 64>;

/// Number of first cells among those of the block before an invocation, and in the block.
fn firsts_before(own: u32) -> vec2<u32> {
    var before = 0u;
    var all = 0u;
    for (var k = 0u; k < 64u; k++) {
        all += is_first[k];
        before += select(0u, is_first[k], k < own);
    }
    return vec2<u32>(before, all);
}

fn block_of(cell: vec2<u32>) -> u32 { return cell.y * ((p.nx + 63u) / 64u) + cell.x / 64u; }

@compute @workgroup_size(64)
fn tally(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) own: u32) {
    let cell = cell_of(id);
    let exists = !is_outside(cell);
    let i = at(min(cell.x, p.nx - 1u), min(cell.y, p.ny - 1u));
    is_first[own] = select(0u, 1u, exists && atomicLoad(&first[i]) == i);
    workgroupBarrier();
    if (own == 0u && exists) {
        tallies[block_of(cell)] = firsts_before(0u).y;
    }
}

@compute @workgroup_size(64)
fn number(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) own: u32) {
    let cell = cell_of(id);
    let exists = !is_outside(cell);
    let i = at(min(cell.x, p.nx - 1u), min(cell.y, p.ny - 1u));
    let counts = exists && atomicLoad(&first[i]) == i;
    is_first[own] = select(0u, 1u, counts);
    workgroupBarrier();
    if (exists) {
        numbers[i] = select(0u, tallies[block_of(cell)] + firsts_before(own).x + 1u, counts);
    }
}

var<workgroup> sums: array<u32, 256>;

/// Replaces the tally of each block by the sum of those before it. One workgroup.
@compute @workgroup_size(256)
fn sum_up(@builtin(local_invocation_index) own: u32) {
    let all = p.ny * ((p.nx + 63u) / 64u);
    let each = (all + 255u) / 256u;
    let start = min(own * each, all);
    let end = min(start + each, all);
    var sum = 0u;
    for (var k = start; k < end; k++) {
        sum += tallies[k];
    }
    sums[own] = sum;
    workgroupBarrier();
    var before = 0u;
    for (var k = 0u; k < own; k++) {
        before += sums[k];
    }
    for (var k = start; k < end; k++) {
        let here = tallies[k];
        tallies[k] = before;
        before += here;
    }
}
