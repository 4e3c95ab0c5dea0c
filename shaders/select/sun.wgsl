// The outputs, from sums over time; see crates/nodes/src/select/sun.

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    if (p.wants_exposure != 0u) {
        out_exposure[i] = checked(min(energy[i] * p.k_per_facing, 1.0));
    }
    if (p.wants_sunlit != 0u) {
        out_sunlit[i] = checked(min(lit[i] * p.k_per_time, 1.0));
    }
    if (p.wants_duration != 0u) {
        out_duration[i] = checked(min(lit[i] * p.k_per_days, p.k_day_s));
    }
    if (p.wants_irradiance != 0u) {
        out_irradiance[i] = checked(energy[i] * p.k_per_second);
    }
}
