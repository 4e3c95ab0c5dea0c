// Transport of sediment by the water, and water that is lost to the air and the ground; see
// crates/nodes/src/erosion/hydraulic_pipe/transport.rs.

fn part_at(x: i32, y: i32) -> f32 { return part[at(column_of(x), row_of(y))]; }

fn load_at(x: i32, y: i32) -> f32 { return load[at(column_of(x), row_of(y))]; }

@compute @workgroup_size(64)
fn upwind(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let x = i32(cell.x);
    let y = i32(cell.y);
    let here = part[i];
    let from_west = west[i];
    let from_north = north[i];
    let to_east = west_at(cell.x + 1u, cell.y);
    let to_south = north_at(cell.x, cell.y + 1u);
    let gain_x = from_west * select(here, part_at(x - 1, y), from_west > 0.0)
        - to_east * select(part_at(x + 1, y), here, to_east > 0.0);
    let gain_y = from_north * select(here, part_at(x, y - 1), from_north > 0.0)
        - to_south * select(part_at(x, y + 1), here, to_south > 0.0);
    sediment[i] = positive(load[i] + p.k_step * (gain_x + gain_y));
}

/// How far water moves in a step, in cells.
fn way_of(cell: vec2<u32>) -> vec2<f32> {
    let i = at(cell.x, cell.y);
    let mean = 0.5 * (wet[i] + water[i]);
    let scale = 0.5 * p.k_step * film_of(mean) / select(1e-6, mean, mean > 1e-6);
    let across = (west[i] + west_at(cell.x + 1u, cell.y)) * scale;
    let down = (north[i] + north_at(cell.x, cell.y + 1u)) * scale;
    return clamp(vec2<f32>(across, down), vec2<f32>(-1.0), vec2<f32>(1.0));
}

fn weights_of(t: f32) -> vec3<f32> { return vec3<f32>(positive(-t), 1.0 - abs(t), positive(t)); }

fn along(row: vec3<f32>, w: vec3<f32>) -> f32 { return row.y * w.y + (row.x * w.x + row.z * w.z); }

/// Bilinear value at (x, y) cells from the middle of three rows.
fn between(above: vec3<f32>, row: vec3<f32>, below: vec3<f32>, way: vec2<f32>) -> f32 {
    let wx = weights_of(way.x);
    let wy = weights_of(way.y);
    return along(row, wx) * wy.y + (along(above, wx) * wy.x + along(below, wx) * wy.z);
}

fn loads(x: i32, y: i32) -> vec3<f32> { return vec3<f32>(load_at(x - 1, y), load_at(x, y), load_at(x + 1, y)); }

fn parts(x: i32, y: i32) -> vec3<f32> { return vec3<f32>(part_at(x - 1, y), part_at(x, y), part_at(x + 1, y)); }

fn traced(cell: vec2<u32>) -> f32 {
    let x = i32(cell.x);
    let y = i32(cell.y);
    return between(loads(x, y - 1), loads(x, y), loads(x, y + 1), -way_of(cell));
}

@compute @workgroup_size(64)
fn trace(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    sediment[at(cell.x, cell.y)] = traced(cell);
}

/// MacCormack's first pass.
@compute @workgroup_size(64)
fn predict(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    part[at(cell.x, cell.y)] = traced(cell);
}

/// Its second.
@compute @workgroup_size(64)
fn correct(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let x = i32(cell.x);
    let y = i32(cell.y);
    let way = way_of(cell);
    let source = loads(x, y);
    let image = parts(x, y);
    let value = image.y + 0.5 * (source.y - between(parts(x, y - 1), image, parts(x, y + 1), way));
    let beside = select(x + 1, x - 1, way.x > 0.0);
    let above = select(y + 1, y - 1, way.y > 0.0);
    let own = load_at(beside, y);
    let other = vec2<f32>(load_at(x, above), load_at(beside, above));
    let low = least(least(source.y, own), least(other.x, other.y));
    let high = most(most(source.y, own), most(other.x, other.y));
    sediment[at(cell.x, cell.y)] = least(most(value, low), high);
}

@compute @workgroup_size(64)
fn dry(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let i = at(cell.x, cell.y);
    let before = water[i];
    let left = positive(before * p.k_evaporation - p.k_infiltration);
    water[i] = left;
    lost[i] += before - left;
}
