// Sums of runoff as whole numbers of two words: the highest runoff has as many bits as leave room for
// the sum over all cells.

@compute @workgroup_size(64)
fn highest(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let rate = read_runoff(at(cell.x, cell.y));
    // numbers above 0 are in the order of their bits; cells that change nothing do not wait for each other
    if (rate > 0.0 && bitcast<u32>(rate) > atomicLoad(&most[0])) {
        atomicMax(&most[0], bitcast<u32>(rate));
    }
}

@compute @workgroup_size(64)
fn begin(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let rate = read_runoff(i);
    let whole = select(0.0, rate * p.k_each, rate > 0.0);
    let high_part = floor(whole * (1.0 / 4294967296.0));
    let rest = whole - high_part * 4294967296.0;
    atomicStore(&sum_high[i], u32(high_part));
    atomicStore(&sum[i], u32(select(rest, floor(rest + 0.5), rest < 8388608.0)));
}

fn add_to(i: u32, low_part: u32, high_part: u32) {
    let before = atomicAdd(&sum[i], low_part);
    let carry = select(0u, 1u, before + low_part < before);
    atomicAdd(&sum_high[i], high_part + carry);
}

@compute @workgroup_size(64)
fn add_wide(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let q = pointer[i];
    add_to(i, low[i], high[i]);
    if (q != NOWHERE) {
        add_to(q, low[i], high[i]);
    }
}
