// The hidden part of the light of an even sky; see crates/nodes/src/numerics/horizon/device.rs.

/// Adds the squared sines of the horizon angles in one direction.
@compute @workgroup_size(64)
fn hide(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    var sum = 0.0;
    if (p.k_goes_on != 0u) {
        sum = sums[i];
    }
    let tangent = tangents[i] * p.exaggeration;
    let square = tangent * tangent;
    sums[i] = sum + square / (1.0 + square);
}
