// One plane of the elevation tints under light; see crates/nodes/src/render/hillshade.

/// The tint of an elevation: from the table of water, or that of land, which follows it.
fn tint_of(height: f32) -> f32 {
    if (p.tints == 0u) {
        return 1.0;
    }
    let wet = height < p.k_sea_m;
    let above = select(height - p.k_low_m, p.k_sea_m - height, wet);
    let place = clamp(above * p.k_per_m, 0.0, 1.0) * f32(p.k_steps - 1u);
    let step = min(u32(place), p.k_steps - 2u);
    let base = select(p.k_steps, 0u, wet) + step;
    let a = tint_table[3u * base + p.k_plane];
    let b = tint_table[3u * base + 3u + p.k_plane];
    return a + (b - a) * (place - f32(step));
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    var sky = 1.0;
    if (p.k_casts != 0u) {
        sky = 1.0 - min(sums[i] * p.k_share, 1.0);
    }
    let light = p.k_sky * sky + p.k_sun * (shades[i] / p.k_sin);
    let colour = min(tint_of(read_height(i)) * light, 1.0);
    out_colour[i] = checked(colour + (p.k_water - colour) * clamp(read_wet(i), 0.0, 1.0));
}
