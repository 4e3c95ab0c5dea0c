// Height gradients of crates/nodes/src/numerics/gradient.rs, from 3 x 3 cells of the input `height`.

fn height_of(x: u32, y: u32) -> f32 {
    return read_height(at(x, y));
}

/// A sample in the row `y` of the raster, or extrapolated beyond its ends, or at the other end where they are joined.
fn in_row(x: i32, y: u32) -> f32 {
    if (p.k_wraps_x != 0u) {
        return height_of(u32(cell_in_line(x, p.nx, true)), y);
    }
    if (x < 0) {
        let edge = height_of(0u, y);
        return edge + (edge - height_of(min(1u, p.nx - 1u), y));
    }
    if (u32(x) >= p.nx) {
        let edge = height_of(p.nx - 1u, y);
        return edge + (edge - height_of(u32(max(i32(p.nx) - 2, 0)), y));
    }
    return height_of(u32(x), y);
}

/// A sample of the raster, or beyond its sides.
fn padded(x: i32, y: i32) -> f32 {
    if (p.k_wraps_y != 0u) {
        return in_row(x, u32(cell_in_line(y, p.ny, true)));
    }
    if (y < 0) {
        let edge = in_row(x, 0u);
        return edge + (edge - in_row(x, min(1u, p.ny - 1u)));
    }
    if (u32(y) >= p.ny) {
        let edge = in_row(x, p.ny - 1u);
        return edge + (edge - in_row(x, u32(max(i32(p.ny) - 2, 0))));
    }
    return in_row(x, u32(y));
}

/// Slopes towards the east and the south after Horn (1981), in m/m.
fn horn(cell: vec2<u32>) -> vec2<f32> {
    let x = i32(cell.x);
    let y = i32(cell.y);
    let a = vec3<f32>(padded(x - 1, y - 1), padded(x, y - 1), padded(x + 1, y - 1));
    let b = vec2<f32>(padded(x - 1, y), padded(x + 1, y));
    let c = vec3<f32>(padded(x - 1, y + 1), padded(x, y + 1), padded(x + 1, y + 1));
    let scale = 0.125 / p.cell_m;
    let east = ((a.z - a.x) + 2.0 * (b.y - b.x) + (c.z - c.x)) * scale;
    let south = ((c.x - a.x) + 2.0 * (c.y - a.y) + (c.z - a.z)) * scale;
    return vec2<f32>(east, south);
}

/// Slopes towards the east and the south from the two neighbours, in m/m.
fn central(cell: vec2<u32>) -> vec2<f32> {
    let x = i32(cell.x);
    let y = i32(cell.y);
    let scale = 0.5 / p.cell_m;
    return vec2<f32>((padded(x + 1, y) - padded(x - 1, y)) * scale, (padded(x, y + 1) - padded(x, y - 1)) * scale);
}
