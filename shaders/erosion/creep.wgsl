// Creep along rows or columns; see crates/nodes/src/numerics/hillslope and crates/nodes/src/erosion/creep/device.rs. The
// unknowns are what cells gain in a step, or, where `k_far` is 1, their heights after it above a reference, which are
// turned into their gains since the start.

const SIDE_OPEN: u32 = 0u;
const SIDE_BASE: u32 = 1u;

/// The flows to the first and the last cell of each line.
var<workgroup> to_first: array<f32, 8>;
var<workgroup> to_last: array<f32, 8>;
/// Whether rounding may decide which way that to the last cell goes.
var<workgroup> is_unsure: array<u32, 8>;

/// Rounding of a height that is solved for, as a share of the highest of its line.
const ROUNDING: f32 = 1e-5;

/// Makes a step along a line, with all iterations that it needs.
fn step_of(part: Part, own: u32, hold: Ends, is_joined: bool) {
    let is_linear = p.critical_slope <= 0.0;
    if (!is_linear) {
        for (var i = part.first; i < part.end; i++) {
            solved[place_of(part.line, i)] = select(0.0, start_of(ground_at(part.line, i, LINEAR)), p.k_far != 0u);
        }
        storageBarrier();
        workgroupBarrier();
    }
    let last = select(4u, 0u, is_linear);
    for (var iteration = 0u; iteration <= last; iteration++) {
        solve(part, own, select(select(TANGENT, SECANT, iteration == last), LINEAR, is_linear), hold, is_joined);
    }
}

fn hold_of(side: u32) -> u32 {
    switch (side) {
        case SIDE_OPEN: { return SINK; }
        case SIDE_BASE: { return FIXED; }
        default: { return FREE; }
    }
}

/// The flow from cell i to cell j through a face, after a solution.
fn crossing(through: Face, line: u32, i: u32, j: u32) -> f32 {
    return through.given + through.implicit * (solved[place_of(line, i)] - solved[place_of(line, j)]);
}

/// The greatest height at the ends of parts and before the last cell, in the last part after a solution.
fn greatest(part: Part, own: u32) -> f32 {
    var most = abs(solved[place_of(part.line, cells_of_line() - 2u)]);
    for (var k = own % LINES; k <= own; k += LINES) {
        most = max(most, abs(last_of[k]));
    }
    return most;
}

/// Measures heights from that of the first ground from an end of the line on.
fn refer_to(part: Part, last: bool) {
    if (part.first == part.end || p.k_far == 0u) {
        return;
    }
    let n = cells_of_line();
    reference = 0.0;
    for (var k = 0u; k < n; k++) {
        let cell = place_of(part.line, select(k, n - 1u - k, last));
        if (is_solid(read_height(cell))) {
            reference = read_height(cell) + moved[cell];
            return;
        }
    }
}

/// Solves for the gains of the cells of a line, in rounds: a sink that would give more than it gets is land, which may
/// bring the other to give.
fn solve_line(part: Part, own: u32, sides: Ends, is_joined: bool) {
    let n = cells_of_line();
    let line_of_group = own % LINES;
    let is_last = part.end == n;
    var hold = sides;
    var is_due = part.first < part.end;
    let rounds = select(1u, 3u, sides.first == SINK || sides.last == SINK);
    for (var round = 0u; round < rounds; round++) {
        let due = only(part, is_due);
        refer_to(due, hold.first == FREE && hold.last != FREE);
        step_of(due, own, hold, is_joined);
        if (is_due && part.number == 0u) {
            to_first[line_of_group] = -crossing(first_face, part.line, 0u, 1u);
        }
        let both = hold.first != FREE && hold.last != FREE;
        if (p.k_far != 0u && sides.first != FREE && sides.last == SINK) {
            // where it is in doubt, the flow to the last cell is computed from heights above that
            if (is_due && is_last) {
                let flow = crossing(last_face, part.line, n - 2u, n - 1u);
                is_unsure[line_of_group] = u32(abs(flow) < ROUNDING * last_face.implicit * greatest(part, own));
            }
            storageBarrier();
            workgroupBarrier();
            let once_more = only(due, both && hold.last == SINK && is_unsure[line_of_group] != 0u);
            refer_to(once_more, true);
            step_of(once_more, own, hold, is_joined);
        }
        if (is_due && is_last) {
            to_last[line_of_group] = crossing(last_face, part.line, n - 2u, n - 1u);
        }
        workgroupBarrier();
        let first_gives = hold.first == SINK && to_first[line_of_group] < -p.k_given;
        let last_gives = hold.last == SINK && to_last[line_of_group] < -p.k_given;
        let gives = first_gives || last_gives;
        // nothing passes between two cells that keep their heights
        if (is_due && !gives && part.number == 0u && (n > 2u || !both)) {
            let place = 2u * (part.line + select(0u, p.ny, p.k_columns != 0u));
            left[place] += select(0.0, to_first[line_of_group], hold.first != FREE);
            left[place + 1u] += select(0.0, to_last[line_of_group], hold.last != FREE);
        }
        is_due = is_due && gives;
        hold = Ends(select(hold.first, FREE, first_gives), select(hold.last, FREE, last_gives));
        workgroupBarrier();
    }
    if (p.k_far != 0u) {
        for (var i = part.first; i < part.end; i++) {
            let cell = place_of(part.line, i);
            let height = read_height(cell);
            solved[cell] = select(0.0, solved[cell] - (height - reference), is_solid(height));
        }
    }
}

@compute @workgroup_size(256)
fn lines(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) own: u32) {
    let n = cells_of_line();
    let line = group.x * LINES + own % LINES;
    let number = own / LINES;
    let columns = p.k_columns != 0u;
    let is_joined = select(p.k_wraps_x, p.k_wraps_y, columns) != 0u && n > 1u;
    let beside_first = select(p.k_north, p.k_west, columns);
    let beside_last = select(p.k_south, p.k_east, columns);
    let is_fixed = n < 2u || (line == 0u && beside_first == SIDE_BASE)
        || (line + 1u == lines_of_all() && beside_last == SIDE_BASE);
    let first = min(number * part_length(), n);
    let whole = Part(line, number, first, min(first + part_length(), n));
    let part = only(whole, line < lines_of_all());
    if (is_fixed) {
        for (var i = part.first; i < part.end; i++) {
            let cell = place_of(line, i);
            solved[cell] = select(0.0, moved[cell], p.k_far != 0u);
        }
    }
    var sides = Ends(FREE, FREE);
    if (!is_joined) {
        sides = Ends(hold_of(select(p.k_west, p.k_north, columns)), hold_of(select(p.k_east, p.k_south, columns)));
    }
    solve_line(only(part, !is_fixed), own, sides, is_joined);
}
