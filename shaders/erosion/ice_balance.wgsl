// The mass balance of ice on its surface; see crates/nodes/src/erosion/glacial/climate.rs. It needs shaders/lib/ice.

/// A value between the entries of the table, which has snow and then melt.
fn tabled(entry: u32, place: f32) -> f32 {
    let k = u32(place);
    let t = place - floor(place);
    return table[entry + k] + t * (table[entry + k + 1u] - table[entry + k]);
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let spot = cell_of(id);
    if (is_beyond(spot)) {
        return;
    }
    let cell = inside(spot);
    let place = padded(spot.x, spot.y);
    let surface = (bed[place] + p.k_datum - p.k_shift) + thickness[place];
    let level = levels[cell * p.k_level_step];
    if (p.climate == CLIMATE_ELA) {
        let above = surface - level;
        balance[cell] = select(
            p.ablation_gradient * above,
            min(p.accumulation_gradient * above, p.max_accumulation),
            above > 0.0,
        );
        return;
    }
    let mean = level - 1e-3 * lapse_rates[cell * p.k_lapse_step] * surface;
    let at_mean = clamp((mean - p.k_coldest) * p.k_per_degree, 0.0, f32(p.k_entries - 1u) - 1e-3);
    let snow = max(rainfall[cell * p.k_rain_step], 0.0) * tabled(0u, at_mean);
    balance[cell] = snow - tabled(p.k_entries, at_mean);
}
