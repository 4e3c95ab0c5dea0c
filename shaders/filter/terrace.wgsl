// Steps in terrain; see crates/nodes/src/filter/terrace.

/// A step between two treads of a table.
struct Layer {
    tread: f32,
    step: f32,
    sharpness: f32,
}

/// The sum of `count` octaves from `first` on.
fn octaves_at(first: u32, count: u32, place: vec2<u32>) -> f32 {
    var sum = 0.0;
    for (var k = first; k < first + count; k++) {
        sum += lattice_noise(octaves_of[k], BELL, place);
    }
    return sum;
}

/// A number from 0 to 1 for a step; each salt gives another one.
fn draw_of(index: f32, salt: u32) -> f32 {
    let key = u32(i32(clamp(index, -1e9, 1e9))) * 0x8da6b343u + salt * 0x9e3779b9u;
    return f32(mix_bits(key ^ p.k_hash) >> 8u) * (1.0 / 16777216.0);
}

/// The new position within a step, 0 to 1. The lower half of the riser has the sharpness `foot`.
fn riser(rest: f32, sharpness: f32, foot: f32) -> f32 {
    let upper = rest > 0.5;
    let near = select(2.0 * rest, 2.0 - 2.0 * rest, upper);
    let lift = 0.5 * power(near, select(foot, sharpness, upper));
    return select(lift, 1.0 - lift, upper);
}

/// The same within the step of an index, which differs from others and from place to place by the noises.
fn uneven_riser(rest: f32, sharpness: f32, index: f32, noises: vec3<f32>) -> f32 {
    let local = (2.0 * draw_of(index, 1u) - 1.0) * noises.x + (2.0 * draw_of(index, 2u) - 1.0) * noises.y;
    let strength = clamp(1.0 - p.variation * (0.5 * draw_of(index, 3u) - 2.4 * local + 0.15), 0.0, 1.0);
    let own = 1.0 + (sharpness - 1.0) * strength * strength;
    let shift = clamp(2.2 * p.edges * noises.z, -0.9, 0.9);
    return riser(rest + shift * rest * (1.0 - rest), own, 1.0 + (own - 1.0) * (1.0 - 0.85 * p.talus));
}

/// The limit below a step of an index, in steps.
fn limit_of(index: f32) -> f32 {
    return index + p.k_limits * p.variation * (2.0 * draw_of(index, 0u) - 1.0);
}

/// The new position of the height `u` among even steps, both in steps.
fn even(u: f32, noises: vec3<f32>) -> f32 {
    if (p.k_uneven == 0u) {
        let tread = floor(u);
        return tread + riser(u - tread, p.sharpness, p.sharpness);
    }
    let dip = p.k_dip * p.variation * noises.x;
    let v = u + dip;
    let whole = floor(v);
    var index = whole;
    if (v < limit_of(whole)) {
        index = whole - 1.0;
    }
    if (v >= limit_of(whole + 1.0)) {
        index = whole + 1.0;
    }
    let low = limit_of(index);
    let high = limit_of(index + 1.0);
    let rest = clamp((v - low) / (high - low), 0.0, 1.0);
    return low + (high - low) * uneven_riser(rest, p.sharpness, index, noises) - dip;
}

/// The new height by the table.
fn layered(height: f32, base: f32, noises: vec3<f32>) -> f32 {
    let above = height - base;
    var here = layers_of[0];
    var index = 0u;
    for (var k = 0u; k < p.k_layers; k++) {
        if (above >= layers_of[k].tread) {
            here = layers_of[k];
            index = k;
        }
    }
    let last = layers_of[p.k_layers - 1u];
    if (above < here.tread || above >= last.tread + last.step || here.sharpness == 1.0) {
        return height;
    }
    let rest = clamp((above - here.tread) / here.step, 0.0, 1.0);
    if (p.k_uneven == 0u) {
        return base + here.tread + here.step * riser(rest, here.sharpness, here.sharpness);
    }
    return base + here.tread + here.step * uneven_riser(rest, here.sharpness, f32(index), noises);
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let height = read_height(i);
    let base = read_base(i);
    var noises = vec3<f32>(0.0);
    if (p.k_uneven != 0u) {
        let place = vec2<u32>(p.left, p.top) + cell;
        noises = vec3<f32>(
            octaves_at(0u, p.k_wide, place),
            octaves_at(p.k_wide, p.k_wide, place),
            octaves_at(2u * p.k_wide, p.k_fine, place),
        );
    }
    var stepped = height;
    if (p.k_layers > 0u) {
        stepped = layered(height, base, noises);
    } else {
        stepped = base + p.step * even((height - base) / p.step, noises);
    }
    out_height[i] = checked(masked(height, stepped, read_mask(i)));
}
