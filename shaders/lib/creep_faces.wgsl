// Faces between the cells of a line that creeps; see crates/nodes/src/numerics/hillslope. Cells beside each other on
// neighbouring lines are beside each other in all rasters: those for rows have rows and columns exchanged.

/// The flow across the face between two cells: `given`, and `implicit` for each metre that the unknown before it is
/// above that behind it.
struct Face {
    given: f32,
    implicit: f32,
}

const CLOSED = Face(0.0, 0.0);

/// What faces depend on. `across` is the rise across the line, in metres per cell, and `found` the unknown of the last
/// iterate, both only for creep that is not linear.
struct Ground {
    height: f32,
    moved: f32,
    mobility: f32,
    across: f32,
    found: f32,
}

/// How faces are computed: linear, with the tangent of Newton's method, with the secant.
const LINEAR: u32 = 0u;
const TANGENT: u32 = 1u;
const SECANT: u32 = 2u;

fn cells_of_line() -> u32 { return select(p.nx, p.ny, p.k_columns != 0u); }

fn lines_of_all() -> u32 { return select(p.ny, p.nx, p.k_columns != 0u); }

fn place_of(line: u32, i: u32) -> u32 { return i * lines_of_all() + line; }

fn is_solid(height: f32) -> bool { return abs(height) < p.k_highest; }

/// The height above another cell, which heights alone would round.
fn above(a: Ground, b: Ground) -> f32 { return (a.height - b.height) + (a.moved - b.moved); }

/// The rise across the line at a cell.
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
    if (!is_solid(read_height(before))) {
        before = here;
    }
    if (!is_solid(read_height(behind))) {
        behind = here;
    }
    let share = select(1.0, 0.5, before != here && behind != here);
    return share * ((read_height(behind) - read_height(before)) + (moved[behind] - moved[before]));
}

fn ground_at(line: u32, i: u32, kind: u32) -> Ground {
    let cell = place_of(line, i);
    let height = read_height(cell);
    var mobility = 0.0;
    if (is_solid(height)) {
        mobility = min(clamp(read_diffusivity(cell), 0.0, 1e6) * p.k_per_diffusivity, p.k_most_mobile);
    }
    var ground = Ground(height, moved[cell], mobility, 0.0, 0.0);
    if (kind != LINEAR) {
        ground.across = across(line, i);
        ground.found = solved[cell];
    }
    return ground;
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

/// The face between two cells of a line.
fn face(a: Ground, b: Ground, kind: u32) -> Face {
    let level = harmonic(a.mobility, b.mobility);
    if (level <= 0.0) {
        return CLOSED;
    }
    let down = above(a, b);
    let beyond = select(down, 0.0, p.k_far != 0u);
    if (kind == LINEAR) {
        let e = explicit_of(level);
        return Face(e * down + (level - e) * beyond, level - e);
    }
    let scale = 1.0 / (p.critical_slope * p.cell_m);
    let crosswise = 0.5 * (a.across + b.across) * scale;
    let start = down * scale;
    let factor = steepened(start * start + crosswise * crosswise);
    let e = explicit_of(level * factor);
    let rest = level - e / factor;
    let down_end = beyond + (a.found - b.found);
    let along = down_end * scale;
    let square = along * along + crosswise * crosswise;
    let secant = steepened(square);
    var bend = 0.0;
    if (kind == TANGENT && square < p.k_steepest) {
        bend = 2.0 * along * along * secant * secant;
    }
    let implicit = rest * (secant + bend);
    return Face(e * down - rest * bend * down_end + implicit * beyond, implicit);
}
