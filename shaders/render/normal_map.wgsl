// Surface normals; see crates/nodes/src/render/normal_map.rs.

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let gradient = horn(cell);
    let south_scale = select(-p.exaggeration, p.exaggeration, p.convention == CONVENTION_OPENGL);
    let x = clamp(-gradient.x * p.exaggeration, -p.k_steepest, p.k_steepest);
    let y = clamp(gradient.y * south_scale, -p.k_steepest, p.k_steepest);
    let length_of = sqrt(1.0 + (x * x + y * y));
    let i = at(cell.x, cell.y);
    out_normal[i] = checked(x / length_of);
    out_normal_1[i] = checked(y / length_of);
    out_normal_2[i] = checked(1.0 / length_of);
}
