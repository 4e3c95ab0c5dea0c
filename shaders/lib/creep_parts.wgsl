// The implicit solution for lines of cells, in parts; see crates/nodes/src/erosion/creep/device.rs. It needs
// shaders/lib/parts and shaders/lib/creep_faces.
//
// A workgroup solves LINES lines beside each other, each of them in up to PARTS parts of one invocation. Lines are
// networks: cells hang on their neighbours by faces and on their height before the step by a weight. An invocation
// eliminates the cells of its part one after the other, all but the last, which leaves a network of the last cells of all
// parts. The first invocation of a line solves that, and each finds the cells of its part from the last cells on either
// side. All weights are sums of positive numbers, so that nothing cancels out.

/// What the cells at the ends of a line do with what arrives.
struct Ends {
    first: u32,
    last: u32,
}

const FREE: u32 = 0u;
const SINK: u32 = 1u;
const FIXED: u32 = 2u;

/// The cells of a line that an invocation solves for, from `first` to before `end`; none if it has nothing to do.
struct Part {
    line: u32,
    number: u32,
    first: u32,
    end: u32,
}

/// What is known of a cell when those before it are eliminated: the shares of its own weight and of the last cell of the
/// part before, and the unknown as far as it does not depend on that cell.
struct Known {
    weight: f32,
    link: f32,
    found: f32,
}

/// The cell from which links to it begin.
const ORIGIN = Known(0.0, 1.0, 0.0);

// for the last cell of each part what the cells of its part add to its weight and right-hand side, and the link to the
// last cell of the part before, to which they add the numbers `beyond`
var<workgroup> weight_of: array<f32, 256>;
var<workgroup> given_of: array<f32, 256>;
var<workgroup> link_of: array<f32, 256>;
var<workgroup> beyond_weight: array<f32, 256>;
var<workgroup> beyond_given: array<f32, 256>;
/// Unknowns of the last cells.
var<workgroup> last_of: array<f32, 256>;

/// The flow across the first and the last face inside the line, after a solution, in the first and the last part.
var<private> first_face: Face;
var<private> last_face: Face;

/// A height in the line, in metres: that of an end which keeps its height, so that the small heights above it, with which
/// flows to it are computed, have all digits.
var<private> reference: f32;

/// The height before the step above the reference; 0 in holes.
fn start_of(ground: Ground) -> f32 {
    return select(0.0, (ground.height - reference) + ground.moved, is_solid(ground.height));
}

/// The part, if something is to be done for it.
fn only(part: Part, is_due: bool) -> Part {
    return Part(part.line, part.number, select(0u, part.first, is_due), select(0u, part.end, is_due));
}

/// Eliminates all cells of a part but the last. `before` and `behind` are the faces at its ends.
fn eliminate(part: Part, own: u32, kind: u32, hold: Ends, opening: Face, closing: Face) {
    let n = cells_of_line();
    var here = ground_at(part.line, part.first, kind);
    var before = opening;
    var known = ORIGIN;
    var beyond = vec2<f32>();
    for (var i = part.first; i + 1u < part.end; i++) {
        let next = ground_at(part.line, i + 1u, kind);
        let after = face(here, next, kind);
        if (i == 0u) {
            first_face = after;
        }
        var given = select(0.0, start_of(here), p.k_far != 0u);
        var from_before = 0.0;
        var from_after = 0.0;
        if (i > 0u || hold.first == FREE) {
            given += before.given - after.given;
            from_before = before.implicit;
            from_after = after.implicit;
        }
        let weight = 1.0 + from_before * known.weight;
        let link = from_before * known.link;
        let pivot = 1.0 / ((weight + link) + from_after);
        known = Known(weight * pivot, link * pivot, (given + from_before * known.found) * pivot);
        beyond += link * vec2<f32>(known.weight, known.found);
        let cell = place_of(part.line, i);
        ratio[cell] = from_after * pivot;
        ends[cell] = known.link;
        solved[cell] = known.found;
        here = next;
        before = after;
    }
    var given = select(0.0, start_of(here), p.k_far != 0u);
    if (part.end < n || hold.last == FREE) {
        given += (before.given - closing.given) + before.implicit * known.found;
    }
    if (part.end == n) {
        last_face = before;
    }
    weight_of[own] = before.implicit * known.weight;
    link_of[own] = before.implicit * known.link;
    given_of[own] = given;
    beyond_weight[own] = beyond.x;
    beyond_given[own] = beyond.y;
}

/// Solves for the last cells of the parts of a line, of which the last closes the ring if the ends are joined.
fn join_parts(own: u32, is_held: bool) {
    let last = (parts_of_line() - 1u) * LINES + own;
    var known = ORIGIN;
    var beyond = vec2<f32>(beyond_weight[own], beyond_given[own]);
    for (var k = own; k < last; k += LINES) {
        let from_before = link_of[k];
        let from_after = link_of[k + LINES];
        let weight = 1.0 + weight_of[k] + beyond_weight[k + LINES] + from_before * known.weight;
        let link = from_before * known.link;
        let given = given_of[k] + beyond_given[k + LINES] + from_before * known.found;
        let pivot = 1.0 / ((weight + link) + from_after);
        known = Known(weight * pivot, link * pivot, given * pivot);
        beyond += link * vec2<f32>(known.weight, known.found);
        weight_of[k] = known.link;
        link_of[k] = from_after * pivot;
        given_of[k] = known.found;
    }
    var behind = given_of[last];
    if (!is_held) {
        let weight = 1.0 + weight_of[last] + link_of[last] * known.weight + beyond.x;
        behind = (behind + link_of[last] * known.found + beyond.y) / weight;
    }
    let closing = behind;
    last_of[last] = behind;
    for (var k = last; k > own; k -= LINES) {
        behind = given_of[k - LINES] + weight_of[k - LINES] * closing + link_of[k - LINES] * behind;
        last_of[k - LINES] = behind;
    }
}

/// Solves for the unknowns of a line of at least two cells.
fn solve(part: Part, own: u32, kind: u32, hold: Ends, is_joined: bool) {
    let n = cells_of_line();
    let is_due = part.first < part.end;
    // before others replace the last iterate
    var opening = CLOSED;
    if (is_due && (part.first > 0u || is_joined)) {
        let i = select(part.first - 1u, n - 1u, part.first == 0u);
        opening = face(ground_at(part.line, i, kind), ground_at(part.line, part.first, kind), kind);
    }
    var closing = CLOSED;
    if (is_due && (part.end < n || is_joined)) {
        let j = select(part.end, 0u, part.end == n);
        closing = face(ground_at(part.line, part.end - 1u, kind), ground_at(part.line, j, kind), kind);
    }
    storageBarrier();
    workgroupBarrier();
    if (is_due) {
        eliminate(part, own, kind, hold, opening, closing);
    }
    workgroupBarrier();
    if (is_due && part.number == 0u) {
        join_parts(own, hold.last != FREE);
    }
    workgroupBarrier();
    if (is_due) {
        let before = last_of[select(own - LINES, (parts_of_line() - 1u) * LINES + own, part.number == 0u)];
        var behind = last_of[own];
        solved[place_of(part.line, part.end - 1u)] = behind;
        for (var k = part.end - 1u; k > part.first; k--) {
            let cell = place_of(part.line, k - 1u);
            behind = solved[cell] + ends[cell] * before + ratio[cell] * behind;
            solved[cell] = behind;
        }
    }
    storageBarrier();
    workgroupBarrier();
}
