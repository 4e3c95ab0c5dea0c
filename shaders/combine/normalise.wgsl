// A raster stretched to a range by its lowest and highest sample; see crates/nodes/src/combine/normalise.rs. The first
// pass finds both as whole numbers in the same order, so that no order of writes matters.

fn ordered(v: f32) -> u32 {
    let bits = bitcast<u32>(v);
    return select(bits | 0x80000000u, ~bits, (bits & 0x80000000u) != 0u);
}

fn from_ordered(bits: u32) -> f32 {
    return bitcast<f32>(select(~bits, bits & 0x7fffffffu, (bits & 0x80000000u) != 0u));
}

var<workgroup> low_of: array<u32, 64>;
var<workgroup> high_of: array<u32, 64>;

@compute @workgroup_size(64)
fn measure(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) own: u32) {
    let cell = cell_of(id);
    // the last cell of the row again for invocations without one
    let key = ordered(read_value(at(min(cell.x, p.nx - 1u), min(cell.y, p.ny - 1u))));
    low_of[own] = key;
    high_of[own] = key;
    workgroupBarrier();
    for (var half = 32u; half > 0u; half /= 2u) {
        if (own < half) {
            low_of[own] = min(low_of[own], low_of[own + half]);
            high_of[own] = max(high_of[own], high_of[own + half]);
        }
        workgroupBarrier();
    }
    if (own == 0u) {
        // both as the largest of a number that begins with 0; workgroups that add nothing do not wait for each other
        if (~low_of[0] > atomicLoad(&ends[0])) {
            atomicMax(&ends[0], ~low_of[0]);
        }
        if (high_of[0] > atomicLoad(&ends[1])) {
            atomicMax(&ends[1], high_of[0]);
        }
    }
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let low = from_ordered(~atomicLoad(&ends[0]));
    let high = from_ordered(atomicLoad(&ends[1]));
    var share = 0.5;
    if (high > low) {
        share = (read_value(i) - low) / (high - low);
    }
    if (p.clamp != 0u) {
        share = clamp(share, 0.0, 1.0);
    }
    var value = p.to_x * (1.0 - share) + p.to_y * share;
    if (p.quantity == QUANTITY_MASK) {
        value = clamp(value, 0.0, 1.0);
    }
    out_value[i] = checked(value);
}
