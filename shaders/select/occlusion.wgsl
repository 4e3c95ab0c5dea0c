// The hidden part of an even sky, from its sums over directions; see crates/nodes/src/select/occlusion.rs.

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let hidden = min(sums[i] * p.k_share, 1.0);
    if (p.wants_occlusion != 0u) {
        out_occlusion[i] = checked(hidden);
    }
    if (p.wants_sky != 0u) {
        out_sky[i] = checked(1.0 - hidden);
    }
}
