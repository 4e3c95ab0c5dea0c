// Sums of rows of what cells have gained, of what melted, and of what left the world; see
// crates/nodes/src/erosion/glacial/device/ice.rs.

var<workgroup> part: array<f32, 64>;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) own: u32) {
    let row = group.y * p.k_ny + group.x;
    var sum = 0.0;
    for (var i = own; i < p.k_nx; i += 64u) {
        sum += book[row * p.k_nx + i];
    }
    part[own] = sum;
    workgroupBarrier();
    for (var half = 32u; half > 0u; half /= 2u) {
        if (own < half) {
            part[own] += part[own + half];
        }
        workgroupBarrier();
    }
    if (own == 0u) {
        sums[row] = part[0];
    }
}
