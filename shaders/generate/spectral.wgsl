// Random waves of crates/nodes/src/generate/spectral (`torus`): a chunk of their columns is drawn and transformed down the
// columns; pairs of rows become the real and the imaginary part of one, which is transformed along. Hashes and phases equal
// those of the CPU bit for bit, as they are integers.

/// Cosine and sine of an angle in 2³²nds of a turn.
fn turn(angle: u32) -> vec2<f32> {
    let quarters = (angle + (1u << 29u)) >> 30u;
    let x = f32(i32(angle - (quarters << 30u))) * 1.4629181e-9;
    let z = x * x;
    let sine = x + x * z * (-0.16666667 + z * (0.008333334 + z * (-0.0001984127 + z * 0.0000027557319)));
    let cosine = 1.0 + z * (-0.5 + z * (0.041666668 + z * (-0.0013888889 + z * 0.000024801587)));
    let is_odd = (quarters & 1u) == 1u;
    let first = bitcast<u32>(select(cosine, sine, is_odd)) ^ (((quarters + 1u) & 2u) << 30u);
    let second = bitcast<u32>(select(sine, cosine, is_odd)) ^ ((quarters & 2u) << 30u);
    return vec2<f32>(bitcast<f32>(first), bitcast<f32>(second));
}

/// A complex number of mean square 1, rotated by an angle: circular Gaussian, or of modulus 1.
fn of_key(key: u32, turned: u32) -> vec2<f32> {
    let share = (f32(i32(key >> 8u)) + 0.5) * (1.0 / 16777216.0);
    let square = -0.6931472 * log_2(share);
    let modulus = select(square * inverse_root(square), 1.0, p.amplitudes == AMPLITUDES_EVEN);
    return modulus * turn(mix_bits(key ^ 0x9e3779b9u) + turned);
}

/// The root of the power spectral density at waves per metre.
fn root_of(east: f32, south: f32) -> f32 {
    let along = east * p.k_along_x + south * p.k_along_y;
    let across = east * p.k_across_x + south * p.k_across_y;
    let octave = 0.5 * log_2(along * along + across * across);
    // both ends fade over one octave
    let share = smooth_step(octave + 0.5) * smooth_step(p.k_octaves + 0.5 - octave);
    return p.k_root * share * exp_2(p.k_fall * octave);
}

/// The waves of a chunk of columns: of two that are mirror images only one, with half the amplitude of both.
@compute @workgroup_size(64)
fn draw(@builtin(global_invocation_id) id: vec3<u32>) {
    let spot = cell_of(id);
    if (spot.x >= p.k_count || spot.y >= p.k_down) {
        return;
    }
    let column = p.k_first + spot.x;
    let south = select(i32(spot.y), i32(spot.y) - i32(p.k_down), 2u * spot.y > p.k_down);
    var v = vec2<f32>(0.0);
    if (u32(abs(south)) <= p.k_most_south && !(column == 0u && south <= 0)) {
        // of each wavenumber: waves per metre, cycles per cell, phase at the first cell
        let east_of = wavenumbers[column];
        let south_of = wavenumbers[p.k_columns + u32(abs(south))];
        let sense = select(1.0, -1.0, south < 0);
        let across = bitcast<f32>(east_of.y);
        let down = sense * bitcast<f32>(south_of.y);
        let below = p.k_fade - (across * across + down * down);
        let kept = smooth_step(below * p.k_per_fade);
        let height = p.k_scale * root_of(bitcast<f32>(east_of.x), sense * bitcast<f32>(south_of.x)) * kept;
        let row = hash_row(south, p.seed);
        let phase = east_of.z + select(south_of.z, south_of.w, south < 0);
        v = height * of_key(hash_point(i32(column), row), phase);
    }
    columns[spot.y * p.k_count + spot.x] = v;
}

/// Places the columns of a chunk in pairs of rows, each wave together with its mirror image.
@compute @workgroup_size(64)
fn pair(@builtin(global_invocation_id) id: vec3<u32>) {
    let spot = cell_of(id);
    if (spot.x >= p.k_count || spot.y >= p.k_pairs) {
        return;
    }
    let a = columns[spot.y * p.k_count + spot.x];
    var b = vec2<f32>(0.0);
    if (spot.y + p.k_pairs < p.ny) {
        b = columns[(spot.y + p.k_pairs) * p.k_count + spot.x];
    }
    let here = p.k_first + spot.x;
    let wave = vec2<f32>(a.x - b.y, a.y + b.x);
    let mirrored = vec2<f32>(a.x + b.y, b.x - a.y);
    let first = spot.y * p.k_pitch;
    if (here == 0u) {
        rows[first] = wave + mirrored;
    } else if (2u * here < p.k_along) {
        rows[first + here] = wave;
        rows[first + p.k_along - here] = mirrored;
    }
}

/// Takes the pairs of rows apart.
@compute @workgroup_size(64)
fn apart(@builtin(global_invocation_id) id: vec3<u32>) {
    let spot = cell_of(id);
    if (spot.x >= p.nx || spot.y >= p.k_pairs) {
        return;
    }
    let heights = rows[spot.y * p.k_pitch + spot.x];
    out_height[at(spot.x, spot.y)] = checked(heights.x);
    if (spot.y + p.k_pairs < p.ny) {
        out_height[at(spot.x, spot.y + p.k_pairs)] = checked(heights.y);
    }
}
