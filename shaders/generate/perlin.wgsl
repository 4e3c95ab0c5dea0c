// The sum of octaves of lattice noise.

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let place = vec2<u32>(p.left, p.top) + cell;
    var height = 0.0;
    for (var k = 0u; k < p.count; k++) {
        height += lattice_noise(octaves_of[k], p.basis, place);
    }
    out_height[at(cell.x, cell.y)] = checked(height);
}
