// Creep along rows or columns, one invocation for each line; see crates/nodes/src/numerics/hillslope and
// crates/nodes/src/erosion/creep/device.rs. The unknowns are what cells gain in a step, or, where `k_far` is 1, their heights
// after it above a reference, which are turned into their gains since the start.

const FREE: u32 = 0u;
const SINK: u32 = 1u;
const FIXED: u32 = 2u;

const SIDE_OPEN: u32 = 0u;
const SIDE_BASE: u32 = 1u;

/// The flow across the face between two cells: `given`, and `implicit` for each metre that the unknown before it is
/// above that behind it.
struct Face {
    given: f32,
    implicit: f32,
}

const CLOSED = Face(0.0, 0.0);

fn cells_of_line() -> u32 { return select(p.nx, p.ny, p.k_columns != 0u); }

fn lines_of_all() -> u32 { return select(p.ny, p.nx, p.k_columns != 0u); }

fn place_of(line: u32, i: u32) -> u32 {
    if (p.k_columns != 0u) {
        return at(line, i);
    }
    return at(i, line);
}

fn is_ground(cell: u32) -> bool { return abs(read_height(cell)) < p.k_highest; }

/// The height above another cell, which heights alone would round.
fn above(a: u32, b: u32) -> f32 {
    return (read_height(a) - read_height(b)) + (moved[a] - moved[b]);
}

/// A height in the line, in metres: that of an end which keeps its height, so that the small heights above it, with which
/// flows to it are computed, have all digits.
var<private> reference: f32;

/// The height before the step above the reference; 0 in holes.
fn start_of(cell: u32) -> f32 {
    return select(0.0, (read_height(cell) - reference) + moved[cell], is_ground(cell));
}

fn mobility(cell: u32) -> f32 {
    if (!is_ground(cell)) {
        return 0.0;
    }
    return min(clamp(read_diffusivity(cell), 0.0, 1e6) * p.k_per_diffusivity, p.k_most_mobile);
}

/// The harmonic mean, so that nothing crosses the edge of what does not move.
fn harmonic(a: f32, b: f32) -> f32 {
    if (a <= 0.0 || b <= 0.0) {
        return 0.0;
    }
    return 2.0 * a * (b / (a + b));
}

/// The explicit share of what is c in all.
fn explicit_of(c: f32) -> f32 { return min(0.5 * c + 1.0 / 12.0, min(c, p.k_explicit)); }

fn steepened(square: f32) -> f32 { return 1.0 / (1.0 - min(square, p.k_steepest)); }

/// The rise across the line at a cell, in metres per cell.
fn across(line: u32, i: u32) -> f32 {
    let here = place_of(line, i);
    let last = lines_of_all() - 1u;
    let joined = select(p.k_wraps_y, p.k_wraps_x, p.k_columns != 0u) != 0u;
    var before = here;
    if (line > 0u || joined) {
        before = place_of(select(line - 1u, last, line == 0u), i);
    }
    var behind = here;
    if (line < last || joined) {
        behind = place_of(select(line + 1u, 0u, line == last), i);
    }
    if (!is_ground(before)) {
        before = here;
    }
    if (!is_ground(behind)) {
        behind = here;
    }
    let share = select(1.0, 0.5, before != here && behind != here);
    return share * above(behind, before);
}

/// The face between two cells of a line, from the unknowns of the last iterate. `kind` is 0 for linear creep, 1 for the
/// tangent of Newton's method, 2 for the secant.
fn face(line: u32, i: u32, j: u32, kind: u32) -> Face {
    let a = place_of(line, i);
    let b = place_of(line, j);
    let level = harmonic(mobility(a), mobility(b));
    if (level <= 0.0) {
        return CLOSED;
    }
    let down = above(a, b);
    let beyond = select(down, 0.0, p.k_far != 0u);
    if (kind == 0u) {
        let e = explicit_of(level);
        return Face(e * down + (level - e) * beyond, level - e);
    }
    let scale = 1.0 / (p.critical_slope * p.cell_m);
    let crosswise = 0.5 * (across(line, i) + across(line, j)) * scale;
    let start = down * scale;
    let factor = steepened(start * start + crosswise * crosswise);
    let e = explicit_of(level * factor);
    let rest = level - e / factor;
    let down_end = beyond + (solved[a] - solved[b]);
    let along = down_end * scale;
    let square = along * along + crosswise * crosswise;
    let secant = steepened(square);
    var bend = 0.0;
    if (kind == 1u && square < p.k_steepest) {
        bend = 2.0 * along * along * secant * secant;
    }
    let implicit = rest * (secant + bend);
    return Face(e * down - rest * bend * down_end + implicit * beyond, implicit);
}

/// What the cells at the ends of a line do with what arrives.
struct Ends {
    first: u32,
    last: u32,
}

/// The flow across the first and the last face inside the line, after a solution.
var<private> first_face: Face;
var<private> last_face: Face;

/// Solves for the unknowns of a line of at least two cells.
fn solve(line: u32, kind: u32, hold: Ends, is_joined: bool) {
    let n = cells_of_line();
    let begin = select(0u, 1u, is_joined);
    var closing = CLOSED;
    if (is_joined) {
        closing = face(line, n - 1u, 0u, kind);
    }
    var before = CLOSED;
    if (is_joined) {
        before = face(line, 0u, 1u, kind);
    }
    let opening = before;
    var kept = 1.0;
    var solved_before = 0.0;
    var end_before = 0.0;
    for (var i = begin; i < n; i++) {
        var after = CLOSED;
        if (i + 1u < n) {
            after = face(line, i, i + 1u, kind);
        } else if (is_joined) {
            after = closing;
        }
        if (i == 0u) {
            first_face = after;
        }
        if (i + 1u == n) {
            last_face = before;
        }
        let cell = place_of(line, i);
        let is_held = (i == 0u && hold.first != FREE) || (i + 1u == n && hold.last != FREE);
        var rhs = 0.0;
        if (p.k_far != 0u) {
            rhs = start_of(cell);
        }
        var from_before = 0.0;
        var from_after = 0.0;
        if (!is_held) {
            rhs += before.given - after.given;
            from_before = before.implicit;
            from_after = after.implicit;
        }
        let stays = 1.0 + from_before * kept;
        let pivot = 1.0 / (stays + from_after);
        kept = stays * pivot;
        ratio[cell] = from_after * pivot;
        solved_before = (rhs + from_before * solved_before) * pivot;
        if (is_joined) {
            end_before = (1.0 + from_before * end_before) * pivot;
            ends[cell] = end_before;
        }
        solved[cell] = solved_before;
        before = after;
    }
    var behind = 0.0;
    var end_behind = 0.0;
    for (var k = n; k > begin; k--) {
        let cell = place_of(line, k - 1u);
        behind = solved[cell] + ratio[cell] * behind;
        solved[cell] = behind;
        if (is_joined) {
            end_behind = ends[cell] + ratio[cell] * end_behind;
            ends[cell] = end_behind;
        }
    }
    if (is_joined) {
        join(line, n, closing, opening);
    }
}

/// Joins the ends of a line that was solved with 0 at the first cell.
fn join(line: u32, n: u32, closing: Face, opening: Face) {
    let first = place_of(line, 0u);
    let second = place_of(line, 1u);
    let last = place_of(line, n - 1u);
    var rhs = closing.given - opening.given;
    if (p.k_far != 0u) {
        rhs += start_of(first);
    }
    let stays = 1.0 + closing.implicit * ends[last] + opening.implicit * ends[second];
    let joined = (rhs + closing.implicit * solved[last] + opening.implicit * solved[second]) / stays;
    solved[first] = joined;
    for (var i = 1u; i < n; i++) {
        let cell = place_of(line, i);
        solved[cell] += joined * (1.0 - ends[cell]);
    }
}

/// Makes a step along a line, with all iterations that it needs.
fn step_of(line: u32, hold: Ends, is_joined: bool) {
    if (p.critical_slope <= 0.0) {
        solve(line, 0u, hold, is_joined);
        return;
    }
    for (var i = 0u; i < cells_of_line(); i++) {
        let cell = place_of(line, i);
        solved[cell] = select(0.0, start_of(cell), p.k_far != 0u);
    }
    for (var iteration = 0u; iteration < 4u; iteration++) {
        solve(line, 1u, hold, is_joined);
    }
    solve(line, 2u, hold, is_joined);
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

/// Measures heights from that of the first ground from an end of the line on.
fn refer_to(line: u32, last: bool) {
    let n = cells_of_line();
    reference = 0.0;
    for (var k = 0u; k < n; k++) {
        let cell = place_of(line, select(k, n - 1u - k, last));
        if (is_ground(cell)) {
            reference = read_height(cell) + moved[cell];
            return;
        }
    }
}

@compute @workgroup_size(64)
fn lines(@builtin(global_invocation_id) id: vec3<u32>) {
    let line = id.x;
    if (line >= lines_of_all()) {
        return;
    }
    let n = cells_of_line();
    let columns = p.k_columns != 0u;
    let is_joined = select(p.k_wraps_x, p.k_wraps_y, columns) != 0u && n > 1u;
    let beside_first = select(p.k_north, p.k_west, columns);
    let beside_last = select(p.k_south, p.k_east, columns);
    let is_fixed = (line == 0u && beside_first == SIDE_BASE)
        || (line + 1u == lines_of_all() && beside_last == SIDE_BASE);
    if (is_fixed || n < 2u) {
        for (var i = 0u; i < n; i++) {
            let cell = place_of(line, i);
            solved[cell] = select(0.0, moved[cell], p.k_far != 0u);
        }
        return;
    }
    var hold = Ends(FREE, FREE);
    if (!is_joined) {
        hold = Ends(hold_of(select(p.k_west, p.k_north, columns)), hold_of(select(p.k_east, p.k_south, columns)));
    }
    // a sink that would give more than it gets is land, which may bring the other to give
    for (var round = 0u; round < 3u; round++) {
        refer_to(line, hold.first == FREE && hold.last != FREE);
        step_of(line, hold, is_joined);
        let both = hold.first != FREE && hold.last != FREE;
        let at_first = -crossing(first_face, line, 0u, 1u);
        if (p.k_far != 0u && both && hold.last == SINK) {
            refer_to(line, true);
            step_of(line, hold, is_joined);
        }
        let at_last = crossing(last_face, line, n - 2u, n - 1u);
        let first_gives = hold.first == SINK && at_first < -p.k_given;
        let last_gives = hold.last == SINK && at_last < -p.k_given;
        if (first_gives || last_gives) {
            hold = Ends(select(hold.first, FREE, first_gives), select(hold.last, FREE, last_gives));
            continue;
        }
        // nothing passes between two cells that keep their heights
        if (n > 2u || !both) {
            let own = 2u * (line + select(0u, p.ny, columns));
            left[own] += select(0.0, at_first, hold.first != FREE);
            left[own + 1u] += select(0.0, at_last, hold.last != FREE);
        }
        break;
    }
    if (p.k_far != 0u) {
        for (var i = 0u; i < n; i++) {
            let cell = place_of(line, i);
            solved[cell] = select(0.0, solved[cell] - (read_height(cell) - reference), is_ground(cell));
        }
    }
}
