// Depth of water, erosion and deposition; see crates/nodes/src/erosion/hydraulic_pipe/bed.rs.

const LAW_POWER: u32 = 0u;
const LAW_SHEAR: u32 = 1u;
const LAW_SPEED: u32 = 2u;

/// 1 - e^(-x) for x = `share` / `whole`.
fn reached(share: f32, whole: f32) -> f32 {
    let sixth = share * (1.0 / 6.0);
    let above = share * (whole + sixth);
    return above * inverse(whole * whole + share * ((2.0 / 3.0) * whole + sixth));
}

fn rise(before: f32, here: f32, after: f32) -> f32 {
    return select(after, here, is_hole(after)) - select(before, here, is_hole(before));
}

/// The fall through a face, as far as it drives water; that to a hole is the steepest.
fn fall(before: f32, after: f32, deeper: f32) -> f32 {
    let whole = (before - after) + deeper;
    let bounded = most(least(whole, p.k_steepest), -p.k_steepest);
    return select(bounded, p.k_steepest, is_hole(before) || is_hole(after));
}

/// Adds what crosses a side to what has left.
fn leave(side: u32, discharge: f32, part_of: f32) {
    let gone = discharge * p.k_step;
    rim[water_left(side)] += gone;
    rim[solid_left(side)] += gone * part_of;
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let x = i32(cell.x);
    let y = i32(cell.y);
    let from_west = west[i];
    let from_north = north[i];
    let to_east = west_at(cell.x + 1u, cell.y);
    let to_south = north_at(cell.x, cell.y + 1u);
    let before = wet[i];
    let after = most(before + p.k_step * ((from_west - to_east) + (from_north - to_south)), 0.0);
    water[i] = after;
    // numbers above 0 are in the order of their bits; cells that change nothing do not wait for each other
    if (bitcast<u32>(after) > atomicLoad(&deepest[0])) {
        atomicMax(&deepest[0], bitcast<u32>(after));
    }
    let mean = 0.5 * (before + after);
    let across = 0.5 * (from_west + to_east);
    let down = 0.5 * (from_north + to_south);
    let square = across * across + down * down;
    let q = square * inverse_root(square);
    passed[i] += q * p.k_dt;

    let here = bed[i];
    let bed_west = bed_at(x - 1, y);
    let bed_east = bed_at(x + 1, y);
    let bed_north = bed_at(x, y - 1);
    let bed_south = bed_at(x, y + 1);
    let by_depth = p.k_law != LAW_SPEED;
    var sine = 0.0;
    if (by_depth) {
        let falls_x = from_west * fall(bed_west, here, wet_at(x - 1, y) - before)
            + to_east * fall(here, bed_east, before - wet_at(x + 1, y));
        let falls_y = from_north * fall(bed_north, here, wet_at(x, y - 1) - before)
            + to_south * fall(here, bed_south, before - wet_at(x, y + 1));
        let power = most((falls_x + falls_y) * p.k_tilt, 0.0);
        sine = power * inverse_root(square + power * power);
    } else {
        let along_x = rise(bed_west, here, bed_east) * p.k_tilt;
        let along_y = rise(bed_north, here, bed_south) * p.k_tilt;
        let slope2 = least(along_x * along_x + along_y * along_y, 1e12);
        let one = 1.0 + slope2;
        let tilted = most(slope2, p.k_tilt_floor * one);
        sine = tilted * inverse_root(tilted * one);
    }
    let shallow = most(1.0 - mean * p.k_per_deep, 0.0);
    let power = p.k_capacity * (sine * q) * (film_of(mean) * shallow);
    let thin = most(mean, 1e-6);
    let able = most(select(power * inverse(thin), least(power, p.k_thickest * mean), by_depth), 0.0);

    let load_before = sediment[i];
    let missing = able - load_before;
    var mobile = positive(read_erodibility(i));
    if (is_held(cell.x, cell.y)) {
        mobile = -1.0;
    }
    var rate = p.k_entrainment * positive(mobile);
    if (p.k_law == LAW_SHEAR) {
        rate = rate * most(p.k_shear * mean * sine - 1.0, 0.0);
    }
    rate = least(rate, 1e6);
    let takes = missing > 0.0;
    let whole = select(1.0, thin, by_depth && !takes);
    var taken_m = p.k_acceleration * missing * reached(select(p.k_settling, rate, takes), whole);
    let limit = least(p.k_bite + p.k_bite_deeper * mean, p.k_most);
    taken_m = most(least(taken_m, limit), -limit);
    if (by_depth) {
        let beside = least(least(bed_west, here), least(bed_east, here));
        let above = least(bed_at(x - 1, y - 1), least(bed_north, least(bed_at(x + 1, y - 1), here)));
        let below = least(bed_at(x - 1, y + 1), least(bed_south, least(bed_at(x + 1, y + 1), here)));
        let deepest_m = 0.25 * (here - least(beside, least(above, below)));
        taken_m = select(taken_m, deepest_m, taken_m > deepest_m);
    }
    let lying = loose[i];
    let beyond = taken_m - lying;
    taken_m = select(taken_m, lying + beyond * least(p.k_rock, 1.0), beyond > 0.0);
    taken_m = most(taken_m, -load_before * p.k_acceleration);
    taken_m = select(0.0, taken_m, mobile >= 0.0 && !is_hole(here));
    change[i] -= taken_m;
    taken[i] += taken_m;
    loose[i] = most(lying - taken_m, 0.0);
    let carried = load_before + taken_m * p.k_per_acceleration;
    let part_of = select(0.0, carried * inverse(before), before > 1e-20);
    load[i] = carried;
    part[i] = part_of;

    if (p.side_west != SIDE_PERIODIC && cell.x == 0u) {
        leave(rim_west(cell.y), -from_west, part_of);
    }
    if (p.side_west != SIDE_PERIODIC && cell.x + 1u == p.nx) {
        leave(rim_east(cell.y), to_east, part_of);
    }
    if (p.side_north != SIDE_PERIODIC && cell.y == 0u) {
        leave(rim_north(cell.x), -from_north, part_of);
    }
    if (p.side_north != SIDE_PERIODIC && cell.y + 1u == p.ny) {
        leave(rim_south(cell.x), to_south, part_of);
    }
}
