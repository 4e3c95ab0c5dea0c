// Discharge through the faces between cells; see crates/nodes/src/erosion/hydraulic_pipe/flow.rs. `drive` writes
// discharge before friction to `east` and `south`, of the faces west and north of a cell; `rub` applies friction.

struct Face {
    bed: vec2<f32>,
    water: vec2<f32>,
    lean: vec2<f32>,
}

/// Depth of water over a face, and the fall of its surface across it.
fn face(f: Face) -> vec2<f32> {
    let rise = f.bed.x - f.bed.y;
    let fall = rise + (f.water.x - f.water.y);
    let here = f.water.x + select(0.0, rise, rise < 0.0);
    let there = f.water.y - select(0.0, rise, rise > 0.0);
    let deeper = select(1.0 - f.lean.y, 1.0 + f.lean.x, fall > 0.0);
    return vec2<f32>(select(there, here, here > there) * deeper, fall);
}

fn lean_of(before: f32, here: f32, after: f32) -> f32 {
    let rise = here - before;
    let next = after - here;
    let product = rise * next;
    let sum = rise + next;
    let whole = abs(sum) * here;
    let lean = copy_sign(product * inverse(select(1e-30, whole, whole > 1e-30)), sum);
    return select(0.0, lean, product > 0.0 && here > p.k_dry);
}

fn lean_x(x: i32, y: u32) -> f32 {
    if (p.side_west != SIDE_PERIODIC && (x <= 0 || x + 1 >= i32(p.nx))) {
        return 0.0;
    }
    let column = i32(column_of(x));
    return lean_of(wet_in_row(column - 1, y), wet_in_row(column, y), wet_in_row(column + 1, y));
}

fn lean_y(x: u32, y: i32) -> f32 {
    if (p.side_north != SIDE_PERIODIC && (y <= 0 || y + 1 >= i32(p.ny))) {
        return 0.0;
    }
    let row = i32(row_of(y));
    return lean_of(wet_at(i32(x), row - 1), wet_at(i32(x), row), wet_at(i32(x), row + 1));
}

/// The face west of a cell.
fn west_face(x: u32, y: u32) -> Face {
    let i = i32(x);
    return Face(
        vec2<f32>(bed_in_row(i - 1, y), bed_in_row(i, y)),
        vec2<f32>(wet_in_row(i - 1, y), wet_in_row(i, y)),
        vec2<f32>(lean_x(i - 1, y), lean_x(i, y)),
    );
}

/// The face north of a cell.
fn north_face(x: u32, y: u32) -> Face {
    let i = i32(x);
    let j = i32(y);
    return Face(
        vec2<f32>(bed_at(i, j - 1), bed_at(i, j)),
        vec2<f32>(wet_at(i, j - 1), wet_at(i, j)),
        vec2<f32>(lean_y(x, j - 1), lean_y(x, j)),
    );
}

/// The discharge after a step of inertia and gravity, before friction.
fn driven(q: f32, f: Face) -> f32 {
    let over = face(f);
    let is_open = over.x > p.k_dry && abs(over.y) < p.k_highest;
    let fall = clamp(over.y, -p.k_steepest, p.k_steepest);
    return select(0.0, q + p.k_push * over.x * fall, is_open);
}

fn inverse_sixth_root(x: f32) -> f32 {
    let sum = f32(i32(bitcast<u32>(x) >> 9u)) * (1.0 / 6.0) + 12582912.0;
    let sixth = (bitcast<u32>(sum) << 9u) - 0x80000000u;
    let share = x * (1.0 / 6.0);
    var t = bitcast<f32>(0x4a0e1d03u - sixth);
    var cube = t * t * t;
    t = t * (1.1682667 - share * (cube * cube));
    cube = t * t * t;
    return t * (1.1666712 - share * (cube * cube));
}

/// The discharge after friction, limited to critical flow; `across` flows along the face.
fn rubbed(q: f32, across: f32, f: Face) -> f32 {
    let over = face(f).x;
    let depth = select(p.k_dry, over, over > p.k_dry);
    let root = inverse_sixth_root(depth);
    let root2 = root * root;
    let root3 = root2 * root;
    let root6 = root3 * root3;
    let sum = q * q + across * across;
    let square = select(1e30, sum, sum < 1e30);
    let per_norm = inverse_root(square);
    let drag = 1.0 + p.k_friction * (root6 * root6 * root2) * (square * per_norm);
    let left = 2.0 * inverse(1.0 + drag * inverse_root(drag));
    let critical = p.k_critical * (depth * depth) * root3 * per_norm;
    return q * select(critical, left, left < critical);
}

fn pipe(q: f32, f: Face) -> f32 {
    let over = face(Face(f.bed, f.water, vec2<f32>(0.0)));
    let is_open = over.x > p.k_dry && abs(over.y) < p.k_highest;
    let section = select(over.x, p.k_section, p.k_section > 0.0);
    return select(0.0, q * p.k_damping + p.k_push * section * over.y, is_open);
}

@compute @workgroup_size(64)
fn drive(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    east[i] = driven(west[i], west_face(cell.x, cell.y));
    south[i] = driven(north[i], north_face(cell.x, cell.y));
    if (cell.x + 1u == p.nx) {
        rim[driven_east(cell.y)] = driven(rim[face_east(cell.y)], west_face(p.nx, cell.y));
    }
    if (cell.y + 1u == p.ny) {
        rim[driven_south(cell.x)] = driven(rim[face_south(cell.x)], north_face(cell.x, p.ny));
    }
}

fn east_driven(x: u32, y: u32) -> f32 {
    if (x < p.nx) {
        return east[at(x, y)];
    }
    return rim[driven_east(y)];
}

fn south_driven(x: u32, y: u32) -> f32 {
    if (y < p.ny) {
        return south[at(x, y)];
    }
    return rim[driven_south(x)];
}

/// The mean discharge along the face west of a cell.
fn along_west(x: u32, y: u32) -> f32 {
    let before = column_of(i32(x) - 1);
    let after = column_of(i32(x));
    let near = south_driven(before, y) + south_driven(before, y + 1u);
    return 0.25 * (near + (south_driven(after, y) + south_driven(after, y + 1u)));
}

/// The mean discharge along the face north of a cell.
fn along_north(x: u32, y: u32) -> f32 {
    let above = row_of(i32(y) - 1);
    let below = row_of(i32(y));
    let near = east_driven(x, above) + east_driven(x + 1u, above);
    return 0.25 * (near + (east_driven(x, below) + east_driven(x + 1u, below)));
}

@compute @workgroup_size(64)
fn rub(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    west[i] = rubbed(east[i], along_west(cell.x, cell.y), west_face(cell.x, cell.y));
    north[i] = rubbed(south[i], along_north(cell.x, cell.y), north_face(cell.x, cell.y));
    if (cell.x + 1u == p.nx) {
        let along = along_west(p.nx, cell.y);
        rim[face_east(cell.y)] = rubbed(rim[driven_east(cell.y)], along, west_face(p.nx, cell.y));
    }
    if (cell.y + 1u == p.ny) {
        let along = along_north(cell.x, p.ny);
        rim[face_south(cell.x)] = rubbed(rim[driven_south(cell.x)], along, north_face(cell.x, p.ny));
    }
}

@compute @workgroup_size(64)
fn pipes(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    west[i] = pipe(west[i], west_face(cell.x, cell.y));
    north[i] = pipe(north[i], north_face(cell.x, cell.y));
    if (cell.x + 1u == p.nx) {
        rim[face_east(cell.y)] = pipe(rim[face_east(cell.y)], west_face(p.nx, cell.y));
    }
    if (cell.y + 1u == p.ny) {
        rim[face_south(cell.x)] = pipe(rim[face_south(cell.x)], north_face(cell.x, p.ny));
    }
}
