// One sweep of crates/nodes/src/numerics/repose (`sweep`) over all cells of a grid; it needs shaders/lib/lines and
// shaders/lib/repose.
//
// `land` has the ground and the rise at repose of each cell, `moved` its gain so far. A sweep does nothing but copy once
// the one before it has found that all slopes rest, or has changed nothing.

struct Cell {
    ground: f32,
    moved: f32,
    rise: f32,
    layer: f32,
}

/// Flows across a corner, positive from south-east to north-west and from north-east to south-west, and the plane's
/// gradient there.
struct Corner {
    lean: vec2<f32>,
    falling: f32,
    rising: f32,
    is_steep: bool,
}

struct Flow {
    amount: f32,
    is_steep: bool,
}

fn cell_near(x: i32, y: i32) -> Cell {
    let i = cell_in_line(x, p.k_wide, p.k_wraps_x != 0u);
    let j = cell_in_line(y, p.k_high, p.k_wraps_y != 0u);
    if (i < 0 || j < 0) {
        return Cell(0.0, 0.0, CLOSED, 0.0);
    }
    let place = u32(j) * p.k_wide + u32(i);
    let gained = moved[place];
    var layer = 0.0;
    if (p.k_layered != 0u) {
        layer = max(loose[place] + gained, 0.0);
    }
    return Cell(land[place].x, gained, land[place].y, layer);
}

fn rise_to(a: Cell, b: Cell) -> f32 { return (b.ground - a.ground) + (b.moved - a.moved); }

/// 1 / √x to 5e-6 by the steps of the CPU, and 1e18 below 1e-36: in any order of the products nothing is infinite.
fn root_of(v: f32) -> f32 {
    let x = max(v, 1e-36);
    var y = bitcast<f32>(0x5f3759dfu - (bitcast<u32>(x) >> 1u));
    let half = 0.5 * x;
    y *= 1.5 - half * y * y;
    return y * (1.5 - half * y * y);
}

/// The fraction of a flow that exceeds repose, at a slope of that square.
fn share_of(square: f32, repose: f32) -> f32 {
    return select(0.0, max(1.0 - repose * root_of(square), 0.0), square > repose * repose);
}

/// Rounds the magnitude of a flow down to a multiple of the quantum, a power of two.
fn whole(flow: f32) -> f32 {
    let count = round(abs(flow) / p.k_quantum - 0.5);
    return select(count, -count, flow < 0.0) * p.k_quantum;
}

/// The flow along a diagonal from a donor's loose layer; `sides` are the heights of the other two cells of the corner
/// above the first.
fn given(half_rise: f32, sides: vec2<f32>, donor: f32, repose: f32) -> Flow {
    let over = 2.0 * half_rise;
    let top = max(over, 0.0) + p.k_wall * repose;
    let a = min(sides.x, top);
    let b = min(sides.y, top);
    let x = 0.5 * (over + (a - b));
    let y = 0.5 * (over - (a - b));
    let square = x * x + y * y;
    let share = share_of(square, repose);
    let along = 0.5 * over;
    let amount = whole(along * min(share, p.k_given_corner * donor * root_of(square)));
    let moves = abs(share * along) > 0.5 * p.k_tolerance * repose && abs(amount) > p.k_film * repose;
    return Flow(amount, moves);
}

/// The corner of four cells: north-west, north-east, south-west, south-east.
fn corner(nw: Cell, ne: Cell, sw: Cell, se: Cell) -> Corner {
    let repose = 0.25 * ((nw.rise + ne.rise) + (sw.rise + se.rise));
    if (repose > SHUT) {
        return Corner(vec2<f32>(0.0, 0.0), 0.0, 0.0, false);
    }
    let north = rise_to(nw, ne);
    let south = rise_to(sw, se);
    let west = rise_to(nw, sw);
    let east = rise_to(ne, se);
    let lean = vec2<f32>(0.5 * (north + south), 0.5 * (west + east));
    let fall = 0.5 * (lean.x + lean.y);
    let climb = 0.5 * (lean.x - lean.y);
    if (p.k_layered != 0u) {
        let falling = given(fall, vec2<f32>(north, west), select(nw.layer, se.layer, fall > 0.0), repose);
        let rising = given(climb, vec2<f32>(-west, south), select(sw.layer, ne.layer, climb > 0.0), repose);
        return Corner(lean, falling.amount, rising.amount, falling.is_steep || rising.is_steep);
    }
    let square = lean.x * lean.x + lean.y * lean.y;
    let share = share_of(square, repose);
    let limit = repose * (1.0 + p.k_tolerance);
    return Corner(lean, share * fall, share * climb, square > limit * limit);
}

/// The flow over the face between two cells; `lean` is the sum of the gradients in this direction at its two ends.
fn face(a: Cell, b: Cell, lean: f32) -> Flow {
    let repose = 0.5 * (a.rise + b.rise);
    if (repose > SHUT) {
        return Flow(0.0, false);
    }
    let rise = rise_to(a, b);
    let limit = max(repose, 0.5 * abs(lean));
    let flow = 0.5 * (rise - min(max(rise, -limit), limit));
    if (p.k_layered != 0u) {
        let limited = whole(min(max(flow, -(p.k_given_face * a.layer)), p.k_given_face * b.layer));
        return Flow(limited, abs(flow) > 0.5 * p.k_tolerance * repose && abs(limited) > p.k_film * repose);
    }
    return Flow(flow, abs(rise) > (1.0 + p.k_tolerance) * repose);
}

/// Raises a flag that many cells share; most of them find it up.
fn raise(flag: u32) {
    if (atomicLoad(&found[flag]) == 0u) {
        atomicStore(&found[flag], 1u);
    }
}

@compute @workgroup_size(64)
fn sweep(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (cell.x >= p.k_wide || cell.y >= p.k_high) {
        return;
    }
    let here = cell.y * p.k_wide + cell.x;
    if (p.k_turn > 0u) {
        let before = 2u * (p.k_turn - 1u);
        if (atomicLoad(&found[before]) == 0u || atomicLoad(&found[before + 1u]) == 0u) {
            next[here] = moved[here];
            return;
        }
    }
    let x = i32(cell.x);
    let y = i32(cell.y);
    let n = cell_near(x, y - 1);
    let w = cell_near(x - 1, y);
    let own = cell_near(x, y);
    let e = cell_near(x + 1, y);
    let s = cell_near(x, y + 1);
    let nw = corner(cell_near(x - 1, y - 1), n, w, own);
    let ne = corner(n, cell_near(x + 1, y - 1), own, e);
    let sw = corner(w, own, cell_near(x - 1, y + 1), s);
    let se = corner(own, e, s, cell_near(x + 1, y + 1));
    let to_west = face(w, own, nw.lean.x + sw.lean.x);
    let to_own = face(own, e, ne.lean.x + se.lean.x);
    let to_north = face(n, own, nw.lean.y + ne.lean.y);
    let from_south = face(own, s, sw.lean.y + se.lean.y);
    let faces = (to_own.amount - to_west.amount) + (from_south.amount - to_north.amount);
    let corners = (se.falling - nw.falling) + (ne.rising - sw.rising);
    let gained = own.moved + p.k_step * (faces + corners);
    next[here] = gained;
    if (nw.is_steep || ne.is_steep || sw.is_steep || se.is_steep || to_own.is_steep || from_south.is_steep) {
        raise(2u * p.k_turn);
    }
    if (gained != own.moved) {
        raise(2u * p.k_turn + 1u);
    }
}
