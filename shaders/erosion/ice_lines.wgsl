// One factor of an implicit step of the ice: tridiagonal systems along rows or columns, and what their solutions change
// of the fluxes; see crates/nodes/src/erosion/glacial/sheet.rs. It needs shaders/lib/ice and shaders/lib/parts.
//
// A workgroup solves LINES lines, each of them in up to PARTS parts of one invocation. Lines are networks: ice goes from
// cell to cell through faces, and what stays in a cell is its `keep`. An invocation eliminates the cells of its part one
// after the other, all but the last, which leaves a network of the last cells of all parts. The first invocation of a line
// solves that, and each finds the cells of its part from the last cells on either side. What cells keep and give are sums
// of positive numbers (W. K. Grassmann, M. I. Taksar and D. P. Heyman 1985), so that nothing cancels out.

/// What is known of a cell when those before it are eliminated. `back` goes to the last cell of the part before, `link`
/// comes from there.
struct Known {
    keep: f32,
    back: f32,
    link: f32,
    given: f32,
}

// for the last cell of each part what remains of it, and what its part adds to the last cell of the part before
var<workgroup> keep_of: array<f32, 256>;
var<workgroup> back_of: array<f32, 256>;
var<workgroup> link_of: array<f32, 256>;
var<workgroup> given_of: array<f32, 256>;
var<workgroup> beyond_keep: array<f32, 256>;
var<workgroup> beyond_given: array<f32, 256>;
/// Solutions for the last cells.
var<workgroup> last_of: array<f32, 256>;

fn is_along_columns() -> bool { return p.k_columns != 0u; }

fn cells_of_line() -> u32 { return select(p.k_nx, p.k_ny, is_along_columns()); }

fn lines_of_all() -> u32 { return select(p.k_ny, p.k_nx, is_along_columns()); }

fn place_of(line: u32, k: u32) -> u32 { return select(line * p.k_nx + k, k * p.k_nx + line, is_along_columns()); }

/// The face before a cell.
fn face_of(line: u32, k: u32) -> u32 { return select(west_of(k, line), north_of(line, k), is_along_columns()); }

/// Eliminates all cells of a part but the last.
fn eliminate(line: u32, first: u32, end: u32, own: u32, is_joined: bool) {
    let n = cells_of_line();
    let opening = face_of(line, first);
    var here = Known(1.0, p.k_scale * loss[opening], p.k_scale * gain[opening], delta[place_of(line, first)]);
    if (first == 0u && !is_joined) {
        here = Known(1.0 + here.back, 0.0, 0.0, here.given);
    }
    var beyond = vec2<f32>();
    for (var k = first; k + 1u < end; k++) {
        let cell = place_of(line, k);
        let through = face_of(line, k + 1u);
        let ahead = p.k_scale * gain[through];
        let behind = p.k_scale * loss[through];
        let pivot = 1.0 / ((here.keep + here.back) + ahead);
        delta[cell] = here.given * pivot;
        ends[cell] = here.link * pivot;
        ratio[cell] = behind * pivot;
        beyond += pivot * vec2<f32>(here.link * here.keep, here.back * here.given);
        let from_here = behind * pivot;
        here = Known(
            1.0 + from_here * here.keep,
            from_here * here.back,
            here.link * pivot * ahead,
            delta[place_of(line, k + 1u)] + ahead * pivot * here.given,
        );
    }
    if (end == n && !is_joined) {
        here.keep += p.k_scale * gain[face_of(line, n)];
    }
    keep_of[own] = here.keep;
    back_of[own] = here.back;
    link_of[own] = here.link;
    given_of[own] = here.given;
    beyond_keep[own] = beyond.x;
    beyond_given[own] = beyond.y;
}

/// Solves for the last cells of the parts of a line, of which the last closes the ring if the ends are joined.
fn join_parts(own: u32) {
    let last = own + (parts_of_line() - 1u) * LINES;
    // the last part is before the first one
    var beyond = vec2<f32>(beyond_keep[own], beyond_given[own]);
    var here = Known(keep_of[own], back_of[own], link_of[own], given_of[own]);
    for (var k = own; k < last; k += LINES) {
        let next = k + LINES;
        let keep = here.keep + beyond_keep[next];
        let given = here.given + beyond_given[next];
        let ahead = link_of[next];
        let behind = back_of[next];
        let pivot = 1.0 / ((keep + here.back) + ahead);
        beyond += pivot * vec2<f32>(here.link * keep, here.back * given);
        let from_here = behind * pivot;
        let after = Known(
            keep_of[next] + from_here * keep,
            from_here * here.back,
            here.link * pivot * ahead,
            given_of[next] + ahead * pivot * given,
        );
        given_of[k] = given * pivot;
        link_of[k] = here.link * pivot;
        back_of[k] = from_here;
        here = after;
    }
    let closing = (here.given + beyond.y) / (here.keep + beyond.x);
    last_of[last] = closing;
    var after = closing;
    for (var k = last; k > own; k -= LINES) {
        after = given_of[k - LINES] + link_of[k - LINES] * closing + back_of[k - LINES] * after;
        last_of[k - LINES] = after;
    }
}

/// Adds to the flux through a face what the solution changes. Nothing comes in through a side that is not joined.
fn correct(line: u32, k: u32, is_joined: bool) {
    let n = cells_of_line();
    let face = face_of(line, k);
    var before = 0.0;
    if (k > 0u || is_joined) {
        before = delta[place_of(line, select(k - 1u, n - 1u, k == 0u))];
    }
    var after = 0.0;
    if (k < n || is_joined) {
        after = delta[place_of(line, select(k, 0u, k == n))];
    }
    var through = flux[face] + (gain[face] * before - loss[face] * after);
    if (!is_joined && k == 0u) {
        through = min(through, 0.0);
    }
    if (!is_joined && k == n) {
        through = max(through, 0.0);
    }
    flux[face] = through;
}

@compute @workgroup_size(256)
fn lines(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) own: u32) {
    let n = cells_of_line();
    let line = group.x * LINES + own % LINES;
    let number = own / LINES;
    let is_joined = side_of(is_along_columns(), false) == SIDE_PERIODIC;
    let first = min(number * part_length(), n);
    let end = min(first + part_length(), n);
    let is_due = line < lines_of_all() && first < end;
    if (is_due) {
        eliminate(line, first, end, own, is_joined);
    }
    workgroupBarrier();
    if (is_due && number == 0u) {
        join_parts(own);
    }
    workgroupBarrier();
    if (is_due) {
        let before = last_of[select(own - LINES, (parts_of_line() - 1u) * LINES + own, number == 0u)];
        var after = last_of[own];
        delta[place_of(line, end - 1u)] = after;
        for (var k = end - 1u; k > first; k--) {
            let cell = place_of(line, k - 1u);
            after = delta[cell] + ends[cell] * before + ratio[cell] * after;
            delta[cell] = after;
        }
    }
    storageBarrier();
    workgroupBarrier();
    if (is_due) {
        for (var k = first; k < end; k++) {
            correct(line, k, is_joined);
        }
        if (end == n) {
            correct(line, n, is_joined);
        }
    }
}
